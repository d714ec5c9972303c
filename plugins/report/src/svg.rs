//! Small drawings for the report, as inline SVG.

use std::fmt::Write;

use intrados_damage::{
    verdict::Basis,
    zone::{ZONES, middle},
};
use intrados_predict::{Defect, MemberPrediction};
use intrados_stage::Estimate;

use crate::{
    labels::{self, Area, Mark},
    words::word,
};

// What lines, bars and marks look like: attributes, since printers do not give a page's style to the
// drawings in it.
const GRID: &str = "stroke=\"#e6eaef\"";
const AXIS: &str = "stroke=\"#1c2430\"";
const BAR: &str = "fill=\"#3f7fb2\"";
const TRACK: &str = "fill=\"#e9edf1\"";
const LIMIT: &str = "stroke=\"#aab3be\"";
const DARK: &str = "fill=\"#47586c\"";
const PALE: &str = "fill=\"#aab6c2\"";
const HOLLOW: &str = "fill=\"none\" stroke=\"#8a96a3\" stroke-dasharray=\"2 1.5\"";
const WHISKER: &str = "stroke=\"#000\" stroke-width=\"1.2\" fill=\"none\"";
const TRUTH: &str = "fill=\"#aa28be\"";
const TRUE: &str = "stroke=\"#aa28be\" stroke-width=\"2\"";
const AREA: &str = "fill=\"#c77700\" fill-opacity=\".25\" stroke=\"#8a5200\"";
const CRACK: &str = "stroke=\"#8f1d1b\" stroke-width=\"2\"";
const LEADER: &str = "stroke=\"#67727e\" stroke-width=\".7\"";
const NUMBER: &str = "fill=\"#1c2430\" font-weight=\"600\"";
const HALO: &str =
    "fill=\"#fff\" stroke=\"#fff\" stroke-width=\"2.5\" font-weight=\"600\" aria-hidden=\"true\"";
/// Of sources of evidence.
const MARKS: [&str; 5] = [
    "fill=\"#e08a1e\"",
    "fill=\"#2b8a5e\"",
    "fill=\"#0b5c94\"",
    "fill=\"#7a4a16\"",
    "fill=\"#1f2a37\"",
];

/// The beginning of a drawing: how large the page makes it, its own size, what it is called.
pub(super) fn head(class: &str, [w, h]: [f64; 2], name: &str) -> String {
    format!(
        "<svg class=\"{class}\" viewBox=\"0 0 {w:.0} {h:.0}\" role=\"img\" font-size=\"11\" fill=\"#5b6675\"><title>{name}</title>"
    )
}

/// Diameters of pores in classes of equal ratio (√2), with axes.
pub(super) fn histogram(diameters: &[f64]) -> String {
    let Some(smallest) = diameters.iter().copied().filter(|d| *d > 0.0).reduce(f64::min) else {
        return String::new();
    };
    let class = |d: f64| (2.0 * (d / smallest).log2() + 1e-9).floor().clamp(0.0, 31.0) as usize;
    let mut counts = [0_usize; 32];
    diameters.iter().filter(|d| **d > 0.0).for_each(|&d| counts[class(d)] += 1);
    let classes = counts.iter().rposition(|&n| n > 0).unwrap_or(0) + 1;
    let most = counts.iter().copied().max().unwrap_or(1).max(1);
    let (w, h, left, bottom) = (440.0, 170.0, 44.0, 36.0);
    let step = (w - left - 8.0) / classes as f64;
    let y = |n: f64| (h - bottom) - (h - bottom - 14.0) * n / most as f64;
    let mut svg = head("plot", [w, h], "Histogram of pore diameters");
    for n in ticks(most) {
        let (at, label) = (y(n as f64), n);
        let _ = write!(
            svg,
            "<line x1=\"{left}\" x2=\"{w}\" y1=\"{at:.1}\" y2=\"{at:.1}\" {GRID}/><text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            left - 5.0,
            at + 3.5
        );
    }
    for (k, &n) in counts[..classes].iter().enumerate() {
        let (x, top) = (left + step * k as f64, y(n as f64));
        let _ = write!(
            svg,
            "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" {BAR}/>",
            x + 1.0,
            (step - 2.0).max(1.0),
            h - bottom - top
        );
        if k % 2 == 0 {
            let d = smallest * 2_f64.powf(k as f64 / 2.0);
            let _ = write!(
                svg,
                "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                h - bottom + 14.0,
                short(d)
            );
        }
    }
    let _ = write!(
        svg,
        "<line x1=\"{left}\" x2=\"{w}\" y1=\"{0:.1}\" y2=\"{0:.1}\" {AXIS}/><text x=\"{1:.0}\" y=\"{2:.0}\" text-anchor=\"middle\">equivalent diameter [mm]</text><text x=\"12\" y=\"{3:.0}\" text-anchor=\"middle\" transform=\"rotate(-90 12 {3:.0})\">pores</text></svg>",
        h - bottom,
        0.5 * (w + left),
        h - 4.0,
        0.5 * (h - bottom) + 6.0
    );
    svg
}

