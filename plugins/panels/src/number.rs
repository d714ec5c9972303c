//! Numbers for people.

use intrados_stage::time::{DAY, HOUR};

use crate::lang::{fixed, local};

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
        return tr!("unknown");
    }
    if mean == 0.0 && error == 0.0 {
        return format!("0 {unit}");
    }
    if !error.is_finite() {
        return tr!("{} {}, error unknown", significant(mean, 4), unit);
    }
    let largest = mean.abs().max(error);
    let exponent = largest.log10().floor() as i32;
    // Plain digits from a thousandth to a million, powers of ten beyond.
    if (-3..6).contains(&exponent) {
        let d = decimals(error);
        return format!("{} ± {} {unit}", fixed(mean, d), fixed(error, d));
    }
    let (m, e) = (mean / 10_f64.powi(exponent), error / 10_f64.powi(exponent));
    let d = decimals(e);
    format!("({} ± {})e{exponent} {unit}", fixed(m, d), fixed(e, d))
}

/// A value that a click puts on the clipboard, with its unit and its error.
pub(crate) fn copied(ui: &mut egui::Ui, text: egui::RichText) -> egui::Response {
    let plain = text.text().to_owned();
    let label = ui.add(egui::Label::new(text).sense(egui::Sense::click()));
    if label.clicked() {
        ui.ctx().copy_text(plain);
    }
    label.on_hover_text(tr!("Click to copy")).on_hover_cursor(egui::CursorIcon::Copy)
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
        fixed(x, d)
    } else {
        local(format!("{x:.*e}", digits - 1))
    }
}

/// A share as per cent, two digits.
pub(crate) fn percent(share: f64) -> String {
    if share.is_finite() { format!("{} %", significant(100.0 * share, 2)) } else { tr!("unknown") }
}

/// Seconds, minutes or hours.
pub(crate) fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => tr!("unknown"),
        s if s < 99.5 => format!("{s:.0} s"),
        s if s < 5_940.0 => format!("{:.0} min", s / 60.0),
        s if s < DAY => format!("{} h", fixed(s / HOUR, 1)),
        s => format!("{:.0} d", s / DAY),
    }
}

/// Large whole numbers with a prefix.
pub(crate) fn count(n: f64) -> String {
    match n {
        n if n < 10.0 => fixed(n, 1),
        n if n < 1e3 => fixed(n, 0),
        n if n < 1e6 => format!("{} k", fixed(n / 1e3, 1)),
        n if n < 1e9 => format!("{} M", fixed(n / 1e6, 1)),
        n => format!("{} G", fixed(n / 1e9, 2)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Language, lang::speak};

    #[test]
    fn digits_follow_the_error() {
        assert_eq!(plus_minus(1234.5, 12.0, "N"), "1234 ± 12 N");
        assert_eq!(plus_minus(-0.5, 0.25, ""), "-0.50 ± 0.25 ");
        assert_eq!(plus_minus(f64::NAN, 1.0, "N"), "unknown");
        assert_eq!(plus_minus(0.0, 1e-8, "N"), "(0.0 ± 1.0)e-8 N");
        assert_eq!(plus_minus(3e7, 1e6, "N"), "(3.00 ± 0.10)e7 N");
    }

    #[test]
    fn numbers_are_written_as_the_language_writes_them() {
        speak(Language::German);
        assert_eq!(plus_minus(0.270_234, 0.000_312, "W/m²"), "0,27023 ± 0,00031 W/m²");
        assert_eq!((percent(0.012_34), count(12_345.0)), ("1,2 %".into(), "12,3 k".into()));
        assert_eq!(
            (significant(2.06e-5, 3), duration(9_000.0)),
            ("2,06e-5".into(), "2,5 h".into())
        );
        speak(Language::English);
        assert_eq!(percent(0.012_34), "1.2 %");
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
