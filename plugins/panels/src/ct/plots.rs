//! Beside the slice: its histogram, the porosity along the axis, the table of its pores.

use egui::{Color32, ScrollArea, Sense, Ui, vec2};
use egui_plot::{Line, MarkerShape, PlotPoints, Points, VLine};
use intrados_ct::detect::Pore;
use intrados_stage::Estimate;

use super::source::Read;
use crate::{
    chart::{key, named, place, plot},
    colours,
    lang::{fixed, term},
    number::{percent, significant},
};

/// Grey of the body's pixels, with the window over it.
pub(super) fn histogram(ui: &mut Ui, read: &Read, window: [f32; 2], height: f32) {
    let hint = tr!("Share of the body's pixels by grey (root scale); \
         the lines are what is shown black and white");
    let said = ui.horizontal(|ui| {
        let said = ui.strong(tr!("Histogram")).on_hover_text(hint);
        ui.weak(tr!("of the body's grey"));
        said
    });
    let [low, high] = read.range.map(f64::from);
    let width = (high - low) / read.histogram.len().max(1) as f64;
    let steps: PlotPoints<'_> = read
        .histogram
        .iter()
        .enumerate()
        .flat_map(|(k, share)| [k, k + 1].map(|k| [low + width * k as f64, share.sqrt()]))
        .collect();
    let chart = plot("grey")
        .height(height)
        .include_y(0.0)
        .y_axis_formatter(|mark, _| percent(mark.value * mark.value))
        .label_formatter(|hover| {
            let p = place(hover);
            Some(tr!("grey {}", significant(p.x, 3)))
        });
    let shown = chart.show(ui, |chart| {
        chart.line(Line::new(tr!("share"), steps).color(colours::PRIMAL).width(1.5).fill(0.0));
        for (name, at) in [tr!("black"), tr!("white")].into_iter().zip(window) {
            chart.vline(VLine::new(name, f64::from(at)).color(colours::SELECTED).width(1.5));
        }
    });
    named(shown.response, &said.inner);
}

/// Porosity of the slices that have been read, ± one standard error. A click asks for the slice
/// there.
pub(super) fn profile(
    ui: &mut Ui,
    along: &[Option<Estimate>],
    truth: Option<f64>,
    now: usize,
    height: f32,
) -> Option<usize> {
    let hint = tr!("Of the slices that have been read, ± standard error of reading; \
         a click goes to the slice");
    let said = ui.horizontal(|ui| {
        let said = ui.strong(tr!("Porosity along the axis")).on_hover_text(hint);
        if truth.is_some() {
            key(ui, &tr!("planted here"), colours::COMBINED, false);
        }
        said
    });
    let known =
        || along.iter().enumerate().filter_map(|(k, r)| Some((k as f64 + 1.0, r.as_ref()?)));
    let chart = plot("porosity")
        .height(height)
        .x_axis_label(tr!("slice"))
        .include_x(0.5)
        .include_x(along.len() as f64 + 0.5)
        .include_y(0.0)
        .y_axis_formatter(|mark, _| format!("{} %", significant(100.0 * mark.value, 2)))
        .label_formatter(|hover| {
            let p = place(hover);
            Some(tr!("slice {}: {}", p.x.round(), percent(p.y)))
        });
    let shown = chart.show(ui, |chart| {
        chart.vline(VLine::new(tr!("shown"), now as f64 + 1.0).color(colours::SELECTED).width(1.0));
        let dots: Vec<[f64; 2]> = known().map(|(x, r)| [x, r.value]).collect();
        chart.line(
            Line::new(tr!("porosity"), PlotPoints::new(dots.clone()))
                .color(colours::PRIMAL.gamma_multiply(0.5))
                .width(1.0),
        );
        for (x, r) in known() {
            let bar: PlotPoints<'_> =
                [-1.0, 1.0].map(|s| [x, r.value + s * r.std_error]).into_iter().collect();
            chart.line(Line::new(tr!("error"), bar).color(colours::PRIMAL).width(2.0));
        }
        chart.points(
            Points::new(tr!("porosity"), PlotPoints::new(dots))
                .color(colours::PRIMAL)
                .shape(MarkerShape::Circle)
                .radius(3.0),
        );
        if let Some(truth) = truth {
            let cross = vec![[now as f64 + 1.0, truth]];
            chart.points(
                Points::new(tr!("planted"), cross)
                    .color(colours::COMBINED)
                    .shape(MarkerShape::Cross)
                    .radius(5.0),
            );
        }
        chart.pointer_coordinate()
    });
    let at = shown.inner.filter(|_| shown.response.clicked());
    named(shown.response, &said.inner);
    let at = at?;
    (!along.is_empty()).then(|| (at.x.round().max(1.0) as usize).min(along.len()) - 1)
}

