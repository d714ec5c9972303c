//! What of a scene's file a form shows and changes: of a member, and of the whole structure.

use glam::Vec3;

use super::{
    amend::Setting,
    tree::Step::{self, Entry, Field as Named, Variant},
};
use crate::{
    Member, Scene,
    file::{self, Assumed, CLASSES, Detail, SceneFile},
    structure::{
        Action, BarEnd, Bars, Body, Date, Exposure, Grade, Lap, Load, Reinforcement, Section,
        SegmentBars,
    },
};

/// A value of the file that a form changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// What it is part of, for people.
    pub group: String,
    /// What it is called there.
    pub name: String,
    /// Its unit; empty: it has none.
    pub unit: &'static str,
    /// What may be written.
    pub kind: FieldKind,
    /// What is written; empty: nothing.
    pub value: String,
    /// What holds where nothing is written, or whom else it concerns.
    pub note: String,
    path: Vec<Step>,
    /// What has to be written before.
    before: Vec<Setting>,
    /// What a number is divided by before it is written: a length along an axis is a share there.
    per: f32,
    /// Where the length of that axis is written, if a form can change it.
    axis: Option<Vec<Step>>,
    /// Whether the whole entry that it is of is taken out where it is left empty.
    of_entry: bool,
}

/// What may be written in a field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FieldKind {
    /// A number.
    Number,
    /// A whole number that counts.
    Whole,
    /// Words.
    Text,
    /// A day.
    Day,
    /// One of these, or other words.
    OneOf(Vec<String>),
    /// One of these names and nothing else.
    Choice(&'static [&'static str]),
}

impl Field {
    /// What is to be written so that this is its value; an empty text takes it out.
    ///
    /// # Errors
    /// It is none of its kind: what to write instead, in a few words.
    pub fn set(&self, text: &str) -> Result<Vec<Setting>, String> {
        self.set_by(text, f64::from(self.per))
    }

    /// What is to be written so that fields have these values all at once: a place on an axis whose
    /// length changes, too, is a share of the new one.
    ///
    /// # Errors
    /// As [`Field::set`].
    pub fn set_all(changes: &[(&Self, &str)]) -> Result<Vec<Setting>, String> {
        let per = |field: &Self| {
            let axis = field.axis.as_ref()?;
            let (_, length) = changes.iter().find(|(other, _)| other.path == *axis)?;
            number(length).filter(|length| *length > 0.0)
        };
        let mut settings = Vec::new();
        for &(field, text) in changes {
            let per = per(field).unwrap_or(f64::from(field.per));
            settings.extend(field.set_by(text, per)?);
        }
        Ok(settings)
    }

    fn set_by(&self, text: &str, per: f64) -> Result<Vec<Setting>, String> {
        let text = text.trim();
        let value = if text.is_empty() { None } else { Some(self.ron(text, per)?) };
        if value.is_none() && matches!(self.path.last(), Some(Entry(_))) {
            return Err(format!("{}: fill it in, 0 for none", self.name));
        }
        let mut settings = if value.is_some() { self.before.clone() } else { Vec::new() };
        let mut path = self.path.clone();
        if value.is_none() && self.of_entry {
            path.pop();
        }
        settings.push(Setting { path, value });
        Ok(settings)
    }

    /// Where it is written.
    pub(super) fn place(&self) -> &[Step] {
        &self.path
    }

    fn ron(&self, text: &str, per: f64) -> Result<String, String> {
        let name = &self.name;
        match self.kind {
            FieldKind::Number => {
                let number = number(text).map(|n| (n / per) as f32);
                let number = number.filter(|n| n.is_finite());
                let number = number.ok_or_else(|| format!("{name}: “{text}” is no number"))?;
                Ok(number.to_string())
            }
            FieldKind::Whole => {
                let number: Result<u32, _> = text.parse();
                let number = number.map_err(|_| format!("{name}: “{text}” is no whole number"))?;
                Ok(number.to_string())
            }
            FieldKind::Day => {
                let day: Date = text.parse().map_err(|why| format!("{name} {why}"))?;
                Ok(format!("\"{day}\""))
            }
            FieldKind::Text | FieldKind::OneOf(_) => quoted(text),
            FieldKind::Choice(names) if names.contains(&text) => Ok(text.to_owned()),
            FieldKind::Choice(names) => {
                Err(format!("{name}: “{text}” is none of {}", names.join(", ")))
            }
        }
    }
}

