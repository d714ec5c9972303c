//! A line that somebody draws over the picture of light, and what its pixels show.

use bevy_ecs::prelude::*;
use egui::{Painter, Rect, Ui, UiBuilder, Vec2, vec2};
use intrados_light::{Render, luminance};
use intrados_transport::Side;

use crate::{
    Action, Look, Quantity,
    fields::{self, Fields},
    lang::{fixed, term},
    line::{self, Along},
    number::significant,
    picture,
};

/// Share of the tab's height that the plot has below the picture, and its bounds, points.
const HEIGHT: (f32, f32, f32) = (0.35, 100.0, 190.0);

/// The tool, and where it was drawn last: shares of the picture's width and height. It stays there
/// when the picture is another one.
#[derive(Resource, Debug, Default)]
pub(crate) struct LightLine {
    is_on: bool,
    ends: Option<[Vec2; 2]>,
}

/// What the pixels on the line show.
#[derive(Debug, Default, PartialEq)]
struct Readings {
    /// What that is, in the window's language, its unit, and what it is called in a table.
    name: String,
    unit: &'static str,
    column: &'static str,
    /// Of the line, pixels.
    length: f32,
    pixels: Vec<[usize; 2]>,
    /// Distance from the first end in pixels, value, standard error; infinite or no number: none is
    /// known.
    values: Vec<[f64; 3]>,
}

impl LightLine {
    pub(crate) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Puts the tool away with what it has drawn; false if it was not out.
    pub(crate) fn end(&mut self) -> bool {
        std::mem::take(self).is_on
    }

    pub(crate) fn button(&mut self, ui: &mut Ui) {
        let hint = tr!(
            "Drag over the picture: its values between two places with their standard errors, as a \
             plot. Esc or a second click ends it"
        );
        if ui.selectable_label(self.is_on, tr!("Line")).on_hover_text(hint).clicked() {
            *self = Self { is_on: !self.is_on, ends: None };
        }
    }

    /// Follows the pointer from where it was pressed.
    pub(crate) fn drag(&mut self, ui: &Ui, place: Rect) {
        self.ends = line::dragged(ui, place).or(self.ends);
    }

    /// What the plot takes of a tab of this height, even before there is one: under somebody who
    /// draws, the picture must not move.
    pub(crate) fn height(&self, tab: f32) -> f32 {
        let (share, least, most) = HEIGHT;
        if self.is_on { (share * tab).clamp(least, most) } else { 0.0 }
    }

    pub(crate) fn draw(&self, painter: &Painter, place: Rect) {
        if let Some(ends) = self.ends {
            line::draw(painter, ends.map(|share| place.min + share * place.size()));
        }
    }

    /// The plot of what is on the line, and the table that is to be saved.
    pub(crate) fn show(
        &self,
        ui: &mut Ui,
        rect: Rect,
        render: &Render,
        share: f64,
        look: &Look,
        fields: &Fields,
    ) -> Option<Action> {
        let shown = ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
            let Some(ends) = self.ends else {
                ui.weak(tr!("Drag over the picture from one place to another."));
                return None;
            };
            told(ui, &Readings::of(ends, render, share, look, fields))
        });
        shown.inner
    }
}

impl Readings {
    /// Of light and its error the luminance, of a field what it says.
    fn of(ends: [Vec2; 2], render: &Render, share: f64, look: &Look, fields: &Fields) -> Self {
        let size = [render.camera().width as usize, render.camera().height as usize];
        let parts = picture::parts(render, look.view, share);
        let radiance = |[x, y]: [usize; 2]| {
            let (mean, variance) = picture::blend(&parts, look.order, y * size[0] + x)?;
            // The channels' errors are taken as fully correlated, as everywhere.
            Some([luminance(mean), luminance(variance.map(f32::sqrt))])
        };
        let value = |side: Side, pixel: [usize; 2]| {
            let [x, y] = [0, 1].map(|k: usize| (pixel[k] as f32 + 0.5) / size[k] as f32);
            Some([fields.value(side, vec2(x, y))?, f32::NAN])
        };
        match look.quantity {
            Quantity::Field(side) => {
                let column = match side {
                    Side::Primal => "radiance_field_w_per_m2",
                    Side::Dual => "importance_field_per_m2",
                };
                let (name, unit) = (term(fields::name(side)), fields::meaning(side)[1]);
                Self { name, unit, column, ..Self::read(size, ends, |pixel| value(side, pixel)) }
            }
            Quantity::Radiance | Quantity::Error => Self {
                name: tr!("Radiance Y"),
                unit: "W/(m² sr)",
                column: "radiance_w_per_m2_sr",
                ..Self::read(size, ends, radiance)
            },
        }
    }

    /// Value and standard error of every pixel on the line of which there is one.
    fn read(
        size: [usize; 2],
        ends: [Vec2; 2],
        of: impl Fn([usize; 2]) -> Option<[f32; 2]>,
    ) -> Self {
        let way = (ends[1] - ends[0]) * vec2(size[0] as f32, size[1] as f32);
        let mut read = Self { length: way.length(), ..Self::default() };
        for (distance, pixel) in pixels(size, ends) {
            let Some([value, error]) = of(pixel).filter(|of| of[0].is_finite()) else { continue };
            read.pixels.push(pixel);
            read.values.push([f64::from(distance), f64::from(value), f64::from(error)]);
        }
        read
    }

