//! The form by which evidence is attached to a member: where, when, and what a file does not say
//! itself.

mod fill;

use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;
use egui::{ComboBox, Grid, ScrollArea, TextEdit, Ui};
use intrados_scene::{
    Scene,
    attach::{Attachment, Cut, Face, Finding, Kind, What},
    plugin::CurrentScene,
    structure::{Course, Electrode},
};
use serde::{Deserialize, Serialize};

use crate::{
    Action, Actions, Selection, dialog,
    lang::{fixed, term},
};

/// What is being attached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Sort {
    Finding,
    Slices,
    Stack,
    Table,
}

impl Sort {
    /// What files are by their names; without any, a finding.
    fn of(files: &[PathBuf]) -> Self {
        match files.first() {
            None => Self::Finding,
            Some(file) if What::is_table(file) == Some(true) => Self::Table,
            Some(_) => Self::Slices,
        }
    }
}

/// Findings that can be noted, by what a site's form calls them, and what is measured of them.
const FINDINGS: [(&str, &str); 8] = [
    ("crack", "width, mm"),
    ("spall", "area, m²"),
    ("rust stain", "area, m²"),
    ("efflorescence", "area, m²"),
    ("wet spot", "area, m²"),
    ("cover", "cover, mm"),
    ("carbonation", "depth, mm"),
    ("nothing wrong", ""),
];

/// How a crack runs.
const COURSES: [(&str, Course); 4] = [
    ("along the member", Course::Along),
    ("across it", Course::Across),
    ("diagonally", Course::Diagonal),
    ("as a net", Course::Map),
];

/// What a table's values are; of gauges, the table says it by its columns.
const KINDS: [(&str, Option<Kind>); 6] = [
    ("what the table says", None),
    ("cover", Some(Kind::Cover)),
    ("rebound number", Some(Kind::Rebound)),
    ("pulse velocity", Some(Kind::Velocity)),
    ("half-cell potential", Some(Kind::HalfCell)),
    ("carbonation depth", Some(Kind::Carbonation)),
];

const FACES: [Face; 8] = [
    Face::Front,
    Face::Back,
    Face::Left,
    Face::Right,
    Face::Top,
    Face::Bottom,
    Face::Crown,
    Face::Invert,
];

/// What has been filled in. Numbers are as they were typed.
#[derive(Resource, Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Form {
    pub(crate) is_open: bool,
    /// Id of the member.
    member: String,
    sort: Option<Sort>,
    files: Vec<PathBuf>,
    name: String,
    date: String,
    from: String,
    to: String,
    face: Option<Face>,
    height_m: String,
    instrument: String,
    finding: usize,
    value: String,
    error: String,
    course: usize,
    length_m: String,
    picture: String,
    pixel_mm: String,
    voxel_mm: String,
    depth_mm: String,
    diameter_mm: String,
    unit: String,
    kind: usize,
    test: String,
    /// Whether somebody stands by values that are doubted.
    confirmed: bool,
    /// The path of a file that is to be added.
    path: String,
}

impl Form {
    /// Opens it for a member and what was dropped on the window.
    pub(crate) fn begin(&mut self, member: &str, files: Vec<PathBuf>) {
        let sort = Some(Sort::of(&files));
        *self = Self { is_open: true, member: member.into(), sort, files, ..Self::default() };
    }

    /// Whether anything has been filled in since it was opened.
    pub(crate) fn is_filled(&self) -> bool {
        let opened = Self {
            is_open: self.is_open,
            member: self.member.clone(),
            sort: self.sort,
            ..Self::default()
        };
        *self != opened
    }

    /// Says where on the member it is, as somebody has shown it there.
    pub(crate) fn put_at(&mut self, along: f32, face: Option<Face>) {
        self.from = fixed(along, 3);
        self.to.clear();
        self.face = face.or(self.face);
    }

    /// More files, from a dialog or let go over the window.
    pub(crate) fn add(&mut self, files: Vec<PathBuf>) {
        if self.sort == Some(Sort::Finding) {
            self.sort = Some(Sort::of(&files));
        }
        self.files.extend(files);
    }
}

/// Files that are evidence by their names: tables, slices, or a folder of slices.
pub(crate) fn evidence(path: &Path) -> Option<Vec<PathBuf>> {
    if !path.is_dir() {
        return What::is_table(path).map(|_| vec![path.to_owned()]);
    }
    let entries = std::fs::read_dir(path).ok()?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|file| What::is_table(file) == Some(false));
    files.sort();
    (!files.is_empty()).then_some(files)
}

