//! What the physical groups of a Gmsh mesh are made of, what holds them and what acts on them: a
//! file of its own (RON), since a mesh has places for none of it.
//!
//! ```text
//! (
//!     schema: "intrados.groups/1",
//!     materials: [(group: "core", modulus_gpa: 33, poisson: 0.2, density_kg_m3: 2500, expansion_1e6_k: 10)],
//!     supports: [
//!         (group: "foot", x: true, y: true, z: true),
//!         (group: "side", x: true, moved_mm: (0.5, 0, 0)),
//!     ],
//!     loads: [
//!         (action: Weight(gravity_m_s2: (0, 0, -9.81))),
//!         (group: "top", action: Pressure(pressure_kpa: 100)),
//!         (group: "top", action: Traction(traction_kpa: (20, 0, 0))),
//!         (group: "rim", action: Force(force_kn: (0, 0, -10))),
//!         (group: "core", action: Temperature(uniform_k: 15)),
//!     ],
//! )
//! ```
//!
//! Units are in the names of the fields, whatever those of the mesh. All loads act together in one
//! linear step; those on one place add up, but for temperatures, of which the later counts. Without
//! a `group`, a material, a weight or a temperature is that of all solids.

use std::{
    ops::RangeInclusive,
    path::{Path, PathBuf},
};

use serde::Deserialize;

use crate::read::{Fault, ReadError};

/// The schema that this version reads.
const SCHEMA: &str = "intrados.groups/1";
/// Where all fields are shown.
const PAGE: &str = "`intrados analyze --help`";
/// What a component of a load may be, in its unit.
const LOADS: RangeInclusive<f64> = -1e9..=1e9;

/// What a file says of the groups of a mesh.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Groups {
    schema: String,
    pub(super) materials: Vec<Material>,
    #[serde(default)]
    pub(super) supports: Vec<Support>,
    #[serde(default)]
    pub(super) loads: Vec<Load>,
    /// The file, for messages.
    #[serde(skip)]
    pub(super) path: PathBuf,
}

/// Of what a volume is made.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Material {
    /// A physical volume; none: all solids.
    #[serde(default)]
    pub(super) group: Option<String>,
    /// Young's modulus, GPa.
    pub(super) modulus_gpa: f64,
    /// Poisson's ratio.
    pub(super) poisson: f64,
    /// kg/m³; weight asks for it.
    #[serde(default)]
    pub(super) density_kg_m3: Option<f64>,
    /// Thermal expansion, 1e-6/K; temperatures ask for it.
    #[serde(default)]
    pub(super) expansion_1e6_k: Option<f64>,
}

/// What holds the nodes of a group.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Support {
    /// A physical group of any dimension.
    pub(super) group: String,
    /// Whether they are held along x.
    #[serde(default)]
    pub(super) x: bool,
    /// Along y.
    #[serde(default)]
    pub(super) y: bool,
    /// Along z.
    #[serde(default)]
    pub(super) z: bool,
    /// Where they are held, from where they are in the mesh, mm.
    #[serde(default)]
    pub(super) moved_mm: [f64; 3],
}

impl Support {
    /// Which axes are held.
    pub(super) fn axes(&self) -> [bool; 3] {
        [self.x, self.y, self.z]
    }
}

/// What acts on a group.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Load {
    /// A physical group; none: all solids.
    #[serde(default)]
    pub(super) group: Option<String>,
    /// What it is.
    pub(super) action: Action,
}

/// A load by what it is.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) enum Action {
    /// On a surface, into the solid behind it, kPa.
    Pressure { pressure_kpa: f64 },
    /// On a surface, along the axes, kPa.
    Traction { traction_kpa: [f64; 3] },
    /// On all of a surface (by area), a line (by length) or points (alike), kN.
    Force { force_kn: [f64; 3] },
    /// Acceleration of solids, m/s².
    Weight { gravity_m_s2: [f64; 3] },
    /// Of the nodes of a group, warmer than when built, K.
    Temperature { uniform_k: f64 },
}

impl Action {
    /// Name and components of its value.
    fn value(&self) -> (&'static str, Vec<f64>) {
        match *self {
            Self::Pressure { pressure_kpa } => ("pressure_kpa", vec![pressure_kpa]),
            Self::Traction { traction_kpa } => ("traction_kpa", traction_kpa.to_vec()),
            Self::Force { force_kn } => ("force_kn", force_kn.to_vec()),
            Self::Weight { gravity_m_s2 } => ("gravity_m_s2", gravity_m_s2.to_vec()),
            Self::Temperature { uniform_k } => ("uniform_k", vec![uniform_k]),
        }
    }

    /// Whether it can be that of all solids.
    fn acts_on_all(&self) -> bool {
        matches!(self, Self::Weight { .. } | Self::Temperature { .. })
    }
}

impl Groups {
    /// Reads a file from memory; `name` is what errors call it.
    ///
    /// # Errors
    /// The first thing in it that is no RON of this schema, in one line.
    pub fn parse(bytes: &[u8], name: &Path) -> Result<Self, ReadError> {
        let text = std::str::from_utf8(bytes)
            .map_err(|_| Fault::whole("this is no UTF-8 text").of(name))?;
        let file = name.display().to_string();
        let read =
            intrados_scene::parse_ron(&file, text, SCHEMA, |g: &Self| g.schema.as_str(), PAGE);
        // A problem's place is the file with line and column.
        let mut groups =
            read.map_err(|problem| Fault::whole(problem.message).of(Path::new(&problem.place)))?;
        groups.path = name.to_owned();
        Ok(groups)
    }

