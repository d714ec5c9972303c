//! A line or a region that somebody draws over the slice, and what the slice has there.

use egui::{Grid, Painter, Rect, RichText, Shape, StrokeKind, Ui, Vec2};
use intrados_ct::probe::{Region, Shape as Form, along};

use super::source::Read;
use crate::{
    Action,
    lang::{fixed, term},
    line::{self, Along},
    number::{copied, percent, plus_minus, significant},
};

/// What the left button draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tool {
    Line,
    Region(Form),
}

/// What is drawn: two ends, or two corners, mm from the slice's upper left corner.
pub(super) type Drawn = (Tool, [Vec2; 2]);

/// The tool, and where it was drawn last. It stays there when another slice is shown.
#[derive(Debug, Default)]
pub(super) struct Probe {
    tool: Option<Tool>,
    ends: Option<[Vec2; 2]>,
}

/// What the slice has where something is drawn.
pub(super) enum Found {
    /// Distances in mm, and values there.
    Line(Vec<[f64; 2]>),
    Region(Option<Region>),
}

impl Found {
    fn of(read: &Read, (tool, ends): Drawn) -> Self {
        let ends = ends.map(|at| [at.x, at.y].map(f64::from));
        match tool {
            Tool::Line => Self::Line(along(&read.slice, ends)),
            Tool::Region(form) => Self::Region(Region::of(&read.slice, &read.found, form, ends)),
        }
    }
}

impl Probe {
    pub(super) fn is_on(&self) -> bool {
        self.tool.is_some()
    }

    pub(super) fn drawn(&self) -> Option<Drawn> {
        self.tool.zip(self.ends)
    }

    /// The tools, of which one is on at most.
    pub(super) fn tools(&mut self, ui: &mut Ui) {
        let region = || {
            tr!("Drag over the slice from corner to corner: size, mean and shares of what lies \
                 between them. Esc or a second click ends it")
        };
        for (tool, name, what) in [
            (
                Tool::Line,
                tr!("Line"),
                tr!("Drag over the slice: its values between two places, as a plot. Esc or a \
                     second click ends it"),
            ),
            (Tool::Region(Form::Rectangle), tr!("Rectangle"), region()),
            (Tool::Region(Form::Ellipse), tr!("Ellipse"), region()),
        ] {
            let is_on = self.tool == Some(tool);
            if ui.selectable_label(is_on, name).on_hover_text(what).clicked() {
                *self = Self { tool: (!is_on).then_some(tool), ends: None };
            }
        }
    }

    /// Follows the pointer from where it was pressed. The slice is drawn at `place` and has edges
    /// of `size`, mm.
    pub(super) fn drag(&mut self, ui: &Ui, place: Rect, size: Vec2) {
        let ends = line::dragged(ui, place);
        self.ends = ends.map(|ends| ends.map(|share| share * size)).or(self.ends);
    }

    /// Measures what is drawn otherwise than it was measured last. A large region takes longer than
    /// a frame: it waits until it is let go.
    pub(super) fn refresh(
        &self,
        read: &Read,
        is_drawing: bool,
        known: &mut Option<(Drawn, Found)>,
    ) {
        let drawn = self.drawn();
        let waits = is_drawing && matches!(drawn, Some((Tool::Region(_), _)));
        if !waits && known.as_ref().map(|known| known.0) != drawn {
            *known = drawn.map(|drawn| (drawn, Found::of(read, drawn)));
        }
    }

    /// Draws it over a slice that begins at `place` and has so many points a mm.
    pub(super) fn draw(&self, painter: &Painter, place: Rect, points_per_mm: f32) {
        let Some((tool, ends)) = self.drawn() else { return };
        let ends = ends.map(|mm| place.min + points_per_mm * mm);
        let between = Rect::from_two_pos(ends[0], ends[1]);
        match tool {
            Tool::Line => line::draw(painter, ends),
            Tool::Region(Form::Rectangle) => line::outline(painter, |stroke| {
                Shape::rect_stroke(between, 0.0, stroke, StrokeKind::Middle)
            }),
            Tool::Region(Form::Ellipse) => line::outline(painter, |stroke| {
                Shape::ellipse_stroke(between.center(), 0.5 * between.size(), stroke)
            }),
        }
    }
}

/// What is told of it beside the slice, and what of it is to be saved.
pub(super) fn results(
    ui: &mut Ui,
    (tool, ends): Drawn,
    found: Option<&Found>,
    unit: &str,
    height: f32,
) -> Option<Action> {
    title(ui, tool, ends[1] - ends[0], unit);
    let found = found?;
    match found {
        Found::Line(values) => plotted(ui, values, unit, height),
        Found::Region(Some(region)) => numbers(ui, region, unit),
        Found::Region(None) => {
            ui.weak(tr!("No pixel's centre lies in it."));
            return None;
        }
    }
    let name = if tool == Tool::Line { "line" } else { "region" };
    ui.horizontal(|ui| line::taken(ui, name, || csv(found, (tool, ends), unit))).inner
}