/// A damage from 0 to 1 with its 95 % interval, the states' limits, and a mark for the truth.
pub(super) fn gauge(
    damage: f64,
    std_error: f64,
    basis: Basis,
    truth: Option<f64>,
    limits: &[f64],
) -> String {
    let x = |d: f64| 4.0 + 152.0 * d.clamp(0.0, 1.0);
    let name = format!("damage {damage:.2} ± {std_error:.2}");
    let mut svg = head("gauge", [160.0, 18.0], &name);
    let _ = write!(svg, "<rect x=\"4\" y=\"6\" width=\"152\" height=\"6\" {TRACK}/>");
    for &limit in limits.iter().filter(|l| **l > 0.0) {
        let _ =
            write!(svg, "<line x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"3\" y2=\"15\" {LIMIT}/>", x(limit));
    }
    let _ = write!(
        svg,
        "<rect x=\"4\" y=\"6\" width=\"{:.1}\" height=\"6\" {}/>",
        x(damage) - 4.0,
        fill(basis, DARK)
    );
    let (low, high) = (x(damage - 1.96 * std_error), x(damage + 1.96 * std_error));
    let _ = write!(svg, "<path d=\"M{low:.1} 5v8M{low:.1} 9H{high:.1}M{high:.1} 5v8\" {WHISKER}/>");
    if let Some(t) = truth {
        let _ = write!(svg, "<path d=\"M{0:.1} 0l3.5 5h-7z\" {TRUTH}/>", x(t));
    }
    svg + "</svg>"
}