/// The form, over the window.
pub(crate) fn form(
    InMut(ui): InMut<Ui>,
    mut form: ResMut<Form>,
    scene: Option<Res<CurrentScene>>,
    selection: Res<Selection>,
    mut actions: ResMut<Actions>,
) {
    let Some(scene) = scene else { return };
    let form = form.bypass_change_detection();
    // Who clicks another member while it is open means that one.
    if let Some(member) = selection.0.and_then(|i| scene.0.members.get(i)) {
        form.member.clone_from(&member.id);
    }
    ui.strong(tr!("to {}", scene.0.name_of(&form.member)));
    ui.weak(tr!("A click on the member in the picture, or dragging along it, says where on it."));
    ui.horizontal_wrapped(|ui| {
        for (sort, name) in [
            (Sort::Finding, tr!("A finding")),
            (Sort::Slices, tr!("CT slices")),
            (Sort::Stack, tr!("A CT volume")),
            (Sort::Table, tr!("A table")),
        ] {
            ui.selectable_value(&mut form.sort, Some(sort), name);
        }
    });
    ui.separator();
    // The button stays in sight however many fields there are.
    let most = (ui.ctx().content_rect().height() - 230.0).max(60.0);
    let area = ScrollArea::vertical().max_height(most).min_scrolled_height(most);
    area.show(ui, |ui| fields(ui, form, &mut actions));
    ui.separator();
    send(ui, form, &scene.0, &mut actions);
}

fn fields(ui: &mut Ui, form: &mut Form, actions: &mut Actions) {
    if form.sort != Some(Sort::Finding) {
        files(ui, form, actions);
    }
    Grid::new("form").num_columns(2).spacing([10.0, 5.0]).show(ui, |ui| {
        match form.sort {
            Some(Sort::Finding) => finding(ui, form),
            Some(Sort::Table) => table(ui, form),
            Some(Sort::Slices | Sort::Stack) => cut(ui, form),
            None => {}
        }
        place(ui, form);
    });
}

/// The button, and what keeps it from being pressed.
fn send(ui: &mut Ui, form: &mut Form, scene: &Scene, actions: &mut Actions) {
    let filled = form.attachment();
    let is_model = scene.path.extension().is_some_and(|e| !e.eq_ignore_ascii_case("ron"));
    if is_model {
        ui.horizontal_wrapped(|ui| {
            ui.label(tr!(
                "This is a model alone. Its project, in a folder beside it, holds evidence."
            ));
            if ui.button(tr!("Make its project")).clicked() {
                actions.ask(Action::MakeProject);
            }
        });
    }
    ui.horizontal_wrapped(|ui| {
        let may = filled.is_ok() && scene.path.exists() && !is_model;
        if ui.add_enabled(may, egui::Button::new(tr!("Attach"))).clicked()
            && let Ok(what) = &filled
        {
            actions.ask(Action::Attach(Box::new(what.clone())));
            form.is_open = false;
        }
        if ui.button(tr!("Cancel")).clicked() {
            form.is_open = false;
        }
        if let Err(why) = &filled {
            ui.weak(why);
        } else if !scene.path.exists() {
            ui.weak(tr!(
                "This scene is part of the program: `intrados new` makes one that is yours."
            ));
        }
    });
}

fn files(ui: &mut Ui, form: &mut Form, actions: &mut Actions) {
    for (n, file) in form.files.iter().enumerate().take(4) {
        ui.label(file.display().to_string());
        if n == 3 && form.files.len() > 4 {
            ui.weak(tr!("and {} more", form.files.len() - 4));
        }
    }
    ui.horizontal(|ui| {
        let label = ui.label(tr!("File or folder"));
        let field = TextEdit::singleline(&mut form.path).desired_width(220.0);
        ui.add(field).labelled_by(label.id);
        let path = PathBuf::from(form.path.trim());
        let can = !form.path.trim().is_empty();
        if ui.add_enabled(can, egui::Button::new(tr!("Add"))).clicked() {
            form.files.extend(evidence(&path).unwrap_or_else(|| vec![path]));
            form.path.clear();
        }
        if ui.button(tr!("Browse…")).clicked() {
            actions.ask(Action::ChooseEvidence);
        }
        if !form.files.is_empty() && ui.button(tr!("Clear")).clicked() {
            form.files.clear();
        }
    });
    if let [file] = &form.files[..]
        && dialog::is_photograph(file)
        && ui.link(tr!("It is a photograph: place it first")).clicked()
    {
        actions.ask(Action::Photograph(file.clone()));
        form.is_open = false;
    }
}