fn title(ui: &mut Ui, tool: Tool, size: Vec2, unit: &str) {
    ui.horizontal_wrapped(|ui| match tool {
        Tool::Line => {
            let name = match unit {
                "grey" => tr!("Grey along the line"),
                _ => tr!("Attenuation along the line, 1/m"),
            };
            ui.strong(name).on_hover_text(tr!(
                "Between the centres of pixels, at steps of half a pixel at most, from the end \
                 with the dot"
            ));
            ui.weak(tr!("{} mm long", fixed(size.length(), 2)));
        }
        Tool::Region(_) => {
            ui.strong(tr!("Region")).on_hover_text(tr!(
                "Pixels whose centres lie in it, and shares of these; what is neither pore, crack \
                 nor concrete is metal, or beyond the body"
            ));
            let [wide, high] = [size.x, size.y].map(|mm| fixed(mm.abs(), 2));
            ui.weak(tr!("{} × {} mm", wide, high));
        }
    });
}

fn plotted(ui: &mut Ui, values: &[[f64; 2]], unit: &str, height: f32) {
    // Of a slice no error is known.
    let values: Vec<[f64; 3]> = values.iter().map(|[s, value]| [*s, *value, f64::NAN]).collect();
    let along = Along {
        name: term(unit),
        axis: "mm",
        values: &values,
        told: |p| tr!("{} at {} mm", significant(p.y, 3), fixed(p.x, 2)),
    };
    line::show(ui, &along, height);
}

fn numbers(ui: &mut Ui, region: &Region, unit: &str) {
    let unit = if unit == "grey" { "" } else { unit };
    let grey = |value: f64| format!("{} {unit}", significant(value, 4));
    let rows = [
        (tr!("pixels"), region.pixels.to_string()),
        (tr!("area"), format!("{} mm²", significant(region.area_mm2, 4))),
        (tr!("mean ± standard deviation"), plus_minus(region.mean, region.deviation, unit)),
        (tr!("least"), grey(region.least)),
        (tr!("largest"), grey(region.largest)),
        (tr!("pores"), percent(region.pores)),
        (tr!("cracks"), percent(region.cracks)),
        (tr!("concrete"), percent(region.concrete)),
    ];
    Grid::new("region").num_columns(2).spacing([12.0, 1.0]).show(ui, |ui| {
        for (name, value) in rows {
            ui.weak(name);
            copied(ui, RichText::new(value.trim()));
            ui.end_row();
        }
    });
}

/// As a table, with units in its header and numbers as code has them.
fn csv(found: &Found, (tool, [from, to]): Drawn, unit: &str) -> String {
    let grey = if unit == "grey" { "grey" } else { "attenuation_per_m" };
    match found {
        Found::Line(values) => {
            let way = (to - from).normalized();
            let row = |[s, value]: &[f64; 2]| {
                let at = from + *s as f32 * way;
                format!("{s:.4},{:.4},{:.4},{}\n", at.x, at.y, *value as f32)
            };
            let rows: String = values.iter().map(row).collect();
            format!("along_mm,x_mm,y_mm,{grey}\n{rows}")
        }
        Found::Region(None) => String::new(),
        Found::Region(Some(region)) => {
            let form = match tool {
                Tool::Region(Form::Ellipse) => "ellipse",
                _ => "rectangle",
            };
            let (at, size) = (from.min(to), (to - from).abs());
            let greys = [region.mean, region.deviation, region.least, region.largest];
            let [mean, deviation, least, largest] = greys.map(|v| v as f32);
            format!(
                "shape,x_mm,y_mm,width_mm,height_mm,pixels,area_mm2,mean_{grey},std_{grey},\
                 least_{grey},largest_{grey},pores,cracks,concrete\n\
                 {form},{:.4},{:.4},{:.4},{:.4},{},{},{mean},{deviation},\
                 {least},{largest},{},{},{}\n",
                at.x,
                at.y,
                size.x,
                size.y,
                region.pixels,
                region.area_mm2 as f32,
                region.pores as f32,
                region.cracks as f32,
                region.concrete as f32,
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use egui::vec2;

    use super::*;

    #[test]
    fn tables_have_their_units_in_the_header() {
        let ends = [vec2(1.0, 2.0), vec2(4.0, 6.0)];
        let values = Found::Line(vec![[0.0, 10.0], [2.5, 12.5], [5.0, 11.0]]);
        assert_eq!(
            csv(&values, (Tool::Line, ends), "1/m"),
            "along_mm,x_mm,y_mm,attenuation_per_m\n0.0000,1.0000,2.0000,10\n\
             2.5000,2.5000,4.0000,12.5\n5.0000,4.0000,6.0000,11\n"
        );
        let region = Region {
            pixels: 12,
            area_mm2: 3.0,
            mean: 0.5,
            deviation: 0.25,
            least: 0.0,
            largest: 1.0,
            pores: 0.25,
            cracks: 0.0,
            concrete: 0.75,
        };
        let drawn = (Tool::Region(Form::Ellipse), [ends[1], ends[0]]);
        let text = csv(&Found::Region(Some(region)), drawn, "grey");
        let (head, row) = text.split_once('\n').unwrap();
        assert_eq!(row, "ellipse,1.0000,2.0000,3.0000,4.0000,12,3,0.5,0.25,0,1,0.25,0,0.75\n");
        assert!(head.contains(",mean_grey,std_grey,") && !head.contains(' '), "{head}");
        assert_eq!(head.matches(',').count(), row.matches(',').count());
    }
}