/// What is a forecast alone is hollow.
fn fill(basis: Basis, solid: &'static str) -> &'static str {
    if basis == Basis::Forecast { HOLLOW } else { solid }
}

/// Damage along a member's axis: a bar for each zone with its 95 % interval, what each source says
/// as a mark of its own, and the truth where it is known.
pub(super) fn profile(m: &MemberPrediction) -> String {
    let (w, h, left, bottom) = (440.0, 190.0, 44.0, 36.0);
    let step = (w - left - 8.0) / ZONES as f64;
    let x = |along: f64| left + step * ZONES as f64 * along;
    let y = |d: f64| (h - bottom) - (h - bottom - 22.0) * d.clamp(0.0, 1.0);
    let mut svg = head("plot", [w, h], "Damage along the axis");
    for d in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let _ = write!(
            svg,
            "<line x1=\"{left}\" x2=\"{w}\" y1=\"{0:.1}\" y2=\"{0:.1}\" {GRID}/><text x=\"{1:.0}\" y=\"{2:.1}\" text-anchor=\"end\">{d}</text>",
            y(d),
            left - 5.0,
            y(d) + 3.5
        );
    }
    for (zone, known) in m.zones.0.iter().enumerate() {
        let Some(Estimate { value, std_error }) = *known else { continue };
        let _ = write!(
            svg,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" {}/>",
            x(middle(zone)) - 0.4 * step,
            y(value),
            0.8 * step,
            y(0.0) - y(value),
            fill(m.zone_basis[zone], PALE)
        );
        let (at, low, high) =
            (x(middle(zone)), y(value - 1.96 * std_error), y(value + 1.96 * std_error));
        let _ = write!(
            svg,
            "<path d=\"M{0:.1} {low:.1}h6m-3 0V{high:.1}m-3 0h6\" {WHISKER}/>",
            at - 3.0
        );
    }
    // With a place for the truth.
    let pitch = ((w - left - 8.0) / (m.evidence.len() + 1) as f64).min(96.0);
    for (k, (source, evidence)) in m.evidence.iter().enumerate() {
        let shift = (k as f64 + 0.5) / m.evidence.len() as f64 - 0.5;
        let look = MARKS[k % MARKS.len()];
        let mark = |at: f64, d: f64| match k % MARKS.len() {
            0 => format!("<circle cx=\"{at:.1}\" cy=\"{d:.1}\" r=\"3.2\" {look}/>"),
            1 => format!(
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"6\" height=\"6\" {look}/>",
                at - 3.0,
                d - 3.0
            ),
            2 => format!("<path d=\"M{at:.1} {:.1}l4 7h-8z\" {look}/>", d - 4.0),
            3 => format!("<path d=\"M{at:.1} {:.1}l4 4-4 4-4-4z\" {look}/>", d - 4.0),
            _ => format!("<path d=\"M{at:.1} {:.1}l4-7h-8z\" {look}/>", d + 4.0),
        };
        for (zone, reading) in
            evidence.by_zone().0.iter().enumerate().filter_map(|(zone, r)| Some((zone, (*r)?)))
        {
            svg += &mark(x(middle(zone)) + 0.5 * shift * step, y(reading.value));
        }
        let at = left + 8.0 + pitch * k as f64;
        let _ = write!(
            svg,
            "{}<text x=\"{:.1}\" y=\"11\">{}</text>",
            mark(at, 7.0),
            at + 8.0,
            word(source)
        );
    }
    for (zone, &truth) in
        m.truth.iter().filter_map(|t| t.zones.as_ref()).flat_map(|zones| zones.iter().enumerate())
    {
        let _ = write!(
            svg,
            "<path d=\"M{:.1} {:.1}h{:.1}\" {TRUE}/>",
            x(middle(zone)) - 0.45 * step,
            y(truth),
            0.9 * step
        );
    }
    if m.truth.as_ref().is_some_and(|t| t.zones.is_some()) {
        let at = left + 8.0 + pitch * m.evidence.len() as f64;
        let _ = write!(
            svg,
            "<path d=\"M{:.1} 7h12\" {TRUE}/><text x=\"{:.1}\" y=\"11\">truth</text>",
            at - 4.0,
            at + 12.0
        );
    }
    for tenth in (0..=ZONES).step_by(2) {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            x(tenth as f64 / ZONES as f64),
            h - bottom + 14.0,
            100 * tenth / ZONES
        );
    }
    let _ = write!(
        svg,
        "<line x1=\"{left}\" x2=\"{w}\" y1=\"{0:.1}\" y2=\"{0:.1}\" {AXIS}/><text x=\"{1:.0}\" y=\"{2:.0}\" text-anchor=\"middle\">place on the axis from its start [%]</text><text x=\"12\" y=\"{3:.0}\" text-anchor=\"middle\" transform=\"rotate(-90 12 {3:.0})\">damage</text></svg>",
        y(0.0),
        0.5 * (w + left),
        h - 4.0,
        y(0.5)
    );
    svg
}

/// What is lost of the bars at an age.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Point {
    /// Of an inspection; none: of a forecast, or of nobody knows when.
    pub(super) date: Option<String>,
    pub(super) age_years: f64,
    /// Share of the bars' section.
    pub(super) lost: Estimate,
}

