//! What is wrong with evidence by itself: numbers outside their range, units that were mistaken.

use super::{
    super::check::Checker,
    Along, EvidenceFile, Finding, MemberSlices, Photo, Record, Survey,
    table::{self, Seat},
};
use crate::{
    file::Slices,
    problem::Problem,
    structure::{Date, Electrode},
};

/// Lists all that is wrong with a file of evidence as far as it can be told without its scene:
/// numbers out of range, names that are empty. Whether its members, faces and gauges are there is
/// told when the scene is loaded.
#[must_use]
pub fn check(file: &EvidenceFile) -> Vec<Problem> {
    let mut c = Checker::default();
    for (section, n) in [
        ("items", file.items.len()),
        ("tables", file.tables.len()),
        ("slices", file.slices.len()),
        ("photographs", file.photographs.len()),
        ("tests", file.tests.len()),
        ("gauges", file.gauges.len()),
        ("readings", file.readings.len()),
    ] {
        c.most(section, n);
    }
    if !c.problems.is_empty() {
        return c.problems;
    }
    c.unique("tests", "name", file.tests.iter().map(|t| t.name.clone()));
    c.unique("gauges", "name", file.gauges.iter().map(|g| g.name.clone()));
    c.each("items", &file.items, Checker::record);
    c.each("tables", &file.tables, Checker::survey);
    c.each("slices", &file.slices, Checker::member_slices);
    c.each("photographs", &file.photographs, Checker::photograph);
    c.each("tests", &file.tests, Checker::test);
    c.each("gauges", &file.gauges, Checker::gauge);
    c.each("readings", &file.readings, Checker::reading);
    c.problems
}

/// What is wrong with one record; places are its fields.
pub(super) fn check_record(record: &Record) -> Vec<Problem> {
    let mut c = Checker::default();
    c.record(record);
    c.problems
}

/// What is wrong with where a gauge is said to be; places are columns.
pub(super) fn check_seat(seat: &Seat) -> Vec<Problem> {
    let mut c = Checker::default();
    c.spot(Some(Along([seat.along; 2])), seat.face.is_some(), seat.angle_deg, None);
    if let Some(depth) = seat.depth_mm {
        c.within("depth_mm", depth, 0.0, 10_000.0);
    }
    c.problems
}

/// Why what was measured on a day to come does not count, unless it is confirmed.
pub(super) fn to_come(date: Date) -> String {
    format!("{}, or confirm it (confirmed: true, attach --confirmed)", date.to_come())
}

