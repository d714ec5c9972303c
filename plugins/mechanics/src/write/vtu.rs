//! VTU (VTK's XML for unstructured grids, arrays inline in base64) and PVD (a list of them over
//! time).

use std::{
    fmt::Write as _,
    io::{self, Write},
    path::{Path, PathBuf},
};

use base64::{engine::general_purpose::STANDARD, write::EncoderWriter};
use glam::DVec3;
use intrados_stage::file::WriteError;

use super::{invalid, put};
use crate::mesh::Mesh;

/// Numbers at points or in cells.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Name with its unit: `stress_pa`.
    pub name: &'a str,
    /// Numbers at each point or cell: 1, 3 (vectors) or 6 (symmetric tensors xx, yy, zz, xy, yz,
    /// zx), for example.
    pub components: usize,
    /// All of them, one point or cell after another.
    pub values: &'a [f64],
}

/// Points and cells of one VTU file.
#[derive(Debug, Clone, Default)]
pub struct Grid<'a> {
    points: std::borrow::Cow<'a, [DVec3]>,
    connectivity: Vec<i32>,
    offsets: Vec<i64>,
    types: Vec<u8>,
    regions: Vec<i32>,
    /// Hash of the scene that it was computed of; empty: nobody says.
    scene: &'a str,
}

/// VTK's numbers for cells.
const LINE: u8 = 3;
const TRIANGLE: u8 = 5;
const QUAD: u8 = 9;
const HEXAHEDRON: u8 = 12;

impl<'a> Grid<'a> {
    /// Hexahedra, then shells, then interfaces (as flat hexahedra) of a mesh; cell fields come in
    /// this order. Rods are a file of their own ([`Grid::rods`]): they have other fields.
    #[must_use]
    pub fn solids(mesh: &'a Mesh) -> Self {
        let mut grid = Self { points: mesh.nodes.as_slice().into(), ..Self::default() };
        mesh.hexes.iter().for_each(|c| grid.push(HEXAHEDRON, &c.nodes, c.region));
        mesh.shells.iter().for_each(|c| grid.push(QUAD, &c.nodes, c.region));
        mesh.interfaces.iter().for_each(|c| grid.push(HEXAHEDRON, &c.nodes, c.region));
        grid
    }

    /// Bars between points of their own (embedded bars and tendons) or the mesh's.
    #[must_use]
    pub(crate) fn rods(points: &'a [DVec3], rods: &[[u32; 2]]) -> Self {
        let mut grid = Self { points: points.into(), ..Self::default() };
        rods.iter().for_each(|nodes| grid.push(LINE, nodes, 0));
        grid
    }

    /// Triangles between points; `regions` one a triangle.
    #[must_use]
    pub fn triangles(points: &'a [DVec3], triangles: &[[u32; 3]], regions: &[u32]) -> Self {
        let mut grid = Self { points: points.into(), ..Self::default() };
        triangles
            .iter()
            .zip(regions)
            .for_each(|(nodes, &region)| grid.push(TRIANGLE, nodes, region));
        grid
    }

    /// Cells of any kind between points: VTK's number, nodes and region of each.
    #[must_use]
    pub(crate) fn of<'b>(
        points: &'a [DVec3],
        cells: impl Iterator<Item = (u8, &'b [u32], u32)>,
    ) -> Self {
        let mut grid = Self { points: points.into(), ..Self::default() };
        cells.for_each(|(kind, nodes, region)| grid.push(kind, nodes, region));
        grid
    }

    /// Says in the file of which scene it is, by the hash that pictures and JSON of it have.
    #[must_use]
    pub fn of_scene(self, hash: &'a str) -> Self {
        Self { scene: hash, ..self }
    }

    fn push(&mut self, kind: u8, nodes: &[u32], region: u32) {
        self.connectivity.extend(nodes.iter().map(|&n| n as i32));
        self.offsets.push(self.connectivity.len() as i64);
        self.types.push(kind);
        self.regions.push(region as i32);
    }