/// The course of rust over the years with its 95 % intervals; the forecast is hollow.
pub(super) fn course(points: &[Point]) -> String {
    let (w, h, left, bottom) = (440.0, 150.0, 44.0, 34.0);
    let ages = points.iter().map(|p| p.age_years);
    let (first, last) =
        ages.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
    let reach = |p: &Point| 100.0 * (p.lost.value + 1.96 * p.lost.std_error).min(1.0);
    let most = points.iter().map(reach).fold(1.0, f64::max);
    let ticks = ticks(most.ceil() as usize);
    let top = most.max(ticks.last().map_or(1.0, |t| *t as f64));
    let x = |age: f64| left + 16.0 + (w - left - 40.0) * (age - first) / (last - first).max(1e-9);
    let y = |percent: f64| (h - bottom) - (h - bottom - 10.0) * percent.clamp(0.0, top) / top;
    let mut svg = head("plot", [w, h], "Course of rust");
    for tick in ticks {
        let at = y(tick as f64);
        let _ = write!(
            svg,
            "<line x1=\"{left}\" x2=\"{w}\" y1=\"{at:.1}\" y2=\"{at:.1}\" {GRID}/><text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{tick}</text>",
            left - 5.0,
            at + 3.5
        );
    }
    let line: Vec<String> = points
        .iter()
        .map(|p| format!("{:.1} {:.1}", x(p.age_years), y(100.0 * p.lost.value)))
        .collect();
    let _ = write!(svg, "<path d=\"M{}\" {AXIS} fill=\"none\"/>", line.join("L"));
    for p in points {
        let Estimate { value, std_error } = p.lost;
        let (at, low, high) = (
            x(p.age_years),
            y(100.0 * (value - 1.96 * std_error)),
            y(100.0 * (value + 1.96 * std_error)),
        );
        let look = if p.date.is_some() { PALE } else { HOLLOW };
        let _ = write!(
            svg,
            "<path d=\"M{0:.1} {low:.1}h6m-3 0V{high:.1}m-3 0h6\" {WHISKER}/><circle cx=\"{at:.1}\" cy=\"{1:.1}\" r=\"4\" {look}/><text x=\"{at:.1}\" y=\"{2:.1}\" text-anchor=\"middle\">{3:.0}</text>",
            at - 3.0,
            y(100.0 * value),
            h - bottom + 14.0,
            p.age_years
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">age [years]</text><text x=\"12\" y=\"{2:.0}\" text-anchor=\"middle\" transform=\"rotate(-90 12 {2:.0})\">lost [%]</text></svg>",
        0.5 * (w + left),
        h - 4.0,
        y(0.5 * top)
    );
    svg
}

/// At most five round numbers from 0 up.
fn ticks(most: usize) -> Vec<usize> {
    let raw = (most as f64 / 4.0).max(1.0);
    let power = 10_f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|s| *s >= raw)
        .unwrap_or(raw)
        .max(1.0) as usize;
    (0..=most / step).map(|k| k * step).collect()
}

