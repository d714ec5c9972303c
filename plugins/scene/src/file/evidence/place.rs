//! Evidence on the members of its scene.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use super::{
    Along, Evidence, Face, Finding, Photo, Placed, RawReading, Record,
    table::{MOST_STRAIN, Seat, doubt_covers, doubt_profile},
};
use crate::{
    Member, Scene,
    file::{nearest, shorten},
    problem::Problem,
    structure::{
        Action, Course, Date, Gauge, Measures, Observation, Photographed, Reading, Sample, Series,
        Shows, Spot, Structure, Test, usual,
    },
};

/// How many problems are listed before the list is cut.
const MAX_PROBLEMS: usize = 200;
/// Cement in concrete of which nobody knows it, and its mass, kg/m³: a usual mix.
const USUAL_CEMENT: [f64; 2] = [350.0, 2400.0];
/// How far `along` and `height_m` of one spot may differ, as a share of the axis.
const SAME_PLACE: f32 = 0.05;

/// How far a gauge may be from where it was said to be before: along as a share of the axis, around
/// in degrees, below the surface in mm. What is less is rounding.
const SAME_SEAT: [f32; 3] = [1e-3, 1.0, 1.0];

/// Adds what a file of evidence says to a scene, behind what is there. Slices are left out.
///
/// # Errors
/// All that does not fit the scene; then nothing is added.
pub(crate) fn place(scene: &mut Scene, evidence: &Evidence) -> Result<(), Vec<Problem>> {
    let mut found = Placing::new(scene, evidence);
    evidence.readings.iter().for_each(|reading| found.seat(reading));
    found.lists(evidence);
    evidence.records.iter().for_each(|record| found.record(record));
    for (i, photo) in evidence.file.photographs.iter().enumerate() {
        found.photograph(&format!("{}: photographs[{i}]", evidence.name), photo);
    }
    evidence.readings.iter().for_each(|reading| found.reading(reading));
    let Placing {
        problems, observations, photographs, gauges, readings, mut series, warnings, ..
    } = found;
    if !problems.is_empty() {
        return Err(problems);
    }
    scene.warnings.extend(evidence.notes.iter().cloned());
    scene.warnings.extend(warnings);
    let structure = Arc::make_mut(&mut scene.structure);
    structure.tests.extend(evidence.file.tests.iter().cloned());
    structure.gauges.extend(evidence.file.gauges.iter().cloned());
    structure.gauges.extend(gauges);
    structure.readings.extend(evidence.file.readings.iter().cloned());
    structure.readings.extend(readings);
    series.iter_mut().for_each(|s| s.samples.sort_by_key(|sample| sample.date));
    structure.series.extend(series);
    structure.observations.extend(observations);
    structure.photographs.extend(photographs);
    Ok(())
}

/// How a gauge that is not known yet is defined.
const IN_EVIDENCE: &str = "add it to `gauges` of evidence.ron";
/// How a row of a table does so.
const IN_COLUMNS: &str = "say where it is in columns along and face or angle_deg (depth_mm beside \
                          them), or add it to `gauges` of evidence.ron";

/// What is known while evidence is put in its place.
struct Placing<'a> {
    scene: &'a Scene,
    index_of: HashMap<&'a str, usize>,
    /// Names that observations, tables and slices have by now, with their members.
    names: HashSet<(String, String)>,
    /// Gauges and tests of this file, beside those of the scene.
    own: &'a Evidence,
    problems: Vec<Problem>,
    observations: Vec<Observation>,
    photographs: Vec<Photographed>,
    /// Gauges that tables define.
    gauges: Vec<Gauge>,
    /// Gauges of the scene, of this file and of its tables, by name.
    gauge_of: HashMap<String, Gauge>,
    readings: Vec<Reading>,
    series: Vec<Series>,
    /// Where the series of a gauge is among them.
    series_of: HashMap<String, usize>,
    /// What gauges have shown by now, and where that is said first.
    read: HashMap<Shown, String>,
    warnings: Vec<String>,
}

/// What a gauge has shown: its name, the load test, when, and the bits of the value.
type Shown = (String, Option<String>, Option<Date>, u64);

