//! What the twenty cases are.

use glam::DVec2;
use intrados_xray::specimen::concrete::Outline;
use serde::Deserialize;

use super::ExperimentError;

/// The frozen table.
pub(crate) const TABLE: &str = include_str!("cases.ron");
/// Schema of the table.
const SCHEMA: &str = "intrados.cases/1";

/// All cases and what they share.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseSet {
    /// `intrados.cases/1`.
    pub schema: String,
    /// Every case's photons are multiplied by this: the one number by which the plain reference was
    /// brought to 83 ± 3.
    pub dose: f64,
    /// Views of a full turn.
    pub views: usize,
    /// Voxels that the panel sees across.
    pub across: usize,
    /// In their order.
    pub cases: Vec<ExperimentCase>,
}

/// What is scanned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all(serialize = "lowercase"))]
pub enum Kind {
    /// Stands.
    #[serde(alias = "column")]
    Column,
    /// Lies.
    #[serde(alias = "beam")]
    Beam,
}

/// Across the axis, mm.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub enum Section {
    /// Of this diameter.
    Round(f64),
    /// Width, height.
    Rectangle(f64, f64),
}

/// Rock of the grains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Grains {
    /// Gravel.
    Quartz,
    /// Crushed.
    Limestone,
    /// Crushed.
    Granite,
}

/// Bars along the axis, mm.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub enum Bars {
    /// So many of a diameter on a circle, under a cover.
    Ring(usize, f64, f64),
    /// One in every corner: diameter, cover.
    Corners(f64, f64),
    /// So many of a diameter in a row at the bottom, under a cover.
    Bottom(usize, f64, f64),
    /// The same at the top.
    Top(usize, f64, f64),
}

/// Pores.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pores {
    /// Share of the volume.
    pub porosity: f64,
    /// Scale of the diameters (Weibull), mm.
    pub scale_mm: f64,
    /// Their shape: the larger, the more alike.
    pub shape: f64,
    /// Smallest and largest diameter, mm.
    pub range_mm: (f64, f64),
}

/// Cracks.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cracks {
    /// How many.
    pub count: usize,
    /// Narrowest and widest opening, mm.
    pub width_mm: (f64, f64),
    /// Shortest and longest, mm.
    pub length_mm: (f64, f64),
}

/// One member, its damage, its scan.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentCase {
    /// What it is called.
    pub id: String,
    /// What it is.
    pub kind: Kind,
    /// Its cross-section.
    pub section: Section,
    /// Its aggregate.
    pub grains: Grains,
    /// Its reinforcement.
    pub bars: Vec<Bars>,
    /// Its pores.
    pub pores: Option<Pores>,
    /// Its cracks.
    pub cracks: Option<Cracks>,
    /// Voltage of the tube.
    pub kv: f64,
    /// Copper before it, mm.
    pub copper_mm: f64,
    /// Height of the beam at the axis, mm: the higher, the more scatter.
    pub beam_mm: f64,
    /// Thousands of photons that the open beam brings to a pixel in a view, before [`CaseSet::dose`].
    pub photons: f64,
    /// Of all that is by chance.
    pub seed: u64,
}

/// A bar: its middle and its radius, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rod {
    /// Across the axis.
    pub at: DVec2,
    /// Nominal.
    pub radius: f64,
}

impl CaseSet {
    /// The twenty cases.
    ///
    /// # Errors
    /// The program's own table is damaged.
    pub fn twenty() -> Result<Self, ExperimentError> {
        let cases: Self =
            ron::from_str(TABLE).map_err(|e| ExperimentError::Table(e.to_string()))?;
        if cases.schema != SCHEMA {
            return Err(ExperimentError::Table(format!(
                "schema {} instead of {SCHEMA}",
                cases.schema
            )));
        }
        Ok(cases)
    }

    /// The same members with other pores, cracks, grains and noise: to try things on.
    #[must_use]
    pub fn rehearsal(mut self, number: u64) -> Self {
        for case in &mut self.cases {
            case.seed += 1000 * (1 + number);
            case.id = format!("{}-rehearsal-{number}", case.id);
        }
        self
    }
}

