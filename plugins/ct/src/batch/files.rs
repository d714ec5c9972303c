//! Detection as files: labels, pictures and tables of each slice.

use intrados_stage::{
    csv::{Table, number},
    file::{Set, WriteError, file_name, put_into},
};
use serde::de::DeserializeOwned;
use tiff::encoder::{TiffEncoder, colortype};

use super::{Batch, Found};
use crate::{
    crack::Crack,
    detect::{Detection, Pore},
    picture::slice_pictures,
};
use intrados_raster::grid::Mask;

/// Detection on its way into a set of files: each slice's labels as a 32-bit TIFF and its outlines
/// as a PNG, and the tables of all. Slices that are done are kept in the set until it is published.
#[derive(Debug)]
pub struct DetectionWriter<'a> {
    files: &'a mut Set,
    slices: usize,
    /// Of the files that were there before the slice at work.
    before: usize,
}

impl<'a> DetectionWriter<'a> {
    /// The list of its files.
    pub const LIST: &'static str = "detect.json";
    const PORES: &'static str = "pores.csv";
    const CRACKS: &'static str = "cracks.csv";

    /// Begins with a set that has no files yet. The key of the set names the program and the
    /// settings.
    pub fn new(files: &'a mut Set) -> Self {
        // Users look at the tables first.
        [Self::PORES, Self::CRACKS, Self::LIST].into_iter().for_each(|name| _ = files.place(name));
        Self { before: files.files().len(), files, slices: 0 }
    }

    /// What was kept of the next slice, if an earlier run has done it; its files then are those of
    /// that run.
    pub(crate) fn known<T: DeserializeOwned>(&mut self, part: &str) -> Option<T> {
        let known = self.files.recall(&self.name(self.slices + 1, part))?;
        self.slices += 1;
        Some(known)
    }

    /// One slice more.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn slice(
        &mut self,
        slice: &Found,
        found: &Detection,
        mask: Option<&Mask>,
    ) -> Result<(), WriteError> {
        self.slices += 1;
        self.before = self.files.files().len();
        let (number, stem) =
            (self.slices, file_name(&slice.file.file_stem().unwrap_or_default().to_string_lossy()));
        let [_, overlay] = slice_pictures(found, mask);
        if let Some(png) = overlay.png() {
            put_into(self.files, &format!("{number:03}_{stem}_overlay.png"), &png)?;
        }
        let name = format!("{number:03}_{stem}_labels.tif");
        let mut bytes = std::io::Cursor::new(Vec::new());
        let (w, h) = (slice.width as u32, slice.height as u32);
        TiffEncoder::new(&mut bytes)
            .and_then(|mut tiff| tiff.write_image::<colortype::Gray32>(w, h, &found.labels.data))
            .map_err(|e| WriteError {
                path: self.files.folder().join(&name),
                source: std::io::Error::other(e),
            })?;
        put_into(self.files, &name, bytes.get_ref())
    }

    /// Keeps that slice, so that a run that is broken off needs not do it again.
    pub(crate) fn keep(&self, part: &str, value: &impl serde::Serialize) {
        let files = self.files.files();
        let own = files[self.before..]
            .iter()
            .filter_map(|f| Some(f.file_name()?.to_string_lossy().into_owned()));
        self.files.keep(&self.name(self.slices, part), own.collect(), value);
    }

    /// Files are numbered: a slice that comes at another place has others.
    fn name(&self, number: usize, part: &str) -> String {
        format!("{number} {part}")
    }

    /// Writes the tables. What is left is the list.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn tables(self, batch: &Batch) -> Result<(), WriteError> {
        let several =
            |s: &Found| batch.slices.iter().any(|o| o.file == s.file && o.layer != s.layer);
        let name = |s: &Found| {
            if several(s) {
                format!("{}#{}", s.file.display(), s.layer)
            } else {
                s.file.display().to_string()
            }
        };
        let names: Vec<String> = batch.slices.iter().map(name).collect();
        let rows = batch.slices.iter().zip(&names).map(|(s, name)| (["", "", name], &*s.table));
        put_into(self.files, Self::PORES, pores_csv(rows).as_bytes())?;
        let cracks =
            cracks_csv(batch.slices.iter().zip(&names).map(|(s, name)| (&**name, &*s.crack_table)));
        put_into(self.files, Self::CRACKS, cracks.as_bytes())
    }
}

/// One row a pore. `slices`: member, core and slice, and the pores in it.
#[must_use]
pub fn pores_csv<'a>(slices: impl Iterator<Item = ([&'a str; 3], &'a [Pore])>) -> String {
    let mut table = Table::new(&[
        "member",
        "core",
        "slice",
        "label",
        "x [mm]",
        "y [mm]",
        "area [px]",
        "area [mm2]",
        "diameter [mm]",
        "circularity [1]",
        "depth [mm]",
        "missing_mass [px]",
        "volume [mm3]",
        "to_bar [mm]",
    ]);
    for ([member, core, slice], pores) in slices {
        for p in pores {
            let numbers = [
                p.x_mm,
                p.y_mm,
                p.area_px as f64,
                p.area_mm2,
                p.diameter_mm,
                p.circularity,
                p.depth_mm,
                p.missing_mass,
            ];
            let mut cells = [member, core, slice].map(str::to_owned).to_vec();
            cells.push(p.label.to_string());
            cells.extend(numbers.map(|v| number(Some(v))));
            cells.extend([number(Some(p.volume_mm3)), number(p.bar_mm)]);
            table.row(&cells);
        }
    }
    table.text()
}

/// One row a crack. `slices`: what each is called, and the cracks in it.
#[must_use]
pub(crate) fn cracks_csv<'a>(slices: impl Iterator<Item = (&'a str, &'a [Crack])>) -> String {
    let mut table = Table::new(&[
        "slice",
        "crack",
        "x [mm]",
        "y [mm]",
        "length [px]",
        "length [mm]",
        "width [mm]",
    ]);
    for (slice, cracks) in slices {
        for (n, c) in cracks.iter().enumerate() {
            let mut cells = vec![slice.to_owned(), (n + 1).to_string()];
            cells.extend(
                [c.at_mm[0], c.at_mm[1], c.length_px, c.length_mm, c.width_mm]
                    .map(|v| number(Some(v))),
            );
            table.row(&cells);
        }
    }
    table.text()
}