    /// Cells.
    #[must_use]
    pub(crate) fn cells(&self) -> usize {
        self.types.len()
    }

    /// Writes the grid with its fields; every cell's region is written too.
    ///
    /// # Errors
    /// The file cannot be written; a field has the wrong number of values, no name, or a name
    /// twice.
    pub fn write(
        &self,
        path: &Path,
        points: &[Field<'_>],
        cells: &[Field<'_>],
    ) -> Result<(), WriteError> {
        put(path, |out| {
            check(points, self.points.len(), "points")?;
            check(cells, self.cells(), "cells")?;
            writeln!(out, r#"<?xml version="1.0"?>"#)?;
            writeln!(
                out,
                r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#
            )?;
            // A comment, since not every reader knows fields of text. It must have no “--”.
            let of = match self.scene {
                "" => String::new(),
                hash => format!(", scene hash {}", hash.replace('-', "_")),
            };
            writeln!(out, "<!-- intrados {}{of} -->", env!("CARGO_PKG_VERSION"))?;
            writeln!(
                out,
                r#"<UnstructuredGrid><Piece NumberOfPoints="{}" NumberOfCells="{}">"#,
                self.points.len(),
                self.cells()
            )?;
            writeln!(out, "<Points>")?;
            let bytes = 24 * self.points.len();
            array(
                out,
                r#"type="Float64" Name="Points" NumberOfComponents="3""#,
                bytes,
                self.points.iter().flat_map(|p| p.to_array()).map(f64::to_le_bytes),
            )?;
            writeln!(out, "</Points><Cells>")?;
            array(
                out,
                r#"type="Int32" Name="connectivity""#,
                4 * self.connectivity.len(),
                self.connectivity.iter().map(|n| n.to_le_bytes()),
            )?;
            array(
                out,
                r#"type="Int64" Name="offsets""#,
                8 * self.offsets.len(),
                self.offsets.iter().map(|n| n.to_le_bytes()),
            )?;
            array(
                out,
                r#"type="UInt8" Name="types""#,
                self.types.len(),
                self.types.iter().map(|n| n.to_le_bytes()),
            )?;
            writeln!(out, "</Cells><PointData>")?;
            points.iter().try_for_each(|f| field(out, f))?;
            writeln!(out, "</PointData><CellData>")?;
            array(
                out,
                r#"type="Int32" Name="region""#,
                4 * self.regions.len(),
                self.regions.iter().map(|n| n.to_le_bytes()),
            )?;
            cells.iter().try_for_each(|f| field(out, f))?;
            writeln!(out, "</CellData></Piece></UnstructuredGrid></VTKFile>")
        })
    }
}

fn check(fields: &[Field<'_>], count: usize, what: &str) -> io::Result<()> {
    for (i, f) in fields.iter().enumerate() {
        if f.name.is_empty() || f.name == "region" || fields[..i].iter().any(|g| g.name == f.name) {
            return Err(invalid(format!(
                "field {:?}: a name that is empty, taken or there twice",
                f.name
            )));
        }
        if f.components == 0 || f.values.len() != f.components * count {
            return Err(invalid(format!(
                "field {}: {} values for {count} {what} of {} components",
                f.name,
                f.values.len(),
                f.components
            )));
        }
    }
    Ok(())
}

fn field(out: &mut dyn Write, f: &Field<'_>) -> io::Result<()> {
    let mut attributes = format!(
        r#"type="Float64" Name="{}" NumberOfComponents="{}""#,
        escape(f.name),
        f.components
    );
    if f.components == 6 {
        for (i, name) in ["xx", "yy", "zz", "xy", "yz", "zx"].iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = write!(attributes, r#" ComponentName{i}="{name}""#);
        }
    }
    array(out, &attributes, 8 * f.values.len(), f.values.iter().map(|v| v.to_le_bytes()))
}

/// One `DataArray`: the number of bytes, then the bytes, each in base64 of its own as VTK wants it.
fn array<const N: usize>(
    out: &mut dyn Write,
    attributes: &str,
    bytes: usize,
    values: impl Iterator<Item = [u8; N]>,
) -> io::Result<()> {
    write!(out, r#"<DataArray {attributes} format="binary">"#)?;
    let mut encoder = EncoderWriter::new(&mut *out, &STANDARD);
    encoder.write_all(&(bytes as u64).to_le_bytes())?;
    let mut block = Vec::with_capacity(8192 + N);
    for value in values {
        block.extend_from_slice(&value);
        if block.len() >= 8192 {
            encoder.write_all(&block)?;
            block.clear();
        }
    }
    encoder.write_all(&block)?;
    encoder.finish()?;
    drop(encoder);
    writeln!(out, "</DataArray>")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A PVD file that lists VTU files over time. It is written anew with every step, so that a run
/// that is broken off can be looked at.
#[derive(Debug, Clone)]
pub struct Series {
    path: PathBuf,
    entries: Vec<(f64, u32, String)>,
}

impl Series {
    /// A series at `path` (`….pvd`); nothing is written yet.
    #[must_use]
    pub(crate) fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), entries: Vec::new() }
    }

    /// Where the VTU file of a step belongs: beside the series, `NAME_0003.vtu`,
    /// `NAME_rods_0003.vtu`.
    #[must_use]
    pub(crate) fn place(&self, part: &str, step: usize) -> PathBuf {
        let stem =
            self.path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let part = if part.is_empty() { String::new() } else { format!("_{part}") };
        self.path.with_file_name(format!("{stem}{part}_{step:04}.vtu"))
    }

    /// Lists a file at a time (s) and writes the series. Parts (solids 0, rods 1, …) are shown
    /// together.
    ///
    /// # Errors
    /// The series cannot be written, or the time is not finite.
    pub(crate) fn add(&mut self, time: f64, part: u32, file: &Path) -> Result<(), WriteError> {
        if !time.is_finite() {
            return Err(WriteError {
                path: self.path.clone(),
                source: invalid(format!("a time of {time} s")),
            });
        }
        let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        self.entries.push((time, part, name));
        put(&self.path, |out| {
            writeln!(out, r#"<?xml version="1.0"?>"#)?;
            writeln!(
                out,
                r#"<VTKFile type="Collection" version="1.0" byte_order="LittleEndian" header_type="UInt64"><Collection>"#
            )?;
            for (time, part, name) in &self.entries {
                writeln!(
                    out,
                    r#"<DataSet timestep="{time:?}" part="{part}" file="{}"/>"#,
                    escape(name)
                )?;
            }
            writeln!(out, "</Collection></VTKFile>")
        })
    }
}

#[cfg(test)]
mod tests {
    use base64::Engine;

    use super::super::super::mesh::{Interface, Shell, block};
    use super::*;

    /// Bytes of the array of that name, without VTK: its header must count them.
    fn bytes(text: &str, name: &str) -> Vec<u8> {
        let at = text.find(&format!(r#"Name="{name}""#)).unwrap();
        let body = &text[at + text[at..].find('>').unwrap() + 1..];
        let body = &body[..body.find('<').unwrap()];
        let all = STANDARD.decode(body).unwrap();
        let (count, rest) = all.split_first_chunk::<8>().unwrap();
        assert_eq!(u64::from_le_bytes(*count) as usize, rest.len());
        rest.to_vec()
    }

    fn doubles(text: &str, name: &str) -> Vec<f64> {
        bytes(text, name).chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    }

    #[test]
    fn arrays_come_back() {
        let mut mesh = block(&[0.0, 1.0, 2.0], &[0.0, 1.0], &[0.0, 1.0], "c").unwrap();
        mesh.shells.push(Shell { nodes: [0, 1, 4, 3], region: 0 });
        mesh.interfaces.push(Interface { nodes: [0, 1, 4, 3, 0, 1, 4, 3], region: 0 });
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtu");
        let displacement: Vec<f64> = (0..36).map(|i| f64::from(i) / 7.0).collect();
        let stress: Vec<f64> = (0..24).map(|i| -f64::from(i) * 1e6).collect();
        let points = [Field { name: "displacement_m", components: 3, values: &displacement }];
        let cells = [Field { name: "stress_pa", components: 6, values: &stress }];
        Grid::solids(&mesh).write(&path, &points, &cells).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(doubles(&text, "displacement_m"), displacement);
        assert_eq!(doubles(&text, "stress_pa"), stress);
        assert_eq!(
            doubles(&text, "Points"),
            mesh.nodes.iter().flat_map(|p| p.to_array()).collect::<Vec<_>>()
        );
        assert_eq!(bytes(&text, "types"), [12, 12, 9, 12]);
        let offsets: Vec<i64> = bytes(&text, "offsets")
            .chunks(8)
            .map(|b| i64::from_le_bytes(b.try_into().unwrap()))
            .collect();
        assert_eq!(offsets, [8, 16, 20, 28]);
        let nodes: Vec<u32> = bytes(&text, "connectivity")
            .chunks(4)
            .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
            .collect();
        assert_eq!(nodes[..8], mesh.hexes[0].nodes);
        assert!(text.contains(r#"ComponentName4="yz""#));
    }

    #[test]
    fn a_file_says_of_which_scene_it_is_and_by_which_version() {
        let mesh = block(&[0.0, 1.0], &[0.0, 1.0], &[0.0, 1.0], "c").unwrap();
        let folder = tempfile::tempdir().unwrap();
        let comment = |hash: &str| {
            let path = folder.path().join("a.vtu");
            Grid::solids(&mesh).of_scene(hash).write(&path, &[], &[]).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            let (_, behind) = text.split_once("<!-- ").unwrap();
            behind.split_once(" -->").unwrap().0.to_owned()
        };
        let by = concat!("intrados ", env!("CARGO_PKG_VERSION"));
        assert_eq!(comment("0a1b"), format!("{by}, scene hash 0a1b"));
        assert_eq!(comment(""), by);
        assert!(!comment("a-->b--").contains("--"));
    }

    #[test]
    fn wrong_fields_are_refused_and_leave_nothing() {
        let mesh = block(&[0.0, 1.0], &[0.0, 1.0], &[0.0, 1.0], "c").unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtu");
        let short = [Field { name: "u_m", components: 3, values: &[0.0; 23] }];
        let error = Grid::solids(&mesh).write(&path, &short, &[]).unwrap_err();
        assert!(error.to_string().contains("23 values for 8 points of 3 components"), "{error}");
        let region = [Field { name: "region", components: 1, values: &[0.0] }];
        assert!(Grid::solids(&mesh).write(&path, &[], &region).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        assert!(Grid::solids(&mesh).write(&path.join("below/a.vtu"), &[], &[]).is_ok());
        assert!(
            Grid::solids(&mesh).write(&path, &[], &[]).is_err(),
            "a folder is in the place of the file"
        );
    }

    #[test]
    fn a_series_lists_its_steps() {
        let folder = tempfile::tempdir().unwrap();
        let mut series = Series::new(folder.path().join("lining.pvd"));
        for step in 0..2 {
            for (part, name) in [(0, ""), (1, "rods")] {
                let place = series.place(name, step);
                Grid::rods(&[DVec3::ZERO, DVec3::X], &[[0, 1]]).write(&place, &[], &[]).unwrap();
                series.add(step as f64 * 0.1, part, &place).unwrap();
            }
        }
        let text = std::fs::read_to_string(folder.path().join("lining.pvd")).unwrap();
        assert_eq!(text.matches("<DataSet").count(), 4);
        assert!(text.contains(r#"timestep="0.1" part="1" file="lining_rods_0001.vtu""#), "{text}");
        assert!(series.add(f64::NAN, 0, Path::new("x")).is_err());
    }
}
