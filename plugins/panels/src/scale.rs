//! How numbers become colours: one map and one number of bands for the whole window, and the ranges
//! that the user has locked.

use std::collections::BTreeMap;

use bevy_ecs::prelude::*;
use egui::{Painter, Rect, Shape, Stroke, Ui, pos2, vec2};
use intrados_light::tone::{ABOVE, BELOW, ColourMap, FalseColour};
use serde::{Deserialize, Serialize};

use crate::{colours::ink, lang::drag, number::significant};

/// Numbers of bands to choose from; 0: none.
const BANDS: [u8; 3] = [0, 5, 10];
/// Colours of a legend without bands.
const STEPS: u8 = 64;
/// How far the triangles at the ends of a legend reach, points.
const TIP: f32 = 9.0;
/// Bounds of what can be locked: of a logarithmic scale, of others.
const LEAST: [f32; 2] = [1e-30, -1e12];
const MOST: f32 = 1e12;

/// Ranges that the user has locked, by quantity, in the unit in which it is shown.
#[derive(Resource, Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ranges(BTreeMap<String, [f32; 2]>);

impl Ranges {
    pub(crate) fn of(&self, quantity: &str) -> Option<[f32; 2]> {
        self.0.get(quantity).copied()
    }

    /// Locks a range, or lets go of it. One that a file could not keep is none.
    fn put(&mut self, quantity: &str, range: Option<[f32; 2]>) {
        match range.filter(|[low, high]| low <= high && low.is_finite() && high.is_finite()) {
            Some(range) => self.0.insert(quantity.to_owned(), range),
            None => self.0.remove(quantity),
        };
    }
}

/// Colours of numbers in the whole window, wherever they have no sign and are no damage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Colours {
    /// Which map.
    pub map: ColourMap,
    /// So many bands of it; below 2: as many as it has colours.
    pub bands: u8,
}

impl Colours {
    /// The scale of values over this range.
    pub(crate) fn over(self, range: [f32; 2], is_logarithmic: bool) -> FalseColour {
        let Self { map, bands } = self;
        FalseColour { map, range, is_logarithmic, bands, is_clipped: false }
    }

    /// The same, unless the user has locked the range of this quantity.
    pub(crate) fn locked_or_over(
        self,
        range: [f32; 2],
        is_logarithmic: bool,
        quantity: &str,
        ranges: &Ranges,
    ) -> FalseColour {
        let locked = ranges.of(quantity);
        let scale = self.over(locked.unwrap_or(range), is_logarithmic);
        FalseColour { is_clipped: locked.is_some(), ..scale }
    }

    /// What they are called, beside a picture.
    pub(crate) fn said(self) -> String {
        let map = name(self.map);
        if self.bands < 2 { map } else { format!("{map}, {}", banded(self.bands)) }
    }
}

/// What can be chosen, by name: maps, and bands of the map that is chosen `now`.
pub(crate) fn choices(now: Colours) -> [Vec<(String, Colours)>; 2] {
    let maps = ColourMap::ALL.map(|map| (name(map), Colours { map, ..now }));
    let bands = BANDS.map(|bands| (banded(bands), Colours { bands, ..now }));
    [maps.into(), bands.into()]
}

/// What a map is called.
fn name(map: ColourMap) -> String {
    match map {
        ColourMap::Viridis => "Viridis".into(),
        ColourMap::Cividis => "Cividis".into(),
        ColourMap::Turbo => "Turbo".into(),
        ColourMap::Grey => tr!("Grey|colours"),
    }
}

/// What so many bands are called.
fn banded(count: u8) -> String {
    if count < 2 { tr!("Continuous|colours") } else { tr!("{} bands", count) }
}

/// Locks the range of a quantity as it is `seen` now, or lets go of it; its ends, while it is
/// locked.
pub(crate) fn lock(
    ui: &mut Ui,
    ranges: &mut Ranges,
    quantity: &str,
    seen: [f32; 2],
    unit: &str,
    is_logarithmic: bool,
) {
    let mut range = ranges.of(quantity);
    let mut is_locked = range.is_some();
    let hint = tr!(
        "Keeps the range of colours of this quantity; what lies beyond is blue below and pink above"
    );
    ui.checkbox(&mut is_locked, tr!("Lock the range")).on_hover_text(hint);
    range = is_locked.then(|| range.unwrap_or(seen));
    if let Some([low, high]) = &mut range {
        let least = LEAST[usize::from(!is_logarithmic)];
        end(ui, tr!("from|range"), low, least..=*high, unit, is_logarithmic);
        end(ui, tr!("to|range"), high, *low..=MOST, unit, is_logarithmic);
    }
    ranges.put(quantity, range);
}

/// One end of a range.
fn end(
    ui: &mut Ui,
    name: String,
    value: &mut f32,
    within: std::ops::RangeInclusive<f32>,
    unit: &str,
    is_logarithmic: bool,
) {
    let label = ui.label(name);
    let least = if is_logarithmic { 0.0 } else { 1e-3 };
    let speed = 0.01 * value.abs().max(least);
    let field = drag(value).range(within).speed(speed).suffix(format!(" {unit}"));
    ui.add(field.custom_formatter(|x, _| significant(x, 3))).labelled_by(label.id);
}

/// How many colours a legend shows.
pub(crate) fn steps(scale: &FalseColour) -> u8 {
    if scale.bands < 2 { STEPS } else { scale.bands }
}

