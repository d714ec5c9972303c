//! What of an equilibrium is shown, its unit, its colours.

use glam::DVec3;
use intrados_light::tone::FalseColour;
use intrados_mechanics::{
    skin::{Skin, Snapshot},
    tensor::{Principal, cylindrical, rotate_stress, von_mises},
};
use rayon::prelude::*;

use crate::{colours, lang::term};

/// What is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Quantity {
    /// Largest principal stress.
    #[default]
    First,
    /// Smallest principal stress.
    Third,
    /// Von Mises.
    Mises,
    /// A component: xx, yy, zz, xy, yz, zx; round an axis rr, θθ, zz, rθ, θz, zr.
    Component(u8),
    /// Damage.
    Damage,
    /// Opening of the widest crack.
    Crack,
    /// Length of the displacement.
    Displacement,
}

const PLAIN: [&str; 6] = ["σ xx", "σ yy", "σ zz", "τ xy", "τ yz", "τ zx"];
const ROUND: [&str; 6] = ["σ r", "σ θ (hoop)", "σ z (axial)", "τ rθ", "τ θz", "τ zr"];

impl Quantity {
    /// All that can be chosen.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let stresses =
            [Self::First, Self::Third, Self::Mises].into_iter().chain((0..6).map(Self::Component));
        stresses.chain([Self::Damage, Self::Crack, Self::Displacement])
    }

    pub(crate) fn name(self, skin: &Skin) -> String {
        match self {
            Self::First => tr!("Largest principal stress"),
            Self::Third => tr!("Smallest principal stress"),
            Self::Mises => tr!("Von Mises stress"),
            Self::Component(k) => {
                term((if skin.axis.is_some() { ROUND } else { PLAIN })[usize::from(k) % 6])
            }
            Self::Damage => tr!("Damage"),
            Self::Crack => tr!("Crack width"),
            Self::Displacement => tr!("Displacement"),
        }
    }

    /// What the file of its picture is called; English, as all files are.
    pub(crate) fn file(self, skin: &Skin) -> String {
        const PLAIN: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "zx"];
        const ROUND: [&str; 6] = ["r", "theta", "z", "r-theta", "theta-z", "z-r"];
        match self {
            Self::First => "largest-principal-stress".into(),
            Self::Third => "smallest-principal-stress".into(),
            Self::Mises => "von-mises-stress".into(),
            Self::Component(k) => {
                let names = if skin.axis.is_some() { ROUND } else { PLAIN };
                format!("stress-{}", names[usize::from(k) % 6])
            }
            Self::Damage => "analysed-damage".into(),
            Self::Crack => "crack-width".into(),
            Self::Displacement => "displacement".into(),
        }
    }

    /// Its unit, a [`term`], and what an SI value is multiplied by.
    pub(crate) fn unit(self) -> (&'static str, f32) {
        match self {
            Self::Damage => ("0 sound … 1 broken", 1.0),
            Self::Crack | Self::Displacement => ("mm", 1e3),
            _ => ("MPa", 1e-6),
        }
    }

    /// Values of all vertices, in its unit.
    pub(crate) fn values(self, skin: &Skin, shot: &Snapshot) -> Vec<f32> {
        let factor = self.unit().1;
        (0..skin.rest.len().min(shot.displacement.len()))
            .into_par_iter()
            .map(|v| factor * self.at(skin, shot, v))
            .collect()
    }

    /// The value of one vertex, in its unit.
    pub(crate) fn one(self, skin: &Skin, shot: &Snapshot, v: usize) -> f32 {
        self.unit().1 * self.at(skin, shot, v)
    }

    fn at(self, skin: &Skin, shot: &Snapshot, v: usize) -> f32 {
        let stress = || shot.stress[v].map(f64::from);
        let value = match self {
            Self::Damage => return shot.damage[v],
            Self::Crack => return shot.crack[v],
            Self::Displacement => return shot.displacement[v].length(),
            Self::First => Principal::of_stress(&stress()).values[0],
            Self::Third => Principal::of_stress(&stress()).values[2],
            Self::Mises => von_mises(&stress()),
            Self::Component(k) => turned(skin, v, &stress())[usize::from(k) % 6],
        };
        value as f32
    }

    /// The values of its first and last colour: between the extremes but for a two-hundredth at
    /// each end, where corners and loads pierce; with 0 in the middle where there are both signs.
    pub(crate) fn range(self, values: impl Iterator<Item = f32>) -> [f32; 2] {
        let mut sorted: Vec<f32> = values.filter(|v| v.is_finite()).collect();
        if sorted.is_empty() {
            return [0.0, 1.0];
        }
        let last = sorted.len() - 1;
        let [low, high] = [0.005, 0.995].map(|share| {
            *sorted.select_nth_unstable_by((last as f32 * share) as usize, f32::total_cmp).1
        });
        let least = match self {
            Self::Damage => return [0.0, 1.0],
            Self::Crack => 0.05,
            _ => 1e-3,
        };
        match () {
            () if self.has_sign() && low < 0.0 && high > 0.0 => {
                let far = high.max(-low).max(least);
                [-far, far]
            }
            () if self.has_sign() && high <= 0.0 => [low.min(-least), 0.0],
            () => [0.0, high.max(least)],
        }
    }

    fn has_sign(self) -> bool {
        matches!(self, Self::First | Self::Third | Self::Component(_))
    }

    /// By what name its range is locked.
    pub(crate) fn key(self) -> String {
        format!("stress {self:?}")
    }

    /// The colour of a value: of signed ones blue is compression and red tension, damage has its own
    /// scale everywhere, and others have the window's colours.
    pub(crate) fn colour(self, scale: &FalseColour, value: f32) -> [u8; 3] {
        let [low, high] = scale.range;
        match scale.place(value) {
            Err(other) => other,
            Ok(t) if self.has_sign() => {
                signed((low + t * (high - low)) / high.max(-low).max(f32::MIN_POSITIVE))
            }
            Ok(t) if self == Self::Damage => colours::damage(t, false),
            Ok(t) => scale.map.at(t),
        }
    }
}