/// A number as somebody types it, with a point or a comma.
fn number(text: &str) -> Option<f64> {
    text.trim().replace(',', ".").parse().ok()
}

fn quoted(text: &str) -> Result<String, String> {
    ron::to_string(text).map_err(|why| format!("cannot be written as RON: {why}"))
}

/// What can be changed of a member, or of the structure where no member is meant. Nothing of a scene
/// that has no file of ours.
#[must_use]
pub fn fields(scene: &Scene, member: Option<&Member>) -> Vec<Field> {
    let Some(file) = said(scene) else { return Vec::new() };
    let mut list = List { file: &file, fields: Vec::new(), group: String::new() };
    let Some(member) = member else {
        list.structure();
        return list.fields;
    };
    let assembly = scene.structure.assembly_of(&member.id).map(|a| a.id.as_str());
    // A segment's measures are its tunnel's.
    let written = |id: &str| file.members.iter().position(|m| m.id == id);
    match (written(&member.id), assembly.and_then(written)) {
        (Some(index), _) => list.parametric(index),
        (None, Some(tunnel)) => {
            list.detailed(member);
            list.body(
                &[Named("members"), Entry(tunnel), Named("body")],
                &file.members[tunnel].body,
            );
        }
        (None, None) => list.detailed(member),
    }
    list.loads(&member.id, assembly);
    list.fields
}

/// What the file of a scene says; none: it has none of ours.
pub(super) fn said(scene: &Scene) -> Option<SceneFile> {
    file::parse(&scene.name, &scene.written.0).ok()
}

/// How long a member's axis is, m, and where that is written, if a form can change it.
struct Axis {
    length_m: f32,
    written: Option<Vec<Step>>,
}

/// What is being listed.
struct List<'a> {
    file: &'a SceneFile,
    fields: Vec<Field>,
    group: String,
}

/// A place behind another.
fn at(path: &[Step], steps: &[Step]) -> Vec<Step> {
    [path, steps].concat()
}

