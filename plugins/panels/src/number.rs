//! Numbers for people.

use intrados_stage::time::{DAY, HOUR};

/// `mean ± error unit`, the error with two digits and the mean with as many as it leaves. Where no
/// error is known: the mean alone.
///
/// ```
/// use intrados_panels::plus_minus;
/// assert_eq!(plus_minus(0.270_234, 0.000_312, "W/m²"), "0.27023 ± 0.00031 W/m²");
/// assert_eq!(plus_minus(2.061e-5, 3.0e-7, "W/m²"), "(2.061 ± 0.030)e-5 W/m²");
/// assert_eq!(plus_minus(12.5, f64::INFINITY, "lx"), "12.50 lx, error unknown");
/// assert_eq!(plus_minus(0.0, 0.0, "lx"), "0 lx");
/// ```
#[must_use]
pub fn plus_minus(mean: f64, error: f64, unit: &str) -> String {
    if !mean.is_finite() {
        return "unknown".into();
    }
    if mean == 0.0 && error == 0.0 {
        return format!("0 {unit}");
    }
    if !error.is_finite() {
        return format!("{} {unit}, error unknown", significant(mean, 4));
    }
    let largest = mean.abs().max(error);
    let exponent = largest.log10().floor() as i32;
    // Plain digits from a thousandth to a million, powers of ten beyond.
    if (-3..6).contains(&exponent) {
        let d = decimals(error);
        return format!("{mean:.d$} ± {error:.d$} {unit}");
    }
    let (m, e) = (mean / 10_f64.powi(exponent), error / 10_f64.powi(exponent));
    let d = decimals(e);
    format!("({m:.d$} ± {e:.d$})e{exponent} {unit}")
}

/// A value that a click puts on the clipboard, with its unit and its error.
pub(crate) fn copied(ui: &mut egui::Ui, text: egui::RichText) -> egui::Response {
    let plain = text.text().to_owned();
    let label = ui.add(egui::Label::new(text).sense(egui::Sense::click()));
    if label.clicked() {
        ui.ctx().copy_text(plain);
    }
    label.on_hover_text("Click to copy").on_hover_cursor(egui::CursorIcon::Copy)
}

/// Decimals that show two digits of `error`.
fn decimals(error: f64) -> usize {
    if error > 0.0 { (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize } else { 3 }
}

/// `x` with `digits` significant digits, as a power of ten where it is very small or large.
pub(crate) fn significant(x: f64, digits: usize) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let exponent = x.abs().log10().floor() as i32;
    if (-3..6).contains(&exponent) {
        let d = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{x:.d$}")
    } else {
        format!("{x:.*e}", digits - 1)
    }
}

/// A share as per cent, two digits.
pub(crate) fn percent(share: f64) -> String {
    if share.is_finite() {
        format!("{} %", significant(100.0 * share, 2))
    } else {
        "unknown".into()
    }
}

/// Seconds, minutes or hours.
pub(crate) fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "unknown".into(),
        s if s < 99.5 => format!("{s:.0} s"),
        s if s < 5_940.0 => format!("{:.0} min", s / 60.0),
        s if s < DAY => format!("{:.1} h", s / HOUR),
        s => format!("{:.0} d", s / DAY),
    }
}

/// Large whole numbers with a prefix.
pub(crate) fn count(n: f64) -> String {
    match n {
        n if n < 10.0 => format!("{n:.1}"),
        n if n < 1e3 => format!("{n:.0}"),
        n if n < 1e6 => format!("{:.1} k", n / 1e3),
        n if n < 1e9 => format!("{:.1} M", n / 1e6),
        n => format!("{:.2} G", n / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_error() {
        assert_eq!(plus_minus(1234.5, 12.0, "N"), "1234 ± 12 N");
        assert_eq!(plus_minus(-0.5, 0.25, ""), "-0.50 ± 0.25 ");
        assert_eq!(plus_minus(f64::NAN, 1.0, "N"), "unknown");
        assert_eq!(plus_minus(0.0, 1e-8, "N"), "(0.0 ± 1.0)e-8 N");
        assert_eq!(plus_minus(3e7, 1e6, "N"), "(3.00 ± 0.10)e7 N");
    }

    #[test]
    fn shares_and_times() {
        assert_eq!(percent(0.012_34), "1.2 %");
        assert_eq!(percent(f64::INFINITY), "unknown");
        assert_eq!(duration(75.2), "75 s");
        assert_eq!(duration(600.0), "10 min");
        assert_eq!(count(12_345.0), "12.3 k");
    }
}
