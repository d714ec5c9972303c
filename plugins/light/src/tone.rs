//! From scene radiance to display (fig. 2.2): exposure, a curve, sRGB in 8 bits; and false colour
//! for fields.

use std::sync::LazyLock;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::luminance;

/// What a pixel that is not a number looks like: a magenta that no curve produces from numbers near
/// it.
pub(crate) const NOT_A_NUMBER: [u8; 3] = [255, 0, 255];

/// How display luminance follows scene luminance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// Unchanged, clipped at 1 by channel.
    Identity,
    /// Y(1 + Y/W²)/(1 + Y): eq. 4 of Reinhard et al., "Photographic tone reproduction for digital
    /// images" (SIGGRAPH 2002). Applied to luminance, with the colour scaled alike, so that hue
    /// stays; what leaves the gamut is mixed with grey of its luminance.
    Reinhard {
        /// W, the least luminance that is shown white; above 0.
        white: f32,
    },
}

impl Default for Curve {
    fn default() -> Self {
        Self::Reinhard { white: 4.0 }
    }
}

/// How a picture is developed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tone {
    /// In stops: radiance is multiplied by 2^exposure.
    pub exposure: f32,
    /// After exposure.
    pub curve: Curve,
}

impl Tone {
    /// Linear display value of a radiance, each channel in [0, 1]; NaN stays NaN, what is negative
    /// shows black.
    #[must_use]
    pub fn display(&self, radiance: Vec3) -> Vec3 {
        let exposed = (radiance * self.exposure.exp2()).max(Vec3::ZERO).min(Vec3::splat(1e30));
        let shown = match self.curve {
            Curve::Identity => exposed.min(Vec3::ONE),
            Curve::Reinhard { white } => reinhard(exposed, white.max(1e-3)),
        };
        // `max` and `min` prefer the number to the NaN.
        if radiance.is_nan() { Vec3::NAN } else { shown }
    }

    /// sRGB bytes of a radiance.
    #[must_use]
    pub fn encode(&self, radiance: Vec3) -> [u8; 3] {
        let shown = self.display(radiance);
        if shown.is_nan() { NOT_A_NUMBER } else { shown.to_array().map(srgb) }
    }
}

fn reinhard(colour: Vec3, white: f32) -> Vec3 {
    let y = luminance(colour);
    if y <= 0.0 {
        return Vec3::ZERO;
    }
    let shown = if y < white { y * (1.0 + y / (white * white)) / (1.0 + y) } else { 1.0 };
    let scaled = colour * (shown / y);
    let peak = scaled.max_element();
    if peak <= 1.0 {
        scaled
    } else {
        (Vec3::splat(shown) + (scaled - shown) * ((1.0 - shown) / (peak - shown))).min(Vec3::ONE)
    }
}

/// The transfer function of IEC 61966-2-1, 0 to 1.
fn srgb_curve(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Cells across √x, more than there are steps of the curve anywhere.
const CELLS: usize = 4096;

/// For every cell of √x the byte at its start, and for every byte the least x that rounds to it: a
/// power a channel would cost a whole frame.
static SRGB: LazyLock<(Vec<u8>, [f32; 257])> = LazyLock::new(|| {
    let byte = |x: f64| (255.0 * srgb_curve(x) + 0.5) as u8;
    let starts = (0..=CELLS).map(|i| byte((i as f64 / CELLS as f64).powi(2))).collect();
    let least = std::array::from_fn(|b| {
        let s = (b as f64 - 0.5).max(0.0) / 255.0;
        (if s <= 12.92 * 0.003_130_8 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }) as f32
    });
    (starts, least)
});

/// sRGB byte of a linear value, clipped to [0, 1].
#[inline]
#[must_use]
pub(crate) fn srgb(linear: f32) -> u8 {
    let (starts, least) = &*SRGB;
    let x = linear.clamp(0.0, 1.0);
    let start = starts[((x.sqrt() * CELLS as f32) as usize).min(CELLS)];
    // One cell holds one step at most; rounding of the root may have taken the next cell.
    if x >= least[usize::from(start) + 1] {
        start + u8::from(start < 255)
    } else {
        start - u8::from(x < least[usize::from(start)])
    }
}

/// Sequential colour maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ColourMap {
    /// Smith & van der Walt 2015: perceptually uniform.
    #[default]
    Viridis,
    /// Nuñez, Anderton & Renslow 2018: the same for people with colour-vision deficiency.
    Cividis,
    /// Mikhailov 2019: more hues, to tell near values apart. It is darkest at both ends, so that it
    /// says nothing in print.
    Turbo,
    /// Black to white in even steps of sRGB.
    Grey,
}