impl<'a> Placing<'a> {
    fn new(scene: &'a Scene, own: &'a Evidence) -> Self {
        let of_slices =
            |m: &'a Member| m.slices.iter().map(|s| (m.id.clone(), s.name().to_owned()));
        let Structure { observations, photographs, .. } = &*scene.structure;
        let names = scene.members.iter().flat_map(of_slices);
        Self {
            scene,
            index_of: scene.members.iter().enumerate().map(|(i, m)| (m.id.as_str(), i)).collect(),
            names: names
                .chain(observations.iter().map(|o| (o.member.clone(), o.name.clone())))
                .chain(photographs.iter().map(|p| (p.member.clone(), p.name.clone())))
                .collect(),
            own,
            problems: Vec::new(),
            observations: Vec::new(),
            photographs: Vec::new(),
            gauges: Vec::new(),
            // Of two of one name the first holds.
            gauge_of: own
                .file
                .gauges
                .iter()
                .rev()
                .chain(scene.structure.gauges.iter().rev())
                .map(|gauge| (gauge.name.clone(), gauge.clone()))
                .collect(),
            readings: Vec::new(),
            series: Vec::new(),
            series_of: HashMap::new(),
            read: HashMap::new(),
            warnings: Vec::new(),
        }
    }

    fn error(&mut self, place: String, code: &'static str, message: impl Into<String>) {
        if self.problems.len() < MAX_PROBLEMS {
            self.problems.push(Problem::error(place, code, message));
        }
    }

    /// The index of a member; a problem where there is none.
    fn member(&mut self, place: &str, id: &str) -> Option<usize> {
        let index = self.index_of.get(id).copied();
        if index.is_none() {
            let message = no_member(id, &self.scene.members);
            self.error(place.to_owned(), "UNKNOWN_MEMBER", message);
        }
        index
    }

    /// Lists whose entries only name members, gauges and tests.
    fn lists(&mut self, evidence: &'a Evidence) {
        let (file, structure) = (&evidence.file, &self.scene.structure);
        let at =
            |list: &str, i: usize, field: &str| format!("{}: {list}[{i}].{field}", evidence.name);
        for (i, test) in file.tests.iter().enumerate() {
            if let Some(index) = self.member(&at("tests", i, "member"), &test.member) {
                self.warnings.extend(doubt_weights(&self.scene.members[index], test));
            }
            if structure.tests.iter().any(|t| t.name == test.name) {
                self.taken(at("tests", i, "name"), &test.name, "a load test of the scene");
            }
        }
        for (i, gauge) in file.gauges.iter().enumerate() {
            self.member(&at("gauges", i, "member"), &gauge.member);
            let is_meter = self.scene.meters.iter().any(|m| m.name == gauge.name);
            if is_meter || structure.gauges.iter().any(|g| g.name == gauge.name) {
                self.taken(at("gauges", i, "name"), &gauge.name, "a gauge or meter of the scene");
            }
        }
        for (i, reading) in file.readings.iter().enumerate() {
            if let Some(gauge) = self.gauge(&at("readings", i, "of"), &reading.of, IN_EVIDENCE) {
                self.sound(at("readings", i, "value"), &gauge, reading.value);
            }
            if let Some(test) = &reading.test {
                self.test(&at("readings", i, "test"), test);
            }
        }
        for (i, survey) in file.tables.iter().enumerate() {
            if self.member(&at("tables", i, "member"), &survey.member).is_some() {
                self.name(at("tables", i, "name"), &survey.member, &survey.name);
            }
        }
        for (i, slices) in file.slices.iter().enumerate() {
            if self.member(&at("slices", i, "member"), &slices.member).is_some() {
                let member = self.index_of.get(slices.member.as_str());
                let member = member.and_then(|k| self.scene.members.get(*k));
                for (k, one) in slices.slices.iter().enumerate() {
                    let place = at("slices", i, &format!("slices[{k}].name"));
                    self.name(place, &slices.member, one.name());
                    let drilled = one.drilled();
                    let deep = member.zip(drilled.depth_m);
                    if let Some(why) = deep.and_then(|(m, d)| too_deep(m, drilled.angle_deg, d)) {
                        let place = at("slices", i, &format!("slices[{k}].depth_m"));
                        self.error(place, "DEPTH", why);
                    }
                }
            }
        }
    }