    /// Values that cannot be.
    pub(super) fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let is_moved = |s: &Support| s.moved_mm != [0.0; 3];
        if self.loads.is_empty() && !self.supports.iter().any(is_moved) {
            faults.push(Fault::whole("nothing acts: add loads, or moved_mm to a support"));
        }
        for (i, material) in self.materials.iter().enumerate() {
            material.check(&format!("materials[{i}]"), &mut faults);
        }
        for (i, support) in self.supports.iter().enumerate() {
            support.check(&format!("supports[{i}]"), &mut faults);
        }
        for (i, load) in self.loads.iter().enumerate() {
            let (name, values) = load.action.value();
            for value in values {
                within(&mut faults, &format!("loads[{i}].{name}"), value, LOADS, "");
            }
            if load.group.is_none() && !load.action.acts_on_all() {
                let why = "needs a group: what a surface, line or point is called";
                faults.push(Fault::whole(format!("loads[{i}] {why}")));
            }
        }
        faults
    }
}

impl Material {
    fn check(&self, place: &str, faults: &mut Vec<Fault>) {
        let mut check = |name: &str, value, range, hint: &str| {
            within(faults, &format!("{place}.{name}"), value, range, hint);
        };
        check("modulus_gpa", self.modulus_gpa, 1e-9..=2000.0, " GPa (33 for 33e9 Pa)");
        check("poisson", self.poisson, -0.999..=0.499, "");
        if let Some(density) = self.density_kg_m3 {
            check("density_kg_m3", density, 1e-3..=30_000.0, " kg/m³");
        }
        if let Some(expansion) = self.expansion_1e6_k {
            check("expansion_1e6_k", expansion, -1000.0..=1000.0, " 1e-6/K (10 for 1e-5/K)");
        }
    }
}

impl Support {
    fn check(&self, place: &str, faults: &mut Vec<Fault>) {
        if self.axes() == [false; 3] {
            let why = "holds nothing: add x: true, y: true or z: true";
            faults.push(Fault::whole(format!("{place} {why}")));
        }
        for ((axis, is_held), moved) in ["x", "y", "z"].iter().zip(self.axes()).zip(self.moved_mm) {
            within(faults, &format!("{place}.moved_mm"), moved, LOADS, " mm");
            if moved != 0.0 && !is_held {
                let why = format!("moves along {axis}, where it does not hold: add {axis}: true");
                faults.push(Fault::whole(format!("{place} {why}")));
            }
        }
    }
}

/// Adds a fault where a value is not within its range, or no number.
fn within(
    faults: &mut Vec<Fault>,
    place: &str,
    value: f64,
    range: RangeInclusive<f64>,
    hint: &str,
) {
    if !range.contains(&value) {
        let (low, high) = (range.start(), range.end());
        let why = format!("{place} is {value:?}: give {low:?} to {high:?}{hint}");
        faults.push(Fault::whole(why));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Groups, String> {
        Groups::parse(text.as_bytes(), Path::new("a.ron")).map_err(|e| e.to_string())
    }

    fn refusal(text: &str) -> String {
        Fault::all(read(text).unwrap().faults()).unwrap_err().reason
    }

    const GOOD: &str = r#"(
    schema: "intrados.groups/1",
    materials: [(group: "core", modulus_gpa: 33, poisson: 0.2)],
    supports: [(group: "foot", z: true)],
    loads: [(action: Temperature(uniform_k: 15)), (group: "top", action: Traction(traction_kpa: (0, 0, 1.5)))],
)"#;

    #[test]
    fn what_is_left_out_is_none() {
        let groups = read(GOOD).unwrap();
        assert_eq!(groups.materials[0].density_kg_m3, None);
        assert_eq!(groups.supports[0].axes(), [false, false, true]);
        assert_eq!(groups.loads[0].group, None);
        assert_eq!(groups.loads[1].action, Action::Traction { traction_kpa: [0.0, 0.0, 1.5] });
    }

    #[test]
    fn what_is_no_file_of_groups_is_named_with_its_line() {
        for (from, to, expected) in [
            ("groups/1", "groups/2", "a.ron:2:"),
            ("poisson: 0.2", "poison: 0.2", "a.ron:3:"),
            ("poisson: 0.2", "poison: 0.2", "did you mean `poisson`?"),
            ("(group: \"foot\", z: true)", "(z: true)", "add `group: …`"),
            ("loads:", "loading:", "a.ron:5:"),
        ] {
            assert!(GOOD.contains(from), "{from}");
            let error = read(&GOOD.replace(from, to)).unwrap_err();
            assert!(error.contains(expected) && error.lines().count() == 1, "{to}: {error}");
        }
    }

    #[test]
    fn all_values_that_cannot_be_are_named_at_once() {
        let bad = GOOD
            .replace("modulus_gpa: 33", "modulus_gpa: 33e9")
            .replace("poisson: 0.2", "poisson: 0.5, density_kg_m3: inf")
            .replace("z: true", "moved_mm: (0, 1, 0)")
            .replace("uniform_k: 15", "uniform_k: NaN")
            .replace("group: \"top\", ", "");
        let error = refusal(&bad);
        for part in [
            "materials[0].modulus_gpa is 33000000000.0: give",
            "materials[0].poisson is 0.5",
            "materials[0].density_kg_m3 is inf",
            "supports[0] holds nothing",
            "supports[0] moves along y",
            "loads[0].uniform_k is NaN",
            "loads[1] needs a group",
        ] {
            assert!(error.contains(part), "{part}: {error}");
        }
        assert_eq!(error.lines().count(), 1, "{error}");
        let idle = GOOD.replace("loads: [", "loads: [], // [");
        assert!(refusal(&idle).contains("nothing acts"));
    }
}