impl ExperimentCase {
    /// Across the axis, m.
    #[must_use]
    pub(crate) fn outline(&self) -> Outline {
        match self.section {
            Section::Round(diameter) => Outline::Round(0.5e-3 * diameter),
            Section::Rectangle(width, height) => {
                Outline::Rectangle([0.5e-3 * width, 0.5e-3 * height])
            }
        }
    }

    /// All bars.
    #[must_use]
    pub(crate) fn rods(&self) -> Vec<Rod> {
        let half = self.outline().half();
        self.bars
            .iter()
            .flat_map(|bars| match *bars {
                Bars::Ring(count, diameter, cover) => {
                    let radius = half.x - 1e-3 * cover - 0.5e-3 * diameter;
                    let at = |i: usize| {
                        radius
                            * DVec2::from_angle(
                                std::f64::consts::TAU * (i as f64 + 0.3) / count as f64,
                            )
                    };
                    (0..count)
                        .map(|i| Rod { at: at(i), radius: 0.5e-3 * diameter })
                        .collect::<Vec<_>>()
                }
                Bars::Corners(diameter, cover) => {
                    let corner = half - 1e-3 * cover - 0.5e-3 * diameter;
                    let sign = |i: usize| DVec2::new([-1.0, 1.0][i & 1], [-1.0, 1.0][i >> 1]);
                    (0..4)
                        .map(|i| Rod { at: corner * sign(i), radius: 0.5e-3 * diameter })
                        .collect()
                }
                Bars::Bottom(count, diameter, cover) => row(count, diameter, cover, half, -1.0),
                Bars::Top(count, diameter, cover) => row(count, diameter, cover, half, 1.0),
            })
            .collect()
    }
}

fn row(count: usize, diameter: f64, cover: f64, half: DVec2, side: f64) -> Vec<Rod> {
    let reach = half - 1e-3 * cover - 0.5e-3 * diameter;
    let x = |i: usize| {
        if count > 1 { reach.x * (2.0 * i as f64 / (count - 1) as f64 - 1.0) } else { 0.0 }
    };
    (0..count)
        .map(|i| Rod { at: DVec2::new(x(i), side * reach.y), radius: 0.5e-3 * diameter })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fowler, Noll and Vo's hash, 64 bits.
    fn fnv(bytes: &[u8]) -> u64 {
        bytes
            .iter()
            .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
    }

    /// Frozen before there was a line of ours: whoever changes the table changes the experiment.
    #[test]
    fn the_table_is_frozen() {
        assert_eq!(fnv(TABLE.as_bytes()), 0x38a04bd888528db9, "{:#x}", fnv(TABLE.as_bytes()));
    }

    #[test]
    fn there_are_ten_columns_and_ten_beams() {
        let cases = CaseSet::twenty().unwrap().cases;
        let count = |of: &dyn Fn(&ExperimentCase) -> bool| cases.iter().filter(|c| of(c)).count();
        assert_eq!(
            [count(&|c| c.kind == Kind::Column), count(&|c| c.kind == Kind::Beam)],
            [10, 10]
        );
        // Some without pores, some without cracks, none without both.
        assert!(count(&|c| c.pores.is_none()) >= 2 && count(&|c| c.cracks.is_none()) >= 4);
        assert!(cases.iter().all(|c| c.pores.is_some() || c.cracks.is_some()));
        for case in &cases {
            assert!(
                case.outline().half().max_element() <= 0.1
                    && (case.kv == 225.0 || case.kv == 450.0),
                "{}",
                case.id
            );
            assert!(
                case.rods().iter().all(|r| case.outline().within(r.at.extend(0.0)) > r.radius),
                "{}",
                case.id
            );
        }
        let mut seeds: Vec<u64> = cases.iter().map(|c| c.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 20);
        let again = CaseSet::twenty().unwrap().rehearsal(0);
        assert!(
            again
                .cases
                .iter()
                .zip(&cases)
                .all(|(a, b)| a.seed == b.seed + 1000 && a.section == b.section && a.id != b.id)
        );
    }
}