/// Columns of the table: name and what it is, both a [`term`], and value.
type Column = (&'static str, &'static str, fn(&Pore) -> f64);
const COLUMNS: [Column; 6] = [
    ("size mm", "Diameter of the circle of the same area", |p| p.diameter_mm),
    ("x mm", "Centroid from the left edge", |p| p.x_mm),
    ("y mm", "Centroid from the top edge", |p| p.y_mm),
    ("round", "Circularity: 4π area / perimeter², 1 is a disc", |p| p.circularity),
    ("deep mm", "Depth below the body's surface", |p| p.depth_mm),
    ("bar mm", "Distance to the nearest bar that the slice shows", |p| {
        p.bar_mm.unwrap_or(f64::NAN)
    }),
];

/// Which column sorts, and whether the largest comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Order {
    column: usize,
    falling: bool,
}

impl Default for Order {
    fn default() -> Self {
        Self { column: 0, falling: true }
    }
}

/// The pores' places in `pores`, in this order; what has no value comes last.
fn sorted(pores: &[Pore], order: Order) -> Vec<usize> {
    let value = COLUMNS[order.column].2;
    let mut list: Vec<usize> = (0..pores.len()).collect();
    list.sort_by(|&a, &b| {
        let (a, b) = (value(&pores[a]), value(&pores[b]));
        a.is_nan().cmp(&b.is_nan()).then(if order.falling {
            b.total_cmp(&a)
        } else {
            a.total_cmp(&b)
        })
    });
    list
}

/// Least room between two columns, and room after the last one, points.
const GAPS: [f32; 2] = [5.0, 6.0];

/// The heads of columns: what they are called, and an arrow at the one that sorts.
fn heads(columns: usize, order: Order) -> Vec<String> {
    let arrow = |k: usize| match (order.column == k, order.falling) {
        (false, _) => "",
        (true, true) => " ⏷",
        (true, false) => " ⏶",
    };
    let names = COLUMNS.iter().take(columns).enumerate();
    names.map(|(k, (name, ..))| term(name) + arrow(k)).collect()
}

/// Where columns end that are so wide, in a table of this width: what is left over goes between
/// them. Where there is too little, the last ones stick out: texts never run into each other.
fn ends(widths: &[f32], table: f32) -> Vec<f32> {
    let spare = table - GAPS[1] - widths.iter().sum::<f32>();
    let gap = (spare / widths.len().saturating_sub(1).max(1) as f32).max(GAPS[0]);
    let mut next = 0.0_f32;
    let end = |width: &f32| {
        let end = next + width;
        next = end + gap;
        end
    };
    widths.iter().map(end).collect()
}

/// The same for columns with these heads.
fn ends_of(ui: &Ui, heads: &[String], table: f32) -> Vec<f32> {
    let font = egui::TextStyle::Small.resolve(ui.style());
    let wide = |text: &str| {
        let text = ui.painter().layout_no_wrap(text.to_owned(), font.clone(), Color32::PLACEHOLDER);
        text.size().x
    };
    // Most values are no longer than this.
    let least = wide("0.000");
    let widths: Vec<f32> = heads.iter().map(|head| wide(head).max(least)).collect();
    ends(&widths, table)
}