fn short(v: f64) -> String {
    match v {
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

/// A member's surface, unrolled: along it from left to right, once around from below to above, with
/// the zones' damage as a strip and every defect where it is. What has no side lies in a row of its
/// own beneath; what has no place on the axis is in the table alone.
pub(super) fn map(m: &MemberPrediction, length: f64) -> String {
    let (w, h, left, strip) = (900.0, 200.0, 46.0, 10.0);
    let (right, top, bottom) = (w - 10.0, strip + 10.0, h - 54.0);
    let x = |along: f64| left + (right - left) * along.clamp(0.0, 1.0);
    let y = |angle: f64| bottom - (bottom - top) * (angle.rem_euclid(360.0) / 360.0);
    let mut svg = head("plot map", [w, h], "Unrolled surface with defects");
    for zone in 0..ZONES {
        let damage = m.zones.0[zone].map_or(0.0, |d| d.value);
        let _ = write!(
            svg,
            "<rect x=\"{:.1}\" y=\"2\" width=\"{:.1}\" height=\"{strip}\" {PALE} fill-opacity=\"{:.2}\"/>",
            x(zone as f64 / ZONES as f64),
            (right - left) / ZONES as f64 - 1.0,
            0.1 + 0.9 * damage
        );
    }
    for angle in [0, 90, 180, 270, 360] {
        let at = bottom - (bottom - top) * f64::from(angle) / 360.0;
        let _ = write!(
            svg,
            "<line x1=\"{left}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" {GRID}/><text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{angle}°</text>",
            left - 5.0,
            at + 3.5
        );
    }
    for tenth in (0..=10).step_by(2) {
        let along = f64::from(tenth) / 10.0;
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{:.1}</text>",
            x(along),
            h - 16.0,
            length * along
        );
    }
    let beneath = bottom + 12.0;
    let _ = write!(
        svg,
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">side?</text><text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">along the member [m]; the strip above: damage of each tenth</text>",
        left - 5.0,
        beneath + 3.5,
        0.5 * (left + right),
        h - 2.0
    );
    let metre = (right - left) / length.max(1e-3);
    let mark = |defect: &Defect| {
        let [from, to] = defect.along?;
        let middle = [x(0.5 * (from + to)), defect.angle_deg.map_or(beneath, y)];
        let [dx, dy] = half_sides(defect, 0.5 * (x(to) - x(from)), metre);
        let [first, last] = [(middle[0] - dx).max(left), (middle[0] + dx).min(right)];
        // What goes round from 360° to 0° is cut there, and the member ends at its ends.
        let [low, high] = [(middle[1] - dy).max(top), (middle[1] + dy).min(beneath + 6.0)];
        Some(match defect.area_m2 {
            Some(_) => Mark::Box(Area {
                low: [first, low],
                high: [last.max(first + 2.0), high.max(low + 2.0)],
            }),
            None => Mark::Line([first, high], [last, low]),
        })
    };
    let marks = m.defects.iter().enumerate().filter_map(|(n, d)| Some((n + 1, mark(d)?)));
    let (numbers, marks): (Vec<usize>, Vec<Mark>) = marks.unzip();
    let size = |number: usize| [DIGIT[0] * number.to_string().len() as f64, DIGIT[1]];
    let sized: Vec<_> = marks.iter().zip(&numbers).map(|(mark, n)| (*mark, size(*n))).collect();
    marks.iter().for_each(|mark| draw(&mut svg, mark));
    let within = Area { low: [left, 2.0], high: [right, beneath + 8.0] };
    for (number, label) in numbers.iter().zip(labels::place(&sized, &within)) {
        if let Some([[x1, y1], [x2, y2]]) = label.leader {
            let _ = write!(
                svg,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {LEADER}/>"
            );
        }
        let (at, base) = (label.area.low[0], label.area.high[1] - 0.5);
        // First its halo: not everybody paints strokes below what they surround.
        for look in [HALO, NUMBER] {
            let _ = write!(svg, "<text x=\"{at:.1}\" y=\"{base:.1}\" {look}>{number}</text>");
        }
    }
    svg + "</svg>"
}

/// Width and height of a digit of the maps, of 11 pixels and bold.
const DIGIT: [f64; 2] = [6.8, 9.0];

/// Half of what a defect measures on a map, along and across, of which `half` is known along, in
/// pixels. Metres along are as they are; across, the same size, since how far it is around is not
/// known.
fn half_sides(defect: &Defect, half: f64, metre: f64) -> [f64; 2] {
    let side = defect.area_m2.map_or(0.0, f64::sqrt) * metre;
    let long = defect.length_m.unwrap_or(0.3) * metre;
    match defect.kind {
        "crack along" => [half.max(0.5 * long), 0.0],
        "diagonal crack" => [0.35 * long, 0.35 * long],
        _ if defect.area_m2.is_none() => [half, (0.5 * long).clamp(6.0, 40.0)],
        _ => [half.max(0.5 * side).max(4.0), (0.5 * side).clamp(4.0, 40.0)],
    }
}

fn draw(svg: &mut String, mark: &Mark) {
    let _ = match mark {
        Mark::Box(Area { low: [x, y], high: [right, bottom] }) => write!(
            svg,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\" {AREA}/>",
            right - x,
            bottom - y
        ),
        Mark::Line([x1, y1], [x2, y2]) => write!(
            svg,
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {CRACK}/>"
        ),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pore_is_in_a_class() {
        assert_eq!(histogram(&[]), "");
        let svg = histogram(&[0.1, 0.1, 0.15, 0.4]);
        assert_eq!(svg.matches(BAR).count(), 5);
        assert_eq!(ticks(9), [0, 5]);
        assert_eq!(ticks(800), [0, 200, 400, 600, 800]);
    }
}