impl ColourMap {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Viridis, Self::Cividis, Self::Turbo, Self::Grey];

    /// sRGB bytes at `t`, clamped to [0, 1]; NaN is [`Self::unknown`].
    #[must_use]
    pub fn at(self, t: f32) -> [u8; 3] {
        if t.is_nan() {
            return self.unknown();
        }
        let t = t.clamp(0.0, 1.0);
        let map = match self {
            Self::Viridis => colorous::VIRIDIS,
            Self::Cividis => colorous::CIVIDIS,
            Self::Turbo => colorous::TURBO,
            Self::Grey => return [(255.0 * t).round() as u8; 3],
        };
        map.eval_continuous(f64::from(t)).into_array()
    }

    /// Where there is no number: a grey that the map itself comes near to nowhere, else green.
    #[must_use]
    pub fn unknown(self) -> [u8; 3] {
        match self {
            Self::Viridis | Self::Turbo => [96; 3],
            // Its middle is a dark grey.
            Self::Cividis => [216; 3],
            Self::Grey => [0, 158, 115],
        }
    }
}

/// What lies below a range that is clipped: a blue that is far from every map (ΔE*ab above 55).
pub const BELOW: [u8; 3] = [0, 0, 255];
/// What lies above it: a pink, as far.
pub const ABOVE: [u8; 3] = [255, 0, 170];

/// A field shown in colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FalseColour {
    /// Which colours.
    pub map: ColourMap,
    /// Values at the first and the last colour, in the field's unit.
    pub range: [f32; 2],
    /// Whether equal ratios are equally far apart instead of equal differences; both ends of the
    /// range are above 0 then.
    pub is_logarithmic: bool,
    /// So many colours in all; below 2: as many as the map has.
    pub bands: u8,
    /// Whether what lies beyond the range is [`BELOW`] or [`ABOVE`] it; else it takes the nearest
    /// colour.
    pub is_clipped: bool,
}

impl FalseColour {
    /// sRGB bytes of a value; NaN is [`ColourMap::unknown`].
    #[must_use]
    pub fn encode(&self, value: f32) -> [u8; 3] {
        self.place(value).map_or_else(|colour| colour, |t| self.map.at(t))
    }

    /// Where on the map a value is, from 0 to 1; or the colour that it has instead, where it is no
    /// number or clipped. In an empty range everything is in the middle.
    ///
    /// # Errors
    ///
    /// That colour.
    pub fn place(&self, value: f32) -> Result<f32, [u8; 3]> {
        let [lo, hi] = self.range;
        if value.is_nan() {
            return Err(self.map.unknown());
        }
        if self.is_clipped && (value < lo || value > hi) {
            return Err(if value < lo { BELOW } else { ABOVE });
        }
        let share = match self.is_logarithmic {
            true => (value.max(f32::MIN_POSITIVE) / lo).ln() / (hi / lo).ln().max(1e-3),
            false => (value - lo) / (hi - lo),
        };
        // ∞ − ∞ and the like: a number that does not fit the range is still a number.
        let t = if share.is_nan() || lo == hi { 0.5 } else { share.clamp(0.0, 1.0) };
        Ok(self.band(t))
    }