/// The pores; `picked` is marked, and followed where `follow` says. A click gives the label of the
/// row.
pub(super) fn table(
    ui: &mut Ui,
    pores: &[Pore],
    order: &mut Order,
    picked: Option<u32>,
    follow: bool,
) -> Option<u32> {
    ui.horizontal(|ui| {
        ui.strong(tr!("Pores"));
        ui.weak(tr!("{}; a click shows where", pores.len()));
    });
    let row = ui.text_style_height(&egui::TextStyle::Small) + 5.0;
    let width = ui.available_width() - 10.0;
    // The last column may be empty throughout.
    let columns = if pores.iter().any(|p| p.bar_mm.is_some()) { 6 } else { 5 };
    let heads = heads(columns, *order);
    let ends = ends_of(ui, &heads, width);
    let font = egui::TextStyle::Small.resolve(ui.style());
    let write = |ui: &Ui, rect: egui::Rect, column: usize, text: String, colour: Color32| {
        let at = egui::pos2(rect.left() + ends[column], rect.center().y);
        ui.painter().text(at, egui::Align2::RIGHT_CENTER, text, font.clone(), colour);
    };
    let (head, _) = ui.allocate_exact_size(vec2(width, row), Sense::hover());
    let mut left = head.left();
    for (k, ((name, what, _), text)) in COLUMNS.iter().zip(heads).enumerate() {
        let name = term(name);
        let rect = head.with_min_x(left).with_max_x(head.left() + ends[k]);
        left = rect.right();
        let response = ui
            .interact(rect, ui.scope_id().with(("order", k)), Sense::click())
            .on_hover_text(term(what));
        response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Button, true, tr!("sort by {}", name))
        });
        if response.clicked() {
            *order = Order { column: k, falling: order.column != k || !order.falling };
        }
        write(ui, head, k, text, ui.visuals().strong_text_color());
    }
    let list = sorted(pores, *order);
    let mut area = ScrollArea::vertical().auto_shrink(false).id_salt("pores");
    if let Some(at) = picked
        .filter(|_| follow)
        .and_then(|label| list.iter().position(|&i| pores[i].label == label))
    {
        area = area.vertical_scroll_offset(
            (at as f32 * (row + ui.spacing().item_spacing.y) - 2.0 * row).max(0.0),
        );
    }
    let mut clicked = None;
    area.show_rows(ui, row, list.len(), |ui, range| {
        for &i in &list[range] {
            let pore = &pores[i];
            let (rect, response) = ui.allocate_exact_size(vec2(width, row), Sense::click());
            let is_picked = picked == Some(pore.label);
            let name = || {
                let [x, y] = [pore.x_mm, pore.y_mm].map(|mm| fixed(mm, 1));
                tr!("pore {} at {}, {} mm", pore.label, x, y)
            };
            response.widget_info(|| {
                egui::WidgetInfo::selected(egui::Role::Button, true, is_picked, name())
            });
            if is_picked {
                ui.painter().rect_filled(rect, 2.0, ui.visuals().selection.bg_fill);
            } else if response.hovered() {
                ui.painter().rect_filled(rect, 2.0, ui.visuals().widgets.hovered.weak_bg_fill);
            }
            let colour = if is_picked {
                ui.visuals().selection.stroke.color
            } else {
                ui.visuals().text_color()
            };
            for (k, (_, _, value)) in COLUMNS[..columns].iter().enumerate() {
                let value = value(pore);
                let text = if value.is_nan() { "–".into() } else { significant(value, 3) };
                write(ui, rect, k, text, colour);
            }
            if response.clicked() {
                clicked = Some(pore.label);
            }
        }
    });
    clicked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_share_what_is_left_over_and_never_touch() {
        let widths = [40.0, 30.0, 50.0];
        assert_eq!(ends(&widths, 166.0), [40.0, 90.0, 160.0]);
        assert_eq!(ends(&widths, 60.0), [40.0, 75.0, 130.0]);
        assert_eq!(ends(&[40.0], 20.0), [40.0]);
    }

    /// Beside a picture, in small print as large as the window's.
    #[test]
    fn all_heads_have_room_beside_a_picture() {
        let heads = heads(COLUMNS.len(), Order::default());
        let mut found = Vec::new();
        let mut output = egui::Context::default().run_ui(egui::RawInput::default(), |ui| {
            let small = egui::FontId::proportional(12.0);
            ui.style_mut().text_styles.insert(egui::TextStyle::Small, small);
            found = ends_of(ui, &heads, super::super::ASIDE - 10.0);
        });
        output.textures_delta.clear();
        assert!(
            found.is_sorted() && found.last() <= Some(&(super::super::ASIDE - 16.0 + 0.01)),
            "{found:?}"
        );
    }

    #[test]
    fn tables_are_sorted_and_what_is_unknown_comes_last() {
        let pore = |label, diameter_mm, bar_mm| Pore {
            label,
            x_mm: 0.0,
            y_mm: 0.0,
            area_px: 1,
            area_mm2: 1.0,
            volume_mm3: 1.0,
            diameter_mm,
            circularity: 1.0,
            depth_mm: 1.0,
            bar_mm,
            missing_mass: 1.0,
        };
        let pores = [pore(1, 2.0, None), pore(2, 3.0, Some(5.0)), pore(3, 1.0, Some(7.0))];
        assert_eq!(sorted(&pores, Order::default()), [1, 0, 2]);
        assert_eq!(sorted(&pores, Order { column: 0, falling: false }), [2, 0, 1]);
        for (falling, first) in [(true, 2), (false, 1)] {
            let list = sorted(&pores, Order { column: 5, falling });
            assert_eq!((list[0], list[2]), (first, 0));
        }
    }
}