    fn photograph(&mut self, place: &str, photo: &Photo) {
        if self.member(&format!("{place}.member"), &photo.member).is_none() {
            return;
        }
        self.name(format!("{place}.name"), &photo.member, &photo.name);
        let path = |text: &String| self.own.pictures.get(text).cloned().unwrap_or_default();
        self.photographs.push(Photographed {
            member: photo.member.clone(),
            name: photo.name.clone(),
            file: path(&photo.file),
            picks: path(&photo.picks),
            date: photo.date,
            focal_px: photo.focal_px,
            picking_px: photo.picking_px.unwrap_or(Photographed::PICKING_PX),
            shadow_error_m: 1e-3 * photo.shadow_error_mm.unwrap_or(Photographed::SHADOW_ERROR_MM),
        });
    }

    fn taken(&mut self, place: String, name: &str, what: &str) {
        let message = format!("\"{}\" is {what} already: choose another name", shorten(name));
        self.error(place, "DUPLICATE", message);
    }

    /// Notes the name of something on a member.
    fn name(&mut self, place: String, member: &str, name: &str) {
        if !self.names.insert((member.to_owned(), name.to_owned())) {
            let message = format!(
                "\"{}\" is there twice on {}: choose another name",
                shorten(name),
                shorten(self.scene.name_of(member))
            );
            self.error(place, "DUPLICATE", message);
        }
    }

    /// Gauges of the scene, of this file and of its tables.
    fn gauges(&self) -> impl Iterator<Item = &Gauge> {
        self.scene.structure.gauges.iter().chain(&self.own.file.gauges).chain(&self.gauges)
    }

    fn known(&self, name: &str) -> Option<&Gauge> {
        self.gauge_of.get(name)
    }

    /// Defines the gauge of a row that says where it is; compares the places where it is known.
    fn seat(&mut self, reading: &Placed<RawReading>) {
        let what = &reading.what;
        // Of a table's member, its own entry has told.
        let (Some(seat), Some(index)) = (what.seat, self.index_of.get(what.member.as_str())) else {
            return;
        };
        let member = &self.scene.members[*index];
        let angle_deg = match seat.face.map(|face| face.angle_deg(member.kind, member.frame)) {
            Some(Ok(angle)) => Some(angle),
            Some(Err(why)) => {
                return self.error(reading.field("face"), "FACE", why.to_string());
            }
            None => seat.angle_deg.map(|angle| angle.rem_euclid(360.0)),
        };
        if let Some(why) = seat.depth_mm.and_then(|mm| too_deep(member, angle_deg, 1e-3 * mm)) {
            return self.error(reading.field("depth_mm"), "DEPTH", why);
        }
        if let Some(known) = self.known(&what.of) {
            // On which member it is, `reading` compares.
            if known.member == what.member
                && let Some(other) = elsewhere(known, seat, angle_deg)
            {
                let remedy = "correct one of them, or give another gauge another name";
                let message = format!("{} is {other}: {remedy}", what.of);
                self.error(reading.field("along"), "OTHER_PLACE", message);
            }
            return;
        }
        if self.scene.meters.iter().any(|m| m.name == what.of) {
            return self.taken(reading.field("gauge"), &what.of, "a meter of the scene");
        }
        let Some(measures) = what.unit.usual() else {
            let message = format!(
                "{} is not known, and a gauge of stress needs its direction: {IN_EVIDENCE}",
                shorten(&what.of)
            );
            return self.error(reading.field("gauge"), "UNKNOWN_GAUGE", message);
        };
        let Some(angle_deg) = angle_deg else {
            let message = format!(
                "{} is not known, and its side neither: say it in a column face or angle_deg",
                shorten(&what.of)
            );
            return self.error(reading.field("gauge"), "NO_SIDE", message);
        };
        let gauge = Gauge {
            name: what.of.clone(),
            member: what.member.clone(),
            along: seat.along,
            angle_deg,
            depth_mm: seat.depth_mm.unwrap_or_default(),
            measures,
        };
        self.gauge_of.insert(gauge.name.clone(), gauge.clone());
        self.gauges.push(gauge);
    }