impl Checker<'_> {
    fn record(&mut self, r: &Record) {
        self.text("member", &r.member);
        self.text("name", &r.name);
        if let Some(instrument) = &r.instrument {
            self.text("instrument", instrument);
        }
        self.date(r.date.filter(|_| !r.confirmed));
        self.spot(r.along, r.face.is_some(), r.angle_deg, r.height_m);
        self.at("shows", |c| c.finding(&r.shows));
    }

    fn photograph(&mut self, photo: &Photo) {
        let Photo { file, picks, member, name, date, focal_px, picking_px, shadow_error_mm } =
            photo;
        for (field, text) in [("file", file), ("picks", picks), ("member", member), ("name", name)]
        {
            self.text(field, text);
        }
        self.past(*date);
        for (field, value, low, high) in [
            ("focal_px", focal_px, 10.0, 1e6),
            ("picking_px", picking_px, 0.01, 100.0),
            ("shadow_error_mm", shadow_error_mm, 0.0, 1000.0),
        ] {
            if let Some(value) = value {
                self.within(field, *value as f32, low, high);
            }
        }
    }

    fn date(&mut self, date: Option<Date>) {
        if let Some(date) = date.filter(|d| d.is_to_come()) {
            self.error("date", "FUTURE", to_come(date));
        }
    }

    /// A day that nobody can confirm before it has come.
    pub(crate) fn past(&mut self, date: Option<Date>) {
        if let Some(date) = date.filter(|d| d.is_to_come()) {
            self.error("date", "FUTURE", date.to_come());
        }
    }

    fn spot(
        &mut self,
        along: Option<Along>,
        has_face: bool,
        angle_deg: Option<f32>,
        height_m: Option<f32>,
    ) {
        if let Some(Along([from, to])) = along {
            let ok = self.share_of_axis(from) && self.share_of_axis(to);
            if ok && from > to {
                let message = format!("ends at {to}, before it begins at {from}: turn them round");
                self.error("along", "ORDER", message);
            }
        }
        if has_face && angle_deg.is_some() {
            self.error("angle_deg", "TWICE", "a face is given too: keep one of them");
        }
        if let Some(angle) = angle_deg {
            self.within("angle_deg", angle, -360.0, 360.0);
        }
        if let Some(height) = height_m {
            self.within("height_m", height, 0.0, 2000.0);
        }
    }

    fn share_of_axis(&mut self, at: f32) -> bool {
        let ok = (0.0..=1.0).contains(&at);
        if !ok {
            let message = format!(
                "{at} is outside 0 to 1: it is a share of the axis, not metres or per cent"
            );
            self.error("along", "RANGE", message);
        }
        ok
    }

    /// What an instrument showed.
    fn finding(&mut self, finding: &Finding) {
        match *finding {
            Finding::Cover { mm, std_error_mm } => {
                if self.length_mm("mm", mm, 500.0) {
                    self.std_error("std_error_mm", std_error_mm, 250.0);
                }
            }
            Finding::Rebound { number, std_error } => {
                self.within("number", number as f32, 10.0, 100.0);
                self.std_error("std_error", std_error, 50.0);
            }
            Finding::Velocity { m_s, std_error_m_s } => {
                if (0.3..=8.0).contains(&m_s) {
                    let message = format!(
                        "{m_s} m/s is slower than any pulse: in km/s? write {}",
                        m_s * 1000.0
                    );
                    self.error("m_s", "UNIT", message);
                } else {
                    self.within("m_s", m_s as f32, 300.0, 8000.0);
                }
                self.std_error("std_error_m_s", std_error_m_s, 4000.0);
            }
            Finding::CoreStrength { mpa, std_error_mpa, diameter_mm, length_mm } => {
                self.within("mpa", mpa as f32, 1.0, 300.0);
                self.std_error("std_error_mpa", std_error_mpa, 150.0);
                if self.within("diameter_mm", diameter_mm as f32, 20.0, 500.0) {
                    let [least, most] = [0.5, 5.0].map(|ratio| (ratio * diameter_mm) as f32);
                    self.within("length_mm", length_mm as f32, least, most);
                }
            }
            Finding::HalfCell { mv, std_error_mv, electrode } => {
                self.potential(mv, electrode);
                self.std_error("std_error_mv", std_error_mv, 500.0);
            }
            Finding::Chloride {
                ref depths_mm,
                ref percent_of_cement,
                ref percent_of_concrete,
                std_error_percent,
            } => {
                self.profile(depths_mm, percent_of_cement, percent_of_concrete);
                self.std_error("std_error_percent", std_error_percent, 10.0);
            }
            Finding::Carbonation { mm, std_error_mm } => {
                if mm == 0.0 || self.length_mm("mm", mm, 500.0) {
                    self.std_error("std_error_mm", std_error_mm, 250.0);
                }
            }
            _ => self.seen(finding),
        }
    }

    /// What is found without an instrument.
    fn seen(&mut self, finding: &Finding) {
        match *finding {
            Finding::Sounding { hollow_m2, tapped_m2 } => {
                let tapped = self.area("tapped_m2", tapped_m2);
                if tapped && !(hollow_m2 >= 0.0 && hollow_m2 <= tapped_m2) {
                    let message =
                        format!("{hollow_m2} must be between 0 and what was tapped, {tapped_m2}");
                    self.error("hollow_m2", "RANGE", message);
                }
            }
            Finding::Crack { width_mm, std_error_mm, length_m, .. } => {
                self.above("width_mm", width_mm as f32, 0.0, 100.0);
                self.std_error("std_error_mm", std_error_mm, 50.0);
                if let Some(length) = length_m {
                    self.above("length_m", length as f32, 0.0, 2000.0);
                }
            }
            Finding::Spall { area_m2, depth_mm, .. } => {
                self.area("area_m2", area_m2);
                if let Some(depth) = depth_mm {
                    self.length_mm("depth_mm", depth, 1000.0);
                }
            }
            Finding::Rust { area_m2 }
            | Finding::Efflorescence { area_m2 }
            | Finding::WetSpot { area_m2 } => _ = self.area("area_m2", area_m2),
            _ => {}
        }
    }

    /// A length of a millimetre at least; what is less was given in metres.
    fn length_mm(&mut self, field: &str, mm: f64, most: f32) -> bool {
        if mm > 0.0 && mm < 1.0 {
            let message = format!("{mm} is less than a millimetre: it is in mm, 35 for .035 m");
            self.error(field, "UNIT", message);
            return false;
        }
        self.within(field, mm as f32, 1.0, most)
    }

    fn area(&mut self, field: &str, m2: f64) -> bool {
        self.above(field, m2 as f32, 0.0, 1e5)
    }

    fn std_error(&mut self, field: &str, error: Option<f64>, most: f32) {
        if let Some(error) = error {
            self.above(field, error as f32, 0.0, most);
        }
    }

    fn potential(&mut self, mv: f64, electrode: Electrode) {
        if mv != 0.0 && mv.abs() < 2.0 {
            let message = format!("{mv} mV is hardly a potential: in volts? write {}", mv * 1000.0);
            self.error("mv", "UNIT", message);
        } else if self.within("mv", mv as f32, -1500.0, 1000.0) && mv > 350.0 {
            let message = format!(
                "{mv} mV against {} is no potential of steel in concrete: was the sign lost? \
                 write -{mv}",
                electrode.name()
            );
            self.error("mv", "SIGN", message);
        }
    }

    fn profile(&mut self, depths: &[f64], of_cement: &[f64], of_concrete: &[f64]) {
        let (field, percents, most) = match (of_cement, of_concrete) {
            (cement, []) => ("percent_of_cement", cement, 20.0),
            ([], concrete) => ("percent_of_concrete", concrete, 3.0),
            _ => {
                let message = "percent_of_cement is given too: keep one of them";
                return self.error("percent_of_concrete", "TWICE", message);
            }
        };
        if depths.is_empty() || depths.len() != percents.len() || depths.len() > 1000 {
            let message = format!(
                "has {} depths and {} values: give one value for each depth, 1 to 1000",
                depths.len(),
                percents.len()
            );
            return self.error(field, "LENGTH", message);
        }
        for (i, (depth, percent)) in depths.iter().zip(percents).enumerate() {
            self.within(&format!("depths_mm[{i}]"), *depth as f32, 0.0, 500.0);
            self.within(&format!("{field}[{i}]"), *percent as f32, 0.0, most);
        }
        if depths.windows(2).any(|w| w[1] <= w[0]) {
            self.error("depths_mm", "ORDER", "depths must rise");
        }
    }

    fn survey(&mut self, s: &Survey) {
        self.text("file", &s.file);
        self.text("member", &s.member);
        self.text("name", &s.name);
        self.date(s.date.filter(|_| !s.confirmed));
        self.spot(s.along, s.face.is_some(), s.angle_deg, s.height_m);
        if let Some(instrument) = &s.instrument {
            self.text("instrument", instrument);
        }
        // Where it is not given here the table may have a column of units.
        if let (Some(_), Err(message)) = (&s.unit, table::unit(s.kind, s.unit.as_deref())) {
            self.error("unit", "UNIT", message);
        }
    }

    fn member_slices(&mut self, m: &MemberSlices) {
        self.text("member", &m.member);
        if m.slices.is_empty() {
            self.error("slices", "EMPTY", "names no slices: give Files(…)");
        }
        self.each("slices", &m.slices, |c, slices| match slices {
            Slices::Files { .. } | Slices::Stack { .. } => {
                c.slices(slices);
                c.past(slices.drilled().date);
            }
            Slices::Drawn { .. } | Slices::Scanned { .. } => {
                let message = "is no evidence: slices that are drawn or scanned from the planted \
                               truth belong into the scene; name the files of real ones";
                c.error("", "NO_EVIDENCE", message);
            }
        });
    }
}