/// The value at a share of the range.
pub(crate) fn at(scale: &FalseColour, share: f32) -> f32 {
    let [low, high] = scale.range;
    if scale.is_logarithmic { low * (high / low).powf(share) } else { low + (high - low) * share }
}

/// Beside the ends of the legend of a range that is clipped, triangles in the colours of what lies
/// beyond.
pub(crate) fn ends(painter: &Painter, scale: &FalseColour, bar: Rect, is_upright: bool) {
    if !scale.is_clipped {
        return;
    }
    for (way, colour) in [(-1.0, BELOW), (1.0, ABOVE)] {
        let out = if is_upright { vec2(0.0, -way) } else { vec2(way, 0.0) };
        let across = 0.5 * vec2(out.y, out.x).abs() * bar.size();
        let foot = bar.center() + 0.5 * out * bar.size() + out;
        let corners = vec![foot - across, foot + across, foot + (TIP - 1.0) * out];
        painter.add(Shape::convex_polygon(corners, ink(colour), Stroke::NONE));
    }
}

/// Legend of a logarithmic scale: its range, round numbers between, what it shows, and the colour of
/// what is unknown.
pub(crate) fn legend(
    ui: &Ui,
    rect: Rect,
    scale: &FalseColour,
    number: impl Fn(f32) -> String,
    caption: &str,
) {
    let painter = ui.painter();
    let bar = Rect::from_min_size(rect.min, vec2(rect.width(), 10.0));
    let bar = if scale.is_clipped { bar.shrink2(vec2(TIP, 0.0)) } else { bar };
    let count = steps(scale);
    for k in 0..count {
        let share = |k: f32| k / f32::from(count);
        let x = |k: u8| bar.left() + bar.width() * share(f32::from(k));
        let colour = scale.encode(at(scale, share(f32::from(k) + 0.5)));
        let step = Rect::from_min_max(pos2(x(k), bar.top()), pos2(x(k + 1) + 0.5, bar.bottom()));
        painter.rect_filled(step, 0.0, ink(colour));
    }
    ends(painter, scale, bar, false);
    let font = egui::TextStyle::Small.resolve(ui.style());
    let colour = ui.visuals().text_color();
    for (share, align, value) in marks(scale.range) {
        let at = pos2(bar.left() + bar.width() * share, bar.bottom() + 2.0);
        painter.text(at, align, number(value), font.clone(), colour);
    }
    let middle = pos2(bar.center().x, bar.bottom() + 16.0);
    let said = painter.text(middle, egui::Align2::CENTER_TOP, caption, font.clone(), colour);
    let sample = Rect::from_min_size(said.right_top() + vec2(12.0, 3.0), vec2(9.0, 9.0));
    painter.rect_filled(sample, 0.0, ink(scale.map.unknown()));
    let beside = sample.right_center() + vec2(4.0, 0.0);
    painter.text(beside, egui::Align2::LEFT_CENTER, tr!("unknown"), font, colour);
}

/// The ends of a logarithmic range and round numbers between, with their places on it.
pub(crate) fn marks([low, high]: [f32; 2]) -> Vec<(f32, egui::Align2, f32)> {
    let mut marks = vec![(0.0, egui::Align2::LEFT_TOP, low), (1.0, egui::Align2::RIGHT_TOP, high)];
    let decades = (high / low).log10();
    let steps: &[f32] = if decades < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    for power in low.log10().floor() as i32..=high.log10().floor() as i32 {
        for value in steps.iter().map(|step| step * 10_f32.powi(power)) {
            let share = (value / low).log10() / decades;
            // Not on top of the ends.
            if (0.12..=0.88).contains(&share) {
                marks.push((share, egui::Align2::CENTER_TOP, value));
            }
        }
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_locked_range_clips_its_quantity_and_no_other() {
        let (colours, mut ranges) = (Colours::default(), Ranges::default());
        let of = |quantity: &str, ranges: &Ranges| {
            colours.locked_or_over([0.0, 8.0], false, quantity, ranges)
        };
        ranges.put("Mises", Some([1.0, 2.0]));
        let (locked, free) = (of("Mises", &ranges), of("Crack", &ranges));
        assert_eq!((locked.range, free.range), ([1.0, 2.0], [0.0, 8.0]));
        assert_eq!((locked.encode(3.0), free.encode(9.0)), (ABOVE, colours.map.at(1.0)));
        ranges.put("Mises", None);
        assert_eq!(of("Mises", &ranges), free);
    }

    #[test]
    fn a_range_that_no_file_keeps_is_not_locked() {
        let mut ranges = Ranges::default();
        for range in [[f32::NAN, 1.0], [0.0, f32::INFINITY], [2.0, 1.0]] {
            ranges.put("Mises", Some(range));
            assert_eq!(ranges, Ranges::default(), "{range:?}");
        }
    }

    #[test]
    fn legends_end_at_the_ends_of_their_range_and_have_round_numbers_between() {
        let scale = Colours::default().over([0.01, 100.0], true);
        assert!((at(&scale, 0.5) - 1.0).abs() < 1e-5);
        let values: Vec<f32> = marks(scale.range).into_iter().map(|m| m.2).collect();
        let expected = [0.01, 100.0, 0.1, 1.0, 10.0];
        assert_eq!(values.len(), expected.len(), "{values:?}");
        assert!(values.iter().zip(expected).all(|(v, e)| (v / e - 1.0).abs() < 1e-5), "{values:?}");
    }
}