    /// The gauge of that name; a problem with the remedy for a new one where neither a gauge nor a
    /// meter has it.
    fn gauge(&mut self, place: &str, name: &str, remedy: &str) -> Option<Gauge> {
        let gauge = self.known(name).cloned();
        if gauge.is_none()
            && self.problems.len() < MAX_PROBLEMS
            && !self.scene.meters.iter().any(|m| m.name == name)
        {
            let known: Vec<&str> = self.gauges().map(|g| g.name.as_str()).collect();
            let hint = match nearest(name, &known) {
                Some(known) => format!("did you mean {known}? If not, {remedy}"),
                None => remedy.to_owned(),
            };
            let message = format!("no gauge or meter has the name \"{}\": {hint}", shorten(name));
            self.error(place.to_owned(), "UNKNOWN_GAUGE", message);
        }
        gauge
    }

    fn test(&mut self, place: &str, name: &str) {
        let own = &self.own.file.tests;
        if !self.scene.structure.tests.iter().chain(own).any(|t| t.name == name) {
            let message = format!(
                "no load test has the name \"{}\": add it to `tests` of evidence.ron, or by \
                 `intrados attach … --load-test`",
                shorten(name)
            );
            self.error(place.to_owned(), "UNKNOWN_TEST", message);
        }
    }

    /// Refuses what a gauge on its member does not read; SI.
    fn sound(&mut self, place: String, gauge: &Gauge, value: f64) {
        let percent = (1e6 * value.abs()).round() / 1e4;
        let why = match gauge.measures {
            Measures::Strain(_) if percent > MOST_STRAIN => Some(format!(
                "{value} is a strain of {percent} %, at which nothing is left: it is in m/m, 1e-6 for a millionth"
            )),
            _ => {
                let member = self.index_of.get(gauge.member.as_str());
                let member = member.and_then(|k| self.scene.members.get(*k));
                member.and_then(|member| too_far(member, gauge, value))
            }
        };
        if let Some(why) = why {
            self.error(place, "UNIT", why);
        }
    }

    /// Refuses what another table has said already.
    fn twice(&mut self, reading: &Placed<RawReading>) -> bool {
        let what = &reading.what;
        let key = (what.of.clone(), what.test.clone(), what.date, what.value.to_bits());
        let table = |place: &str| place.rsplit_once(':').map_or("", |(file, _)| file).to_owned();
        let first = self.read.entry(key).or_insert_with(|| reading.place.clone()).clone();
        let is_twice = table(&first) != table(&reading.place);
        if is_twice {
            let message = format!(
                "{} shows what {first} has already, so that it would count twice: leave one of the two tables out",
                shorten(&what.of)
            );
            self.error(reading.field("value"), "DUPLICATE", message);
        }
        is_twice
    }

    fn reading(&mut self, reading: &Placed<RawReading>) {
        let what = &reading.what;
        if let Some(test) = &what.test {
            self.test(&reading.field("test"), test);
        }
        // Why a row with a place did not define its gauge has been told.
        if what.seat.is_some() && self.known(&what.of).is_none() {
            return;
        }
        let place = reading.field("gauge");
        let Some(gauge) = self.gauge(&place, &what.of, IN_COLUMNS) else { return };
        if gauge.member == what.member {
            self.sound(reading.field("value"), &gauge, what.value);
        }
        if gauge.member != what.member {
            let name = |id: &str| self.scene.name_of(id).to_owned();
            let [own, other] = [&gauge.member, &what.member].map(|id| name(id));
            let message = format!("{} is on {own}, not on {other}", gauge.name);
            self.error(place, "OTHER_MEMBER", message);
        } else if !what.unit.fits(&gauge.measures) {
            let right = match gauge.measures {
                Measures::Strain(_) => "strain: give it in ue or m/m",
                Measures::Stress(_) => "stress: give it in MPa",
                Measures::Displacement(_) => "displacement: give it in mm or m",
            };
            let message = format!("{} measures {right}, not in {}", gauge.name, what.unit.name());
            self.error(reading.field("value"), "UNIT", message);
        } else if self.twice(reading) {
            // It has been told.
        } else if let (Some(date), None) = (what.date, &what.test) {
            let sample = Sample {
                date,
                value: what.value,
                std_error: what.std_error,
                temperature_c: what.temperature_c,
            };
            let next = self.series.len();
            let at = *self.series_of.entry(what.of.clone()).or_insert(next);
            match self.series.get_mut(at) {
                Some(series) => series.samples.push(sample),
                None => self.series.push(Series { gauge: what.of.clone(), samples: vec![sample] }),
            }
        } else {
            self.readings.push(Reading {
                of: what.of.clone(),
                test: what.test.clone(),
                value: what.value,
                std_error: what.std_error,
                at_days: 0.0,
            });
        }
    }