impl List<'_> {
    fn group(&mut self, name: impl Into<String>) {
        self.group = name.into();
    }

    fn add(
        &mut self,
        name: &str,
        unit: &'static str,
        kind: FieldKind,
        value: String,
        at: Vec<Step>,
    ) {
        let group = self.group.clone();
        let (name, note) = (name.to_owned(), String::new());
        self.fields.push(Field {
            group,
            name,
            unit,
            kind,
            value,
            note,
            path: at,
            before: vec![],
            per: 1.0,
            axis: None,
            of_entry: false,
        });
    }

    fn number(&mut self, name: &str, unit: &'static str, value: Option<f32>, at: Vec<Step>) {
        let text = value.map_or(String::new(), |v| v.to_string());
        self.add(name, unit, FieldKind::Number, text, at);
    }

    fn count(&mut self, name: &str, value: Option<u32>, at: Vec<Step>) {
        let text = value.map_or(String::new(), |v| v.to_string());
        self.add(name, "", FieldKind::Whole, text, at);
    }

    fn note(&mut self, note: impl Into<String>) {
        if let Some(field) = self.fields.last_mut() {
            field.note = note.into();
        }
    }

    /// A place on an axis, which the file has as a share of it.
    fn place(&mut self, name: &str, share: Option<f32>, axis: &Axis, at: Vec<Step>) {
        let millimetres = |share: f32| (1000.0 * share * axis.length_m).round() / 1000.0;
        self.number(name, "m", share.map(millimetres), at);
        if let Some(field) = self.fields.last_mut() {
            (field.per, field.axis) = (axis.length_m, axis.written.clone());
        }
    }

    fn before(&mut self, settings: Vec<Setting>) {
        if let Some(field) = self.fields.last_mut() {
            field.before = settings;
        }
    }

    fn structure(&mut self) {
        let project = &self.file.project;
        self.group("Structure");
        let text = |list: &mut Self, name: &str, field: &'static str, value: &str| {
            let path = vec![Named("project"), Named(field)];
            list.add(name, "", FieldKind::Text, value.to_owned(), path);
        };
        let title = self.file.title.clone();
        self.add("title", "", FieldKind::Text, title, vec![Named("title")]);
        text(self, "owner's name of it", "structure", &project.structure);
        self.note("left out: the title");
        text(self, "place", "place", &project.place);
        text(self, "owner", "owner", &project.owner);
        self.group("Inspection");
        text(self, "inspector", "inspector", &project.inspector);
        let day = project.inspected.map_or(String::new(), |d| d.to_string());
        let path = vec![Named("project"), Named("inspected")];
        self.add("inspected on", "", FieldKind::Day, day, path);
        self.note("left out: the last date of the evidence");
        text(self, "purpose", "purpose", &project.purpose);
        self.group("Air");
        let climate = &self.file.climate;
        let place = |field| vec![Named("climate"), Named(field)];
        self.number("humidity", "%", Some(climate.humidity_percent), place("humidity_percent"));
        self.number("temperature", "°C", Some(climate.temperature_c), place("temperature_c"));
    }

    /// A member that is written down.
    fn parametric(&mut self, index: usize) {
        let file = self.file;
        let member = &file.members[index];
        let path = [Named("members"), Entry(index)];
        self.concrete(&member.id, member.concrete.as_deref(), &path, &[]);
        self.exposure(member.exposure.as_ref(), &path, [&[], &[]]);
        self.body(&at(&path, &[Named("body")]), &member.body);
    }

    /// A member that a model or a tunnel brings: what is said of it stands among the details.
    fn detailed(&mut self, member: &Member) {
        let file = self.file;
        let list = Named("details");
        let own = |has: fn(&Detail) -> bool| {
            let is_own = |d: &Detail| d.member == member.id;
            let said = file.details.iter().rposition(|d| is_own(d) && has(d));
            said.or_else(|| file.details.iter().rposition(is_own)).unwrap_or(file.details.len())
        };
        let before = |index: usize, states: &[Assumed]| {
            let mut before = Vec::new();
            match file.details.get(index) {
                // What somebody states is assumed no more.
                Some(d) if states.iter().any(|s| d.assumed.contains(s)) => {
                    let left = d.assumed.iter().filter(|a| !states.contains(a));
                    let left: Vec<String> = left.map(|a| format!("{a:?}")).collect();
                    let path = vec![list.clone(), Entry(index), Named("assumed")];
                    let value = Some(format!("[{}]", left.join(", ")));
                    before.push(Setting { path, value });
                }
                Some(_) => {}
                None => {
                    let path = vec![list.clone(), Entry(index), Named("member")];
                    before.push(Setting { path, value: quoted(&member.id).ok() });
                }
            }
            before
        };
        let index = own(|d| d.concrete.is_some());
        let said = file.details.get(index).and_then(|d| d.concrete.as_deref());
        let path = [list.clone(), Entry(index)];
        self.concrete(&member.id, said, &path, &before(index, &[Assumed::Concrete]));
        let index = own(|d| d.exposure.is_some());
        let said = file.details.get(index).and_then(|d| d.exposure.as_ref());
        let path = [list.clone(), Entry(index)];
        let kinds = [Assumed::Exposure, Assumed::Age];
        let [class, years] = [&kinds[..1], &kinds[1..]].map(|kind| before(index, kind));
        self.exposure(said, &path, [&class, &years]);
        let index = own(|d| d.reinforcement.is_some());
        let detail = file.details.get(index);
        if let Some(bars) = detail.and_then(|d| d.reinforcement.as_ref()) {
            let from = self.fields.len();
            let path = [list.clone(), Entry(index), Named("reinforcement")];
            let axis = Axis { length_m: member.frame.axis.length(), written: None };
            self.reinforcement(Some(bars), &axis, &path);
            let states = before(index, &[Assumed::Reinforcement]);
            let own = self.fields.iter_mut().skip(from);
            own.for_each(|f| f.before = [&states[..], &f.before[..]].concat());
        }
        let index = own(|d| d.body.is_some());
        if let Some(body) = file.details.get(index).and_then(|d| d.body.as_ref()) {
            self.body(&[list, Entry(index), Named("body")], body);
        }
    }

    fn concrete(&mut self, id: &str, said: Option<&str>, path: &[Step], before: &[Setting]) {
        let file = self.file;
        self.group("Concrete");
        let own = file.concretes.iter().position(|c| Some(c.name.as_str()) == said);
        let names = CLASSES.iter().map(|c| (*c).to_owned());
        let names = names.chain(file.concretes.iter().map(|c| c.name.clone())).collect();
        let value = said.unwrap_or_default().to_owned();
        let place = at(path, &[Named("concrete")]);
        self.add("concrete class", "", FieldKind::OneOf(names), value, place.clone());
        self.before(before.to_vec());
        self.note(if before.iter().any(|s| s.path.last() == Some(&Named("assumed"))) {
            "assumed: nobody has stated it"
        } else {
            "left out: C30/37 is assumed"
        });
        let Some(index) = own else {
            let index = file.concretes.len();
            let name = quoted(&format!("concrete of {id}")).ok();
            let list = |field| vec![Named("concretes"), Entry(index), Named(field)];
            self.number("strength of its own, f_ck", "MPa", None, list("fck_mpa"));
            self.note("instead of a class");
            let named = Setting { path: list("name"), value: name.clone() };
            let taken = Setting { path: place, value: name };
            self.before([before, &[named, taken]].concat());
            return;
        };
        let c = &file.concretes[index];
        let list = |field| vec![Named("concretes"), Entry(index), Named(field)];
        for (name, unit, value, field) in [
            ("strength f_ck", "MPa", Some(c.fck_mpa), "fck_mpa"),
            ("mean strength f_cm", "MPa", c.fcm_mpa, "fcm_mpa"),
            ("tensile strength f_ctm", "MPa", c.fctm_mpa, "fctm_mpa"),
            ("modulus E_cm", "GPa", c.ecm_gpa, "ecm_gpa"),
        ] {
            self.number(name, unit, value, list(field));
            self.note(format!("of all that is of “{}”", c.name));
        }
    }

    fn exposure(&mut self, said: Option<&Exposure>, path: &[Step], before: [&[Setting]; 2]) {
        self.group("Exposure");
        let place = |field| at(path, &[Named("exposure"), Named(field)]);
        let classes = Exposure::CLASSES.map(str::to_owned).to_vec();
        let class = said.map_or(String::new(), |e| e.class.clone());
        self.add("exposure class", "", FieldKind::OneOf(classes), class, place("class"));
        self.note("of EN 206; several with commas between");
        self.before(before[0].to_vec());
        self.number("exposed for", "years", said.map(|e| e.years), place("years"));
        self.before(before[1].to_vec());
    }

    fn body(&mut self, path: &[Step], body: &Body) {
        self.group("Size");
        let place = |steps: &[Step]| at(path, steps);
        match body {
            Body::Column { section, height_m, reinforcement } => {
                self.section(path, section);
                let axis = self.axis("height", *height_m, place(&[Named("height_m")]));
                let at = place(&[Named("reinforcement")]);
                self.reinforcement(reinforcement.as_ref(), &axis, &at);
            }
            Body::Beam { section, length_m, reinforcement, .. } => {
                self.section(path, section);
                let axis = self.axis("length", *length_m, place(&[Named("length_m")]));
                let at = place(&[Named("reinforcement")]);
                self.reinforcement(reinforcement.as_ref(), &axis, &at);
            }
            Body::BoxGirder { section: s, length_m, reinforcement, .. } => {
                for (name, value, field) in [
                    ("width at the top", s.top_width_m, "top_width_m"),
                    ("width at the bottom", s.bottom_width_m, "bottom_width_m"),
                    ("depth", s.depth_m, "depth_m"),
                    ("thickness of the top slab", s.top_m, "top_m"),
                    ("thickness of the bottom slab", s.bottom_m, "bottom_m"),
                    ("thickness of a web", s.web_m, "web_m"),
                ] {
                    let at = place(&[Named("section"), Named(field)]);
                    self.number(name, "m", Some(value), at);
                }
                let axis = self.axis("length", *length_m, place(&[Named("length_m")]));
                let at = place(&[Named("reinforcement")]);
                self.reinforcement(reinforcement.as_ref(), &axis, &at);
            }
            Body::Tunnel { radius_m, length_m, segments, inner_lining, ground, .. } => {
                self.group("Size of the tunnel");
                self.number("radius inside", "m", Some(*radius_m), place(&[Named("radius_m")]));
                self.number("length", "m", Some(*length_m), place(&[Named("length_m")]));
                if let Some(s) = segments {
                    let at = |field| place(&[Named("segments"), Named(field)]);
                    self.count("segments in a ring", Some(s.count), at("count"));
                    self.number("length of a ring", "m", Some(s.ring_m), at("ring_m"));
                    let thickness = Some(s.thickness_m);
                    self.number("thickness of segments", "m", thickness, at("thickness_m"));
                    self.segment_bars(s.reinforcement.as_deref(), path);
                }
                if let Some(lining) = inner_lining {
                    let at = |field| place(&[Named("inner_lining"), Named(field)]);
                    let thickness = Some(lining.thickness_m);
                    self.number("thickness of the lining", "m", thickness, at("thickness_m"));
                    self.number("its cover", "mm", Some(lining.cover_mm), at("cover_mm"));
                }
                if let Some(ground) = ground {
                    let at = |field| place(&[Named("ground"), Named(field)]);
                    self.number("ground above its axis", "m", Some(ground.cover_m), at("cover_m"));
                    let weight = Some(ground.weight_kn_m3);
                    self.number("weight of the ground", "kN/m³", weight, at("weight_kn_m3"));
                }
            }
        }
    }

    /// Cover (mm) and grade of bars, whose fields are at `place`.
    fn covered(&mut self, said: Option<(f32, &str)>, place: impl Fn(&[Step]) -> Vec<Step>) {
        self.number("cover", "mm", said.map(|s| s.0), place(&[Named("cover_mm")]));
        let grades = Grade::names().split(", ").map(str::to_owned).collect();
        let grade = said.map_or(String::new(), |s| s.1.to_owned());
        self.add("steel", "", FieldKind::OneOf(grades), grade, place(&[Named("steel")]));
    }

    fn segment_bars(&mut self, said: Option<&SegmentBars>, path: &[Step]) {
        self.group("Bars of segments");
        let place = |steps: &[Step]| {
            at(path, &[&[Named("segments"), Named("reinforcement")], steps].concat())
        };
        self.covered(said.map(|r| (r.cover_mm, r.steel.as_str())), place);
        self.note("left out: B500B");
        let hoops = said.and_then(|r| r.hoops.as_ref());
        let of_hoops = |field| place(&[Named("hoops"), Named(field)]);
        self.number(
            "diameter of hoops",
            "mm",
            hoops.map(|h| h.diameter_mm),
            of_hoops("diameter_mm"),
        );
        self.number("hoops every", "mm", hoops.map(|h| h.spacing_mm), of_hoops("spacing_mm"));
        let bars = said.and_then(|r| r.bars.as_ref());
        let of_bars = |field| place(&[Named("bars"), Named(field)]);
        self.count("bars along the axis at a face", bars.map(|b| b.count), of_bars("count"));
        self.number("their diameter", "mm", bars.map(|b| b.diameter_mm), of_bars("diameter_mm"));
        self.note("what hoops are, and what bars are, goes together");
    }

    /// The length of a member's axis, m.
    fn axis(&mut self, name: &str, length_m: f32, at: Vec<Step>) -> Axis {
        self.number(name, "m", Some(length_m), at.clone());
        Axis { length_m, written: Some(at) }
    }

    fn section(&mut self, path: &[Step], section: &Section) {
        let place = |field| at(path, &[Named("section"), Named(field)]);
        match section {
            Section::Rectangle { width_m, depth_m } => {
                self.number("width", "m", Some(*width_m), place("width_m"));
                self.number("depth", "m", Some(*depth_m), place("depth_m"));
            }
            Section::Round { diameter_m } => {
                self.number("diameter", "m", Some(*diameter_m), place("diameter_m"));
            }
        }
    }

    fn reinforcement(&mut self, said: Option<&Reinforcement>, axis: &Axis, path: &[Step]) {
        self.group("Bars");
        let place = |steps: &[Step]| at(path, steps);
        self.covered(said.map(|r| (r.cover_mm, r.steel.as_str())), place);
        let Some(said) = said else {
            self.note("left out: B500B");
            let bars = |field| place(&[Named("bars"), Entry(0), Variant("Around"), Named(field)]);
            self.count("bars around the section", None, bars("count"));
            self.number("their diameter", "mm", None, bars("diameter_mm"));
            self.note("cover, number and diameter go together");
            return;
        };
        self.number("yield stress", "MPa", said.f_y_mpa, place(&[Named("f_y_mpa")]));
        self.note("left out: the grade's");
        let stirrups = said.stirrups.as_ref();
        let of_stirrups = |field| place(&[Named("stirrups"), Named(field)]);
        let diameter = stirrups.map(|s| s.diameter_mm);
        self.number("diameter of stirrups", "mm", diameter, of_stirrups("diameter_mm"));
        let spacing = stirrups.map(|s| s.spacing_mm);
        self.number("stirrups every", "mm", spacing, of_stirrups("spacing_mm"));
        for (number, bars) in said.bars.iter().enumerate() {
            let what = match bars {
                Bars::Around { .. } => "Bars around".to_owned(),
                Bars::Row { side_deg, .. } => format!("Bars at {side_deg}°"),
            };
            let is_one = said.bars.len() == 1;
            let layer = if is_one { String::new() } else { format!(", layer {}", number + 1) };
            self.group(what + &layer);
            self.bars(bars, axis, &place(&[Named("bars"), Entry(number)]));
        }
    }

    /// A set of bars, from place to place along its member.
    fn bars(&mut self, bars: &Bars, axis: &Axis, path: &[Step]) {
        const ENDS: &[&str] = &["Anchored", "Hooked", "Straight"];
        let place = |field| at(path, &[Named(field)]);
        let (count, diameter) = bars.size();
        self.count("number of bars", Some(count), place("count"));
        self.number("diameter of a bar", "mm", Some(diameter), place("diameter_mm"));
        let [from, to] = bars.span();
        self.place("begin at", Some(from), axis, place("from"));
        self.note("along the axis; left out: at its start");
        self.place("end at", Some(to), axis, place("to"));
        self.note("along the axis; left out: at its end");
        let ends = bars.ends();
        // Both stand in one pair of brackets.
        let unsaid = ends == [BarEnd::default(); 2];
        let both = Some(format!("({:?}, {:?})", ends[0], ends[1]));
        let before = Setting { path: place("ends"), value: both };
        for (k, name) in ["first end", "last end"].into_iter().enumerate() {
            let at = at(path, &[Named("ends"), Entry(k)]);
            self.add(name, "", FieldKind::Choice(ENDS), format!("{:?}", ends[k]), at);
            self.note("counts where bars slip");
            self.before(if unsaid { vec![before.clone()] } else { Vec::new() });
        }
        self.laps(bars.laps(), axis, path);
    }

    /// Laps, and room for one more.
    fn laps(&mut self, laps: &[Lap], axis: &Axis, path: &[Step]) {
        for (k, lap) in laps.iter().map(Some).chain([None]).enumerate() {
            let place = |field| at(path, &[Named("laps"), Entry(k), Named(field)]);
            let note = match lap {
                Some(_) => "along the axis; left out: no lap",
                None => "one more: place and length go together",
            };
            let from = self.fields.len();
            let name = format!("middle of lap {}", k + 1);
            self.place(&name, lap.map(|lap| lap.at), axis, place("at"));
            let name = format!("length of lap {}", k + 1);
            self.number(&name, "mm", lap.map(|lap| lap.length_mm), place("length_mm"));
            for field in self.fields.iter_mut().skip(from) {
                (field.note, field.of_entry) = (note.to_owned(), true);
            }
        }
    }

    fn loads(&mut self, id: &str, assembly: Option<&str>) {
        let file = self.file;
        let is_own = |m: &String| m == id || Some(m.as_str()) == assembly;
        for (index, load) in file.loads.iter().enumerate() {
            if load.members.is_empty() || load.members.iter().any(is_own) {
                self.load(index, load);
            }
        }
    }

    fn load(&mut self, index: usize, load: &Load) {
        let whom = match &load.members[..] {
            [] => "acts on all members".to_owned(),
            [_] => String::new(),
            several => format!("acts on {}", several.join(", ")),
        };
        self.group(format!("Load “{}”", load.name));
        let place = |field| vec![Named("loads"), Entry(index), Named("action"), Named(field)];
        let from = self.fields.len();
        match &load.action {
            Action::SelfWeight => {}
            Action::Force { force_kn, .. } => {
                self.vector("force", "kN", *force_kn, &place("force_kn"));
            }
            Action::Line { force_kn_m, .. } => {
                self.vector("force", "kN/m", *force_kn_m, &place("force_kn_m"));
            }
            Action::Pressure { pressure_kpa, .. } | Action::InnerPressure { pressure_kpa } => {
                self.number("pressure", "kPa", Some(*pressure_kpa), place("pressure_kpa"));
            }
            Action::Displacement { displacement_mm, .. } => {
                let path = place("displacement_mm");
                self.vector("displacement", "mm", *displacement_mm, &path);
            }
            Action::Air { inside_k, outside_k } => {
                self.number("air inside warmer by", "K", Some(*inside_k), place("inside_k"));
                self.number("air outside warmer by", "K", Some(*outside_k), place("outside_k"));
            }
            Action::Temperature { uniform_k, difference_k } => {
                self.number("warmer by", "K", Some(*uniform_k), place("uniform_k"));
                let difference = Some(*difference_k);
                self.number("one side more by", "K", difference, place("difference_k"));
            }
            Action::PipeTemperature { warmer_k } => {
                self.number("pipe warmer by", "K", Some(*warmer_k), place("warmer_k"));
            }
        }
        self.fields.iter_mut().skip(from).for_each(|f| f.note.clone_from(&whom));
    }

    fn vector(&mut self, name: &str, unit: &'static str, value: Vec3, path: &[Step]) {
        for (k, axis) in ["x", "y, upwards", "z"].into_iter().enumerate() {
            let place = at(path, &[Entry(k)]);
            self.number(&format!("{name} {axis}"), unit, Some(value[k]), place);
        }
    }
}