    /// As a table, with units in its header and numbers as code has them; pixels are counted from
    /// the upper left one, 0.
    fn csv(&self) -> String {
        let row = |([x, y], [distance, value, error]): (&[usize; 2], &[f64; 3])| {
            let error = if error.is_finite() { (*error as f32).to_string() } else { String::new() };
            format!("{distance:.2},{x},{y},{},{error}\n", *value as f32)
        };
        let rows: String = self.pixels.iter().zip(&self.values).map(row).collect();
        format!("along_px,x_px,y_px,{},std_error\n{rows}", self.column)
    }
}

/// The pixels of a picture of this size that a line passes, one of each column or of each row,
/// whichever it passes more of, with their distances from its first end, in pixels.
fn pixels(size: [usize; 2], ends: [Vec2; 2]) -> impl Iterator<Item = (f32, [usize; 2])> {
    let whole = vec2(size[0] as f32, size[1] as f32);
    let [from, to] = ends.map(|share| share * whole);
    let way = to - from;
    let along = usize::from(way.y.abs() > way.x.abs());
    let [first, last] = ends.map(|share| fields::pixel(size, share)[along]);
    (0..=first.abs_diff(last)).map(move |k| {
        let index = if first <= last { first + k } else { first - k };
        let share = (index as f32 + 0.5 - from[along]) / way[along];
        // At the ends the middle of the pixel may lie beyond the line; a point has no way.
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        let mut pixel = fields::pixel(size, (from + share * way) / whole);
        pixel[along] = index;
        (share * way.length(), pixel)
    })
}

/// Title and plot, and the table that is to be saved.
fn told(ui: &mut Ui, found: &Readings) -> Option<Action> {
    let asked = ui.horizontal(|ui| {
        let title = tr!("{} along the line, {}", found.name, found.unit);
        ui.strong(title).on_hover_text(tr!(
            "Of every pixel that it passes, from the end with the dot, ± one standard error where \
             that is known"
        ));
        ui.weak(tr!("{} px long", fixed(found.length, 0)));
        line::taken(ui, "line", || found.csv())
    });
    let along = Along {
        name: found.name.clone(),
        axis: "px",
        values: &found.values,
        told: |p| tr!("{} at {} px", significant(p.y, 3), fixed(p.x, 0)),
    };
    let height = ui.available_height().max(60.0);
    line::show(ui, &along, height);
    asked.inner
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the middle of pixel (1, 4) of 10 × 8 to that of pixel (8, 6).
    const ENDS: [Vec2; 2] = [vec2(0.15, 0.5625), vec2(0.85, 0.8125)];

    fn passed(ends: [Vec2; 2]) -> Vec<[usize; 2]> {
        pixels([10, 8], ends).map(|(_, pixel)| pixel).collect()
    }

    #[test]
    fn a_line_takes_one_pixel_of_every_column_or_of_every_row() {
        let rows: [usize; 8] = [4, 4, 5, 5, 5, 5, 6, 6];
        let there = passed(ENDS);
        assert_eq!(there, (1..9).zip(rows).map(|(x, y)| [x, y]).collect::<Vec<_>>());
        let mut back = passed([ENDS[1], ENDS[0]]);
        back.reverse();
        assert_eq!(back, there);
        let upright = passed([vec2(0.35, 0.0), vec2(0.45, 1.0)]);
        assert_eq!(
            upright.iter().map(|pixel| pixel[1]).collect::<Vec<_>>(),
            [0, 1, 2, 3, 4, 5, 6, 7]
        );
        // Dragged not at all, and in the corner.
        assert_eq!(passed([vec2(1.0, 1.0); 2]), [[9, 7]]);
    }

    #[test]
    fn distances_rise_from_0_to_the_length() {
        let found: Vec<f32> = pixels([10, 8], ENDS).map(|(distance, _)| distance).collect();
        let length = 7.0_f32.hypot(2.0);
        assert!(found[0].abs() < 1e-4 && (found[7] - length).abs() < 1e-4, "{found:?}");
        assert!(found.windows(2).all(|w| (w[1] - w[0] - length / 7.0).abs() < 1e-4), "{found:?}");
        // Not beyond the ends, whose pixels it leaves before their middles.
        let short: Vec<f32> = pixels([10, 8], [vec2(0.19, 0.5), vec2(0.41, 0.5)])
            .map(|(distance, _)| distance)
            .collect();
        assert!(short.len() == 4 && short[0] == 0.0 && (short[3] - 2.2).abs() < 1e-4, "{short:?}");
    }

    #[test]
    fn pixels_without_a_value_are_left_out_and_errors_that_are_unknown_are_empty() {
        let of = |[x, _]: [usize; 2]| match x {
            2 => None,
            3 => Some([f32::NAN, 0.0]),
            4 => Some([0.5, f32::INFINITY]),
            _ => Some([x as f32, 0.25]),
        };
        let ends = [vec2(0.05, 0.0625), vec2(0.45, 0.0625)];
        let read = Readings { column: "value", ..Readings::read([10, 8], ends, of) };
        assert!((read.length - 4.0).abs() < 1e-5, "{}", read.length);
        assert_eq!(read.pixels, [[0, 0], [1, 0], [4, 0]]);
        assert_eq!(
            read.csv(),
            "along_px,x_px,y_px,value,std_error\n0.00,0,0,0,0.25\n1.00,1,0,1,0.25\n4.00,4,0,0.5,\n"
        );
    }
}