    fn record(&mut self, record: &Placed<Record>) {
        let what = &record.what;
        // Of a table's member, its own entry has told.
        let known = self.index_of.get(what.member.as_str()).copied();
        let index = match known {
            None if record.is_row => None,
            _ => self.member(&record.field("member"), &what.member),
        };
        let Some(index) = index else { return };
        let place = if record.is_row { record.place.clone() } else { record.field("name") };
        self.name(place, &what.member, &what.name);
        let spot = match self.spot(index, what) {
            Ok(spot) => spot,
            Err((field, code, message)) => return self.error(record.field(field), code, message),
        };
        let [low, high] = self.scene.members[index].bounds;
        let [x, y, z] = (high - low).as_dvec3().to_array();
        let surface = 2.0 * (x * y + y * z + z * x);
        if let Some((name, area)) = area(&what.shows).filter(|(_, area)| *area > surface) {
            let message = format!(
                "{area} m² are more than the surface of {}, {surface:.1} m²: in m²?",
                called(&self.scene.members[index])
            );
            return self.error(record.field(name), "UNIT", message);
        }
        if let Some(why) = too_long(&self.scene.members[index], &what.shows) {
            return self.error(record.field("shows.length_m"), "UNIT", why);
        }
        if let Some(doubt) = doubt_finding(what).filter(|_| !record.is_row && !what.confirmed) {
            let name = called(&self.scene.members[index]);
            self.warnings.push(format!("{} of {name}: {doubt}", what.name));
        }
        if let Finding::Spall { depth_mm: Some(mm), .. } = what.shows {
            let member = &self.scene.members[index];
            if let Some(why) = too_deep(member, spot.angle_deg, 1e-3 * mm as f32) {
                return self.error(record.field("shows.depth_mm"), "DEPTH", why);
            }
        }
        let shows = self.shows(index, what);
        self.observations.push(Observation {
            member: what.member.clone(),
            name: what.name.clone(),
            date: what.date,
            spot,
            instrument: what.instrument.clone(),
            picture: what.picture.as_ref().and_then(|p| self.own.pictures.get(p)).cloned(),
            shows,
        });
    }

    /// Where on its member it is; or which field does not fit, with a code and a message.
    fn spot(
        &self,
        index: usize,
        record: &Record,
    ) -> Result<Spot, (&'static str, &'static str, String)> {
        let member = &self.scene.members[index];
        let of_face = |face: Face| {
            face.angle_deg(member.kind, member.frame)
                .map_err(|why| ("face", "FACE", why.to_string()))
        };
        let angle_deg = match record.face {
            Some(face) => Some(of_face(face)?),
            None => record.angle_deg.map(|angle| angle.rem_euclid(360.0)),
        };
        let wrong = |message: String| Err(("height_m", "RANGE", message));
        let tall = member.bounds[1].y - member.bounds[0].y;
        if let Some(height) = record.height_m.filter(|h| *h > tall * (1.0 + SAME_PLACE)) {
            let name = called(member);
            return wrong(format!("{height} m is above {name}, which is {tall:.2} m tall"));
        }
        // Of what stands, a height is a place on the axis, too.
        let rise = member.frame.axis.y;
        let by_height = record.height_m.filter(|_| member.frame.is_upright()).map(|height| {
            let y = f64::from(member.bounds[0].y) + f64::from(height);
            let share = (y - f64::from(member.frame.start.y)) / f64::from(rise);
            // No finer than anybody measures: .45 m of 3 m are .15, not .149 999 99.
            ((share.clamp(0.0, 1.0) * 1e6).round() / 1e6) as f32
        });
        let along = match (record.along.map(|Along(ends)| ends), by_height) {
            (Some([from, to]), Some(at)) if at < from - SAME_PLACE || at > to + SAME_PLACE => {
                return wrong(format!(
                    "at that height `along` is {at:.2}, not {from}: give one of the two"
                ));
            }
            (Some(ends), _) => ends,
            (None, Some(at)) => [at; 2],
            (None, None) => [0.0, 1.0],
        };
        Ok(Spot { along, angle_deg, height_m: record.height_m })
    }