/// A field of text with its name.
fn field(ui: &mut Ui, name: &str, text: &mut String, hint: &str) {
    let label = ui.label(name);
    ui.add(TextEdit::singleline(text).hint_text(hint).desired_width(180.0)).labelled_by(label.id);
    ui.end_row();
}

/// One of several, of English names.
fn choice(ui: &mut Ui, name: &str, chosen: &mut usize, names: &[&str]) {
    let label = ui.label(name);
    ComboBox::from_id_salt(name)
        .selected_text(term(names.get(*chosen).copied().unwrap_or_default()))
        .show_ui(ui, |ui| {
            for (n, name) in names.iter().enumerate() {
                ui.selectable_value(chosen, n, term(name));
            }
        })
        .response
        .labelled_by(label.id);
    ui.end_row();
}

fn finding(ui: &mut Ui, form: &mut Form) {
    choice(ui, &tr!("What"), &mut form.finding, &FINDINGS.map(|(name, _)| name));
    let measured = FINDINGS.get(form.finding).map_or("", |f| f.1);
    if !measured.is_empty() {
        field(ui, &term(measured), &mut form.value, "");
    }
    if measured.ends_with("mm") {
        let hint = tr!("usual of the instrument");
        field(ui, &tr!("standard error, mm"), &mut form.error, &hint);
    }
    if form.finding == 0 {
        choice(ui, &tr!("It runs"), &mut form.course, &COURSES.map(|(name, _)| name));
        field(ui, &tr!("length, m"), &mut form.length_m, &tr!("unknown"));
    }
    if form.finding == 1 {
        field(ui, &tr!("depth, mm"), &mut form.depth_mm, &tr!("unknown"));
    }
    field(ui, &tr!("Photograph of it"), &mut form.picture, &tr!("path of a JPEG or PNG"));
}

fn table(ui: &mut Ui, form: &mut Form) {
    choice(ui, &tr!("Its values are"), &mut form.kind, &KINDS.map(|(name, _)| name));
    field(ui, &tr!("Unit"), &mut form.unit, &tr!("as the table says"));
    field(ui, &tr!("Load test"), &mut form.test, &tr!("of gauges"));
}

fn cut(ui: &mut Ui, form: &mut Form) {
    if form.sort == Some(Sort::Slices) {
        field(ui, &tr!("pixel, mm"), &mut form.pixel_mm, &tr!("as the files say"));
    } else {
        let hint = tr!("x, y, z, or as the files say");
        field(ui, &tr!("voxel, mm"), &mut form.voxel_mm, &hint);
    }
    field(ui, &tr!("core's diameter, mm"), &mut form.diameter_mm, &tr!("sawn"));
    field(ui, &tr!("depth below the face, mm"), &mut form.depth_mm, &tr!("unknown"));
}

fn place(ui: &mut Ui, form: &mut Form) {
    let (from, to) = match form.sort {
        Some(Sort::Slices | Sort::Stack) => (tr!("along, 0 to 1"), None),
        _ => (tr!("along from, 0 to 1"), Some(tr!("along to"))),
    };
    field(ui, &from, &mut form.from, &tr!("from the start of its axis"));
    if let Some(to) = to {
        field(ui, &to, &mut form.to, &tr!("the same place"));
    }
    let label = ui.label(tr!("Face"));
    ComboBox::from_id_salt("face")
        .selected_text(form.face.map_or_else(|| tr!("unknown"), |face| term(face.name())))
        .show_ui(ui, |ui| {
            ui.selectable_value(&mut form.face, None, tr!("unknown"));
            for face in FACES {
                ui.selectable_value(&mut form.face, Some(face), term(face.name()));
            }
        })
        .response
        .labelled_by(label.id);
    ui.end_row();
    field(ui, &tr!("Date"), &mut form.date, "2026-05-03");
    if !matches!(form.sort, Some(Sort::Slices | Sort::Stack)) {
        field(ui, &tr!("Instrument"), &mut form.instrument, "");
    }
    if form.sort == Some(Sort::Finding) {
        field(ui, &tr!("height, m"), &mut form.height_m, &tr!("above its lowest point"));
    }
    field(ui, &tr!("Name"), &mut form.name, &tr!("one is made"));
    if matches!(form.sort, Some(Sort::Finding | Sort::Table)) {
        ui.label("");
        ui.checkbox(&mut form.confirmed, tr!("Values that are doubted are right"))
            .on_hover_text(tr!("Such as a potential above 0, or a cover of 3 mm that is no 3 cm"));
        ui.end_row();
    }
}