/// RdBu of ColorBrewer, five colours: compression −1 is blue, tension 1 is red.
fn signed(t: f32) -> [u8; 3] {
    const STOPS: [[f32; 3]; 5] = [
        [33.0, 92.0, 162.0],
        [120.0, 176.0, 214.0],
        [240.0, 240.0, 238.0],
        [238.0, 144.0, 112.0],
        [168.0, 22.0, 40.0],
    ];
    let p = 4.0 * (0.5 + 0.5 * t.clamp(-1.0, 1.0));
    let i = (p as usize).min(3);
    std::array::from_fn(|k| (STOPS[i][k] + (STOPS[i + 1][k] - STOPS[i][k]) * (p - i as f32)) as u8)
}

/// In the axes that components are named after.
fn turned(skin: &Skin, v: usize, stress: &[f64; 6]) -> [f64; 6] {
    skin.axis.map_or(*stress, |[origin, axis]: [DVec3; 2]| {
        let at = skin.rest[v].as_dvec3();
        rotate_stress(stress, &cylindrical(at.to_array(), origin.to_array(), axis.to_array()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Colours;
    use intrados_light::tone::ColourMap;

    #[test]
    fn ranges_keep_zero_and_forget_the_sharpest_corner() {
        let many = |from: f32, to: f32| {
            (0..1000).map(move |i| from + (to - from) * i as f32 / 999.0).chain([1e9])
        };
        let [low, high] = Quantity::First.range(many(-1.0, 3.0));
        assert!(low == -high && (2.9..3.0).contains(&high));
        let [low, high] = Quantity::Third.range(many(-5.0, -1.0).filter(|v| *v < 0.0));
        assert!((-5.0..-4.9).contains(&low) && high == 0.0);
        assert_eq!(Quantity::Damage.range(many(0.0, 0.1)), [0.0, 1.0]);
        assert_eq!(Quantity::Crack.range(std::iter::empty()), [0.0, 1.0]);
        // What has no sign begins at nothing, and nothing everywhere has a range too.
        assert_eq!(Quantity::Mises.range(std::iter::repeat_n(0.0, 9)), [0.0, 1e-3]);
    }

    fn over(range: [f32; 2], map: ColourMap) -> FalseColour {
        Colours { map, bands: 0 }.over(range, false)
    }

    #[test]
    fn compression_is_blue_and_tension_red() {
        let scale = over([-2.0, 2.0], ColourMap::Grey);
        let [c, t] = [-2.0, 2.0].map(|v| Quantity::First.colour(&scale, v));
        assert!(c[2] > c[0] && t[0] > t[2]);
        assert_eq!(Quantity::First.colour(&scale, 0.0), [240, 240, 238]);
        // In a range that reaches farther one way, too: pale is nothing.
        let uneven = over([-2.0, 6.0], ColourMap::Grey);
        assert_eq!(Quantity::First.colour(&uneven, 0.0), [240, 240, 238]);
        assert_eq!(Quantity::First.colour(&uneven, 6.0), t);
    }

    #[test]
    fn only_what_has_no_sign_and_is_no_damage_has_the_colours_of_the_window() {
        for map in ColourMap::ALL {
            let scale = over([0.0, 1.0], map);
            assert_eq!(Quantity::Mises.colour(&scale, 1.0), map.at(1.0));
            assert_eq!(Quantity::Damage.colour(&scale, 1.0), colours::damage(1.0, false));
        }
    }

    #[test]
    fn bands_of_what_has_a_sign_are_so_many_colours() {
        let scale = FalseColour { bands: 5, ..over([-3.0, 3.0], ColourMap::Viridis) };
        let mut seen: Vec<[u8; 3]> =
            (-300..=300).map(|i| Quantity::First.colour(&scale, i as f32 / 100.0)).collect();
        seen.dedup();
        assert_eq!(seen.len(), 5);
        assert_eq!(seen[2], [240, 240, 238]);
    }
}