    /// What was found, with the usual error where none was given.
    fn shows(&mut self, index: usize, record: &Record) -> Shows {
        match record.shows.clone() {
            Finding::Cover { mm, std_error_mm } => {
                Shows::Cover { mm, std_error_mm: std_error_mm.unwrap_or(usual::cover_mm(mm)) }
            }
            Finding::Rebound { number, std_error } => {
                Shows::Rebound { number, std_error: std_error.unwrap_or(usual::REBOUND) }
            }
            Finding::Velocity { m_s, std_error_m_s } => Shows::Velocity {
                m_s,
                std_error_m_s: std_error_m_s.unwrap_or(usual::velocity_m_s(m_s)),
            },
            Finding::CoreStrength { mpa, std_error_mpa, diameter_mm, length_mm } => {
                let std_error_mpa = std_error_mpa.unwrap_or(usual::core_mpa(mpa));
                Shows::CoreStrength { mpa, std_error_mpa, diameter_mm, length_mm }
            }
            Finding::HalfCell { mv, std_error_mv, electrode } => Shows::HalfCell {
                mv: electrode.to_copper_sulphate(mv),
                std_error_mv: std_error_mv.unwrap_or(usual::HALF_CELL_MV),
                electrode,
            },
            Finding::Chloride {
                depths_mm,
                percent_of_cement,
                percent_of_concrete,
                std_error_percent,
            } => {
                let factor = if percent_of_concrete.is_empty() {
                    1.0
                } else {
                    self.concrete_over_cement(index, &record.name)
                };
                let given = percent_of_cement.into_iter().chain(percent_of_concrete);
                let percent_of_cement: Vec<f64> = given.map(|p| p * factor).collect();
                let mean = percent_of_cement.iter().sum::<f64>() / percent_of_cement.len() as f64;
                let error = std_error_percent.map(|e| e * factor);
                let std_error_percent = error.unwrap_or(usual::chloride_percent(mean));
                Shows::Chloride { depths_mm, percent_of_cement, std_error_percent }
            }
            Finding::Carbonation { mm, std_error_mm } => Shows::Carbonation {
                mm,
                std_error_mm: std_error_mm.unwrap_or(usual::carbonation_mm(mm)),
            },
            Finding::Sounding { hollow_m2, tapped_m2 } => Shows::Sounding { hollow_m2, tapped_m2 },
            Finding::Crack { width_mm, std_error_mm, course, length_m } => {
                let std_error_mm = std_error_mm.unwrap_or(usual::crack_mm(width_mm));
                Shows::Crack { width_mm, std_error_mm, course, length_m }
            }
            Finding::Spall { area_m2, depth_mm, bars_bare } => {
                Shows::Spall { area_m2, depth_mm, bars_bare }
            }
            Finding::Rust { area_m2 } => Shows::Rust { area_m2 },
            Finding::Efflorescence { area_m2 } => Shows::Efflorescence { area_m2 },
            Finding::WetSpot { area_m2 } => Shows::WetSpot { area_m2 },
            Finding::Intact => Shows::Intact { seen: 1.0, limit_mm: usual::FOUND_MM },
        }
    }

