//! From what was filled in to what is attached.

use intrados_scene::structure::Date;

use super::*;
use crate::lang::typed;

impl Form {
    /// What is attached, or what has to be filled in first.
    pub(super) fn attachment(&self) -> Result<Attachment, String> {
        let text = |text: &str| Some(text.trim().to_owned()).filter(|t| !t.is_empty());
        let from = number(&tr!("along|place"), &self.from)?;
        let to = number(&tr!("along|place"), &self.to)?;
        let date = text(&self.date)
            .map(|d| d.parse::<Date>().map_err(|why| tr!("date: {}", term(&why.to_string()))))
            .transpose()?;
        let what = self.what()?;
        let is_finding = matches!(what, What::Finding(_));
        let is_slices = matches!(what, What::Slices { .. } | What::Stack { .. });
        Ok(Attachment {
            member: self.member.clone(),
            name: text(&self.name),
            date,
            along: from.map(|from| [from, to.filter(|_| !is_slices).unwrap_or(from)]),
            face: self.face,
            angle_deg: None,
            height_m: number(&tr!("height"), &self.height_m)?.filter(|_| is_finding),
            instrument: text(&self.instrument).filter(|_| !is_slices),
            picture: text(&self.picture).filter(|_| is_finding).map(PathBuf::from),
            confirmed: self.confirmed && !is_slices,
            what,
        })
    }

    fn what(&self) -> Result<What, String> {
        let files = || match &self.files[..] {
            [] => Err(tr!("Add a file first.")),
            files => Ok(files.to_vec()),
        };
        match self.sort {
            None => Err(tr!("Choose what is attached.")),
            Some(Sort::Finding) => self.finding().map(What::Finding),
            Some(Sort::Table) => match &files()?[..] {
                [file] => Ok(What::Table {
                    file: file.clone(),
                    kind: KINDS.get(self.kind).and_then(|k| k.1),
                    unit: Some(self.unit.trim().to_owned()).filter(|u| !u.is_empty()),
                    test: Some(self.test.trim().to_owned()).filter(|t| !t.is_empty()),
                    electrode: Electrode::default(),
                }),
                _ => Err(tr!("A table is attached alone: one after another.")),
            },
            Some(Sort::Slices) => Ok(What::Slices {
                files: files()?,
                pixel_mm: number(&tr!("pixel"), &self.pixel_mm)?,
                cut: self.cut()?,
            }),
            Some(Sort::Stack) => {
                let (files, voxel_mm, cut) = (files()?, self.voxel()?, self.cut()?);
                Ok(What::Stack { files, voxel_mm, raw: None, cut })
            }
        }
    }

    fn cut(&self) -> Result<Cut, String> {
        let depth: Option<f32> = number(&tr!("depth|of damage"), &self.depth_mm)?;
        let diameter_mm = number(&tr!("diameter"), &self.diameter_mm)?;
        Ok(Cut { depth_m: depth.map(|mm| 1e-3 * mm), diameter_mm, axis: None })
    }

    fn voxel(&self) -> Result<Option<[f32; 3]>, String> {
        if self.voxel_mm.trim().is_empty() {
            return Ok(None);
        }
        let edges: Option<Vec<f32>> =
            self.voxel_mm.split(',').map(|edge| edge.trim().parse().ok()).collect();
        match edges.as_deref() {
            Some([x, y, z]) => Ok(Some([*x, *y, *z])),
            _ => Err(tr!("voxel: three numbers, such as 0.1, 0.1, 0.2")),
        }
    }

    fn finding(&self) -> Result<Finding, String> {
        let (name, measured) = FINDINGS.get(self.finding).copied().unwrap_or_default();
        let value: Option<f64> = number(&term(measured), &self.value)?;
        let needed = || value.ok_or_else(|| tr!("Fill in its {}.", term(measured)));
        let error = number(&tr!("standard error"), &self.error)?;
        let area_m2 = needed;
        Ok(match name {
            "crack" => Finding::Crack {
                width_mm: needed()?,
                std_error_mm: error,
                course: COURSES.get(self.course).map_or(Course::Map, |c| c.1),
                length_m: number(&tr!("length"), &self.length_m)?,
            },
            "spall" => Finding::Spall {
                area_m2: area_m2()?,
                depth_mm: number(&tr!("depth|of damage"), &self.depth_mm)?,
                bars_bare: false,
            },
            "rust stain" => Finding::Rust { area_m2: area_m2()? },
            "efflorescence" => Finding::Efflorescence { area_m2: area_m2()? },
            "wet spot" => Finding::WetSpot { area_m2: area_m2()? },
            "cover" => Finding::Cover { mm: needed()?, std_error_mm: error },
            "carbonation" => Finding::Carbonation { mm: needed()?, std_error_mm: error },
            _ => Finding::Intact,
        })
    }
}

/// A number that was typed; none: nothing was.
fn number<T: std::str::FromStr>(name: &str, text: &str) -> Result<Option<T>, String> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(None);
    }
    typed(text).map(Some).ok_or_else(|| tr!("{}: “{}” is no number", name, text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_form_says_what_is_missing_and_then_what_is_attached() {
        let mut form = Form::default();
        form.begin("C1", Vec::new());
        assert_eq!(form.attachment().unwrap_err(), "Fill in its width, mm.");
        form.value = "0,35".into();
        (form.from, form.date) = ("0.4".into(), "2026-13-01".into());
        assert!(form.attachment().unwrap_err().starts_with("date: "));
        form.date = "2026-05-03".into();
        let what = form.attachment().unwrap();
        let crack = Finding::Crack {
            width_mm: 0.35,
            std_error_mm: None,
            course: Course::Along,
            length_m: None,
        };
        assert_eq!((what.what, what.along), (What::Finding(crack), Some([0.4, 0.4])));
        assert!(!what.confirmed);
        form.confirmed = true;
        assert!(form.attachment().unwrap().confirmed);
        form.begin("C1", vec!["gauges.csv".into()]);
        assert!(matches!(form.attachment().unwrap().what, What::Table { .. }));
        form.begin("C1", vec!["a.tif".into(), "b.tif".into()]);
        form.from = "half".into();
        assert_eq!(form.attachment().unwrap_err(), "along: “half” is no number");
    }
}
