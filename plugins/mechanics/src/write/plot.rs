//! Curves over curves, as SVG.

use std::{fmt::Write, path::Path};

use intrados_stage::file::WriteError;

use super::put;

/// A curve with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// For the key.
    pub name: String,
    /// In the units of the axes.
    pub points: Vec<(f64, f64)>,
    /// Black and with a mark at every point: what was measured, or what stands out.
    pub marked: bool,
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
/// Left, right, top, bottom.
const MARGIN: [f64; 4] = [60.0, 16.0, 34.0, 48.0];
const INKS: [&str; 4] = ["#7aa6c2", "#3f78a8", "#12406b", "#b0592a"];

/// Draws curves over curves, both axes from 0; the file is written as a whole.
///
/// # Errors
/// The file cannot be written.
pub fn plot(path: &Path, title: &str, axes: [&str; 2], curves: &[Curve]) -> Result<(), WriteError> {
    put(path, |out| out.write_all(svg(title, axes, curves).as_bytes()))
}

fn svg(title: &str, axes: [&str; 2], curves: &[Curve]) -> String {
    let largest = |of: fn(&(f64, f64)) -> f64| {
        curves.iter().flat_map(|c| &c.points).map(of).fold(1e-9, f64::max)
    };
    let (xs, ys) = (ticks(largest(|p| p.0)), ticks(largest(|p| p.1)));
    let [left, right, top, bottom] = MARGIN;
    let x = |v: f64| left + (WIDTH - left - right) * v / xs[xs.len() - 1];
    let y = |v: f64| HEIGHT - bottom - (HEIGHT - top - bottom) * v.max(0.0) / ys[ys.len() - 1];
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/><text x=\"{left}\" y=\"20\" font-size=\"14\">{title}</text>\n"
    );
    for &t in &xs {
        let (at, end, label) = (x(t), HEIGHT - bottom, HEIGHT - bottom + 16.0);
        let _ = writeln!(
            out,
            "<path d=\"M{at:.1} {top}V{end}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{label}\" text-anchor=\"middle\">{t}</text>"
        );
    }
    for &t in &ys {
        let (at, end, label) = (y(t), WIDTH - right, left - 6.0);
        let _ = writeln!(
            out,
            "<path d=\"M{left} {at:.1}H{end}\" stroke=\"#ddd\"/><text x=\"{label}\" y=\"{:.1}\" text-anchor=\"end\">{t}</text>",
            at + 4.0
        );
    }
    let (middle, low) = (0.5 * (left + WIDTH - right), HEIGHT - 10.0);
    let _ =
        writeln!(out, "<text x=\"{middle}\" y=\"{low}\" text-anchor=\"middle\">{}</text>", axes[0]);
    let centre = 0.5 * (top + HEIGHT - bottom);
    let _ = writeln!(
        out,
        "<text x=\"14\" y=\"{centre}\" text-anchor=\"middle\" transform=\"rotate(-90 14 {centre})\">{}</text>",
        axes[1]
    );
    let computed = curves.iter().scan(0, |n, c| {
        *n += usize::from(!c.marked);
        Some(*n)
    });
    for (k, (curve, number)) in curves.iter().zip(computed).enumerate() {
        let ink = if curve.marked { "#000" } else { INKS[(number - 1) % INKS.len()] };
        let path: Vec<String> =
            curve.points.iter().map(|p| format!("{:.1} {:.1}", x(p.0), y(p.1))).collect();
        let _ = writeln!(
            out,
            "<path d=\"M{}\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.6\"/>",
            path.join("L")
        );
        if curve.marked {
            for p in &curve.points {
                let _ = write!(
                    out,
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.6\" fill=\"{ink}\"/>",
                    x(p.0),
                    y(p.1)
                );
            }
        }
        let (key, line) =
            (WIDTH - right - 190.0, HEIGHT - bottom - 12.0 - 16.0 * (curves.len() - 1 - k) as f64);
        let (end, text, base) = (key + 24.0, key + 30.0, line + 4.0);
        let _ = writeln!(
            out,
            "<path d=\"M{key} {line}H{end}\" stroke=\"{ink}\" stroke-width=\"2\"/><text x=\"{text}\" y=\"{base}\">{}</text>",
            curve.name
        );
    }
    out + "</svg>\n"
}

/// Round numbers from 0 to beyond `most`, at most eight.
fn ticks(most: f64) -> Vec<f64> {
    let power = 10f64.powf((most / 6.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| most / s <= 7.0)
        .unwrap_or(10.0 * power);
    // Rounded, so that three steps of .1 are written as .3.
    (0..=(most / step).ceil() as usize).map(|k| (k as f64 * step * 1e6).round() / 1e6).collect()
}