    /// Mass of a member's concrete over that of its cement; the usual one, with a warning, where
    /// the scene does not tell.
    fn concrete_over_cement(&mut self, index: usize, name: &str) -> f64 {
        let member = &self.scene.members[index];
        let concrete = self.scene.structure.concrete(&member.concrete);
        let [usual, mass] = USUAL_CEMENT;
        let known = concrete.and_then(|c| Some((c, f64::from(c.hydration?.cement_kg_m3))));
        match known.filter(|(_, cement)| *cement > 0.0) {
            Some((c, cement)) => c.density_kg_m3.map_or(mass, f64::from) / cement,
            None => {
                self.warnings.push(format!(
                    "{name} of {}: chloride as % of concrete is counted with {usual} kg of cement in {mass} kg, since nobody says how much there is; give percent_of_cement, or the concrete's hydration",
                    called(member)
                ));
                mass / usual
            }
        }
    }
}

/// Where a gauge is and where it is said to be, if these are two places.
fn elsewhere(known: &Gauge, seat: Seat, angle_deg: Option<f32>) -> Option<String> {
    let [along, around, below] = SAME_SEAT;
    let turn = |angle: f32| (angle - known.angle_deg + 180.0).rem_euclid(360.0) - 180.0;
    let same = (seat.along - known.along).abs() <= along
        && angle_deg.is_none_or(|angle| turn(angle).abs() <= around)
        && seat.depth_mm.is_none_or(|depth| (depth - known.depth_mm).abs() <= below);
    let at =
        |along: f32, angle: f32, depth: f32| format!("along {along}, {angle}°, {depth} mm deep");
    let angle = angle_deg.unwrap_or(known.angle_deg.rem_euclid(360.0));
    let depth = seat.depth_mm.unwrap_or(known.depth_mm);
    (!same).then(|| {
        format!(
            "at {} already, not at {}",
            at(known.along, known.angle_deg.rem_euclid(360.0), known.depth_mm),
            at(seat.along, angle, depth)
        )
    })
}

/// What of a single finding is odd, and used.
fn doubt_finding(record: &Record) -> Option<String> {
    match &record.shows {
        Finding::Cover { mm, .. } => doubt_covers(&[*mm]),
        Finding::HalfCell { mv, .. } if *mv > 50.0 => Some(format!(
            "{mv} mV is above 0, as steel in dry concrete at most shows: was the sign lost? write -{mv}, or confirm it (confirmed: true, attach --confirmed)"
        )),
        Finding::Chloride { depths_mm, percent_of_cement, percent_of_concrete, .. } => {
            doubt_profile(depths_mm, percent_of_cement, percent_of_concrete)
        }
        _ => None,
    }
}

/// Why a crack is not so long: along its member it is no longer than that, and no crack that runs
/// in another way, or a net of them, is longer than twice the member and twice its girth.
fn too_long(member: &Member, finding: &Finding) -> Option<String> {
    let Finding::Crack { length_m: Some(length), course, .. } = *finding else { return None };
    let size = (member.bounds[1] - member.bounds[0]).as_dvec3();
    let [long, girth] = [size.length(), 2.0 * (size.x + size.y + size.z)];
    let most = if course == Course::Along { long } else { 2.0 * girth };
    (long > 0.0 && length > 1.05 * most).then(|| {
        format!(
            "{length} m is longer than a crack on {} can be, which is {long:.2} m from corner to corner: in m?",
            called(member)
        )
    })
}

/// Strength that concrete and its bars hardly reach, kPa: what is more crushes the whole section.
const CRUSHING_KPA: f64 = 100e3;