    /// The colours of the first and the last band are those of the map's ends.
    fn band(&self, t: f32) -> f32 {
        let count = f32::from(self.bands);
        if self.bands < 2 { t } else { (t * count).floor().min(count - 1.0) / (count - 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_is_the_standard_to_the_last_byte() {
        for i in 0..=200_000 {
            let x = i as f32 / 200_000.0;
            let exact = 255.0 * srgb_curve(f64::from(x)) + 0.5;
            assert!(
                srgb(x) == exact as u8 || (exact - exact.round()).abs() < 1e-4,
                "{x}: {} {exact}",
                srgb(x)
            );
        }
        // 18 % grey is byte 118, half is 188.
        assert_eq!(
            [srgb(0.0), srgb(0.18), srgb(0.5), srgb(1.0), srgb(9.0), srgb(-1.0)],
            [0, 118, 188, 255, 255, 0]
        );
    }

    /// Hue angle in the plane across the grey axis.
    fn hue(c: Vec3) -> f32 {
        (3.0_f32.sqrt() * (c.y - c.z)).atan2(2.0 * c.x - c.y - c.z)
    }

    #[test]
    fn the_curve_rises_and_keeps_hue() {
        let tone = Tone::default();
        for colour in [Vec3::new(1.0, 0.5, 0.1), Vec3::new(0.1, 0.2, 0.9), Vec3::new(0.0, 1.0, 0.3)]
        {
            let mut last = 0.0;
            for stop in -40..30 {
                let shown = tone.display(colour * (stop as f32 / 5.0).exp2());
                let y = luminance(shown);
                assert!(
                    shown.min_element() >= 0.0 && shown.max_element() <= 1.0 && y >= last - 1e-6,
                    "{shown}"
                );
                let grey = shown.max_element() - shown.min_element() < 1e-3;
                assert!(grey || (hue(shown) - hue(colour)).abs() < 1e-3, "{colour} became {shown}");
                last = y;
            }
            assert!(last > 0.99);
        }
    }

    #[test]
    fn exposure_counts_stops_and_identity_is_identity() {
        let tone = Tone { exposure: 1.0, curve: Curve::Identity };
        assert_eq!(tone.display(Vec3::new(0.1, 0.25, 3.0)), Vec3::new(0.2, 0.5, 1.0));
        let default = Tone { exposure: 2.0, ..Tone::default() };
        assert_eq!(default.display(Vec3::splat(0.2)), Tone::default().display(Vec3::splat(0.8)));
    }

    #[test]
    fn what_is_no_number_is_seen() {
        for curve in [Curve::Identity, Curve::default()] {
            let tone = Tone { exposure: 0.0, curve };
            assert_eq!(tone.encode(Vec3::new(0.5, f32::NAN, 0.5)), NOT_A_NUMBER);
            assert_eq!(tone.encode(Vec3::splat(f32::INFINITY)), [255; 3]);
            assert_eq!(tone.encode(Vec3::splat(-1.0)), [0; 3]);
        }
        let shown = FalseColour { range: [-1.0, 3.0], ..of(ColourMap::Cividis) };
        assert_eq!(shown.encode(f32::NAN), [216; 3]);
        assert_eq!(
            [shown.encode(-9.0), shown.encode(f32::INFINITY)],
            [[0, 32, 81], [253, 233, 69]]
        );
        assert_eq!(shown.encode(1.0), ColourMap::Cividis.at(0.5));
        assert_eq!(
            FalseColour { range: [2.0, 2.0], ..shown }.encode(7.0),
            ColourMap::Cividis.at(0.5)
        );
    }

    /// A map over 0 to 1.
    fn of(map: ColourMap) -> FalseColour {
        FalseColour { map, range: [0.0, 1.0], is_logarithmic: false, bands: 0, is_clipped: false }
    }

    #[test]
    fn bands_are_so_many_colours_from_end_to_end() {
        for map in ColourMap::ALL {
            for bands in [5_u8, 10] {
                let shown = FalseColour { bands, ..of(map) };
                let mut seen: Vec<[u8; 3]> =
                    (0..=1000).map(|i| shown.encode(i as f32 / 1000.0)).collect();
                assert_eq!((seen[0], seen[1000]), (map.at(0.0), map.at(1.0)), "{map:?}");
                // Each in one piece, and none of them again.
                seen.dedup();
                assert_eq!(seen.len(), usize::from(bands), "{map:?}");
                seen.sort_unstable();
                seen.dedup();
                assert_eq!(seen.len(), usize::from(bands), "{map:?}");
            }
        }
    }

    #[test]
    fn what_is_clipped_is_no_colour_of_a_map() {
        for map in ColourMap::ALL {
            let shown = FalseColour { range: [2.0, 4.0], is_clipped: true, ..of(map) };
            assert_eq!([1.9, 4.1].map(|v| shown.encode(v)), [BELOW, ABOVE]);
            assert_eq!([2.0, 4.0].map(|v| shown.encode(v)), [map.at(0.0), map.at(1.0)]);
            let nearest = FalseColour { is_clipped: false, ..shown };
            assert_eq!([1.9, 4.1].map(|v| nearest.encode(v)), [map.at(0.0), map.at(1.0)]);
            let others = [BELOW, ABOVE, map.unknown()];
            for colour in (0..=255).map(|i| map.at(i as f32 / 255.0)) {
                for other in others {
                    let far: i32 =
                        (0..3).map(|k| (i32::from(colour[k]) - i32::from(other[k])).abs()).sum();
                    assert!(far > 40, "{map:?}: {colour:?} and {other:?}");
                }
            }
        }
    }

    #[test]
    fn a_logarithmic_scale_has_the_geometric_mean_in_the_middle() {
        let shown =
            FalseColour { range: [1e-3, 10.0], is_logarithmic: true, ..of(ColourMap::Grey) };
        let middle = shown.place(0.1).unwrap();
        assert!((middle - 0.5).abs() < 1e-5, "{middle}");
        assert_eq!([0.0, 1e-3, 10.0].map(|v| shown.place(v).unwrap()), [0.0, 0.0, 1.0]);
    }

    /// What makes the maps honest: lightness only rises. Turbo's does not, and no view begins with it.
    #[test]
    fn maps_rise_in_lightness() {
        for map in [ColourMap::Viridis, ColourMap::Cividis, ColourMap::Grey] {
            let y = |t: f32| {
                let [r, g, b] = map.at(t).map(|c| (f32::from(c) / 255.0).powf(2.2));
                luminance(Vec3::new(r, g, b))
            };
            assert!((0..64).all(|i| y((i + 1) as f32 / 64.0) > y(i as f32 / 64.0)), "{map:?}");
        }
    }
}