/// Why a weight of a load test is doubted: it crushes its member's whole section, counted with its
/// box, at 100 MPa; or it is less than a ten-thousandth of the member's own weight.
fn doubt_weights(member: &Member, test: &Test) -> Option<String> {
    let kn: f64 = test
        .actions
        .iter()
        .map(|action| match action {
            Action::Force { force_kn, .. } => f64::from(force_kn.length()),
            _ => 0.0,
        })
        .sum();
    let mut sides = (member.bounds[1] - member.bounds[0]).as_dvec3().to_array();
    sides.sort_by(f64::total_cmp);
    let [thin, thick, long] = sides;
    let [crushing, weight] = [thin * thick * CRUSHING_KPA, 25.0 * thin * thick * long];
    let remedy = if kn > crushing && crushing > 0.0 {
        format!("more than crushes its section, some {crushing:.0} kN: in N?")
    } else if kn > 0.0 && kn < 1e-4 * weight {
        format!("less than a ten-thousandth of its weight, some {weight:.0} kN: in MN?")
    } else {
        return None;
    };
    Some(format!(
        "load test {} of {}: {kn} kN is {remedy} give it in kN",
        test.name,
        called(member)
    ))
}

/// The largest area that a finding tells, and its field.
fn area(finding: &Finding) -> Option<(&'static str, f64)> {
    match *finding {
        Finding::Sounding { tapped_m2, .. } => Some(("shows.tapped_m2", tapped_m2)),
        Finding::Spall { area_m2, .. }
        | Finding::Rust { area_m2 }
        | Finding::Efflorescence { area_m2 }
        | Finding::WetSpot { area_m2 } => Some(("shows.area_m2", area_m2)),
        _ => None,
    }
}

/// What to say of a word that no member has as its id or name. People know members by their names:
/// ids stand where there is none.
pub(crate) fn no_member(word: &str, members: &[Member]) -> String {
    let called = |m: &'_ Member| if m.name.is_empty() { m.id.clone() } else { m.name.clone() };
    let names: Vec<String> = members.iter().map(called).collect();
    let mut known: Vec<&str> = names.iter().map(String::as_str).collect();
    known.sort_unstable();
    known.dedup();
    let ids: Vec<&str> = members.iter().map(|m| m.id.as_str()).collect();
    let hint = match nearest(word, &known).or_else(|| nearest(word, &ids)) {
        Some(meant) => format!("did you mean \"{}\"?", shorten(meant)),
        None if known.is_empty() => "there is none".into(),
        None => {
            let few: Vec<String> =
                known.iter().take(MEMBERS).map(|n| format!("\"{}\"", shorten(n))).collect();
            let more = match known.len() {
                n if n > MEMBERS => {
                    format!(" and {} more (`intrados info` lists them)", n - MEMBERS)
                }
                _ => String::new(),
            };
            format!("there are {}{more}", few.join(", "))
        }
    };
    format!("no member has the id or name \"{}\": {hint}", shorten(word))
}

/// How many members a message names.
const MEMBERS: usize = 12;

/// How far it is through a member from a side, or from its thickest where nobody says which, m.
fn through(member: &Member, angle_deg: Option<f32>) -> f32 {
    let size = member.bounds[1] - member.bounds[0];
    let along = |way: glam::Vec3| way.abs().dot(size);
    match angle_deg {
        Some(angle) => along(member.frame.radial(angle)),
        None => along(member.frame.zero).max(along(member.frame.ninety())),
    }
}

/// Why something cannot lie so deep in a member.
fn too_deep(member: &Member, angle_deg: Option<f32>, depth_m: f32) -> Option<String> {
    let through = through(member, angle_deg);
    (through > 0.0 && depth_m > through * (1.0 + SAME_PLACE)).then(|| {
        format!(
            "{:.0} mm is deeper than {} is, {:.0} mm: is it in mm?",
            1e3 * depth_m,
            called(member),
            1e3 * through
        )
    })
}

/// A member by its name, or its id where it has none.
fn called(member: &Member) -> &str {
    if member.name.is_empty() { &member.id } else { &member.name }
}

/// Why a member does not move so far.
fn too_far(member: &Member, gauge: &Gauge, value: f64) -> Option<String> {
    let size = (member.bounds[1] - member.bounds[0]).length();
    let is_far = matches!(gauge.measures, Measures::Displacement(_))
        && size > 0.0
        && value.abs() > f64::from(size);
    is_far.then(|| {
        format!(
            "{} m is more than {} is long, {size:.2} m: in mm? give the unit mm",
            value,
            called(member)
        )
    })
}
