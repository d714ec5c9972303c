//! What a user can ask for.

use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;
use intrados_light::{RenderSettings, View};
use intrados_predict::Progress;
use intrados_scene::{
    attach::{Attachment, Face, Setting},
    plugin::{CurrentScene, OpenAsProject, OpenScene},
};

use crate::{
    Aspect, Banners, Colours, Jump, Language, Lengths, Log, Look, Quantity, Refine, Selection,
    Viewpoint, Workspace,
    attach::Form,
    border,
    command::Palette,
    create::Creation,
    ct::Ct,
    dialog::{Dialogs, Purpose, Whose},
    edits::{self, Edit},
    export::Export,
    history::History,
    layout::Layout,
    light_line::LightLine,
    machine::MachineSetup,
    photos::Photos,
    play,
    recent::Recent,
    reference::{self, Reference},
    report::Report,
    saving::{Saving, Taken},
    structure::{self, Structure},
    trail,
    views::{self, Views},
    workspace::{self, Desk},
};

/// Something that a user can ask for by a button, a menu, or a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Choose a file to open.
    Choose,
    /// Make a new structure from a template.
    New,
    /// Open a file, or a bundled scene by its name.
    Open(PathBuf),
    /// Make a project of the model that is open, in a folder beside it, and open that: only a
    /// project has a place for evidence.
    MakeProject,
    /// The same of a model whose unit is doubted, with so many metres a unit.
    Rescale(f64),
    /// Open what is open once more: in a world built anew where a [`Window`](crate::Window) holds
    /// it.
    Reload,
    /// Take a file off the list of recent ones.
    Forget(PathBuf),
    /// Go to the start screen, or back from it.
    StartScreen(bool),
    /// Pause or continue the picture.
    Pause,
    /// Go on with a prediction that was cancelled.
    Predict,
    /// Begin the picture anew.
    Restart,
    /// Move the camera so that the selected member, or else everything, fits the picture.
    Frame,
    /// The scene's own camera.
    Home,
    /// Another camera of the scene, by its place in the list; the structure is looked at from
    /// there, too.
    Camera(usize),
    /// Look from a view that is kept of the scene, by its place in the list.
    View(usize),
    /// Keep where the picture that is in sight looks from, by a name or the next number.
    KeepView(String),
    /// Keep it no longer.
    ForgetView(usize),
    /// Show or hide the list of views.
    Views,
    /// Fly along the selected member; of a flight, halt it or let it go on.
    Fly,
    /// Look at another side.
    Show(View),
    /// Light or its error.
    ShowQuantity(Quantity),
    /// Keep the picture of light, to hold later ones against it.
    KeepReference,
    /// Keep it no longer.
    LetReferenceGo,
    /// Look at the structure from a side.
    LookFrom(Aspect),
    /// Hide the legend of the structure's picture, or show it.
    Legend,
    /// Show the next slice in the CT tab, or the one before.
    StepSlice(bool),
    /// Select a member, or nothing.
    Select(Option<usize>),
    /// Select the next member of the list, or the one before.
    Step(bool),
    /// Go to another equilibrium of the lives of the members.
    Jump(Jump),
    /// Go through them by itself, or stop.
    Play,
    /// Go back to the member, the view and the tabs of before.
    Back,
    /// Go forward again.
    Forward,
    /// Bring a panel to the front, by its name; it is opened where it was closed.
    Tab(&'static str),
    /// Show the picture of light, in the expert's layout; which layout structures open in stays.
    Light,
    /// Open a panel, or close it.
    Panel(String, bool),
    /// Go to a layout.
    Arrange(Workspace),
    /// Go to the other layout.
    SwapWorkspace,
    /// Lay the panels out as at first.
    ResetLayout,
    /// Light, dark, or as the system has it.
    Theme(egui::ThemePreference),
    /// Speak a language.
    Speak(Language),
    /// Write lengths in this unit.
    Lengths(Lengths),
    /// Show numbers in these colours.
    Colours(Colours),
    /// See pictures that are compared from one place and equally enlarged, or each by itself.
    Link,
    /// Fill the screen, or no more.
    Fullscreen,
    /// Close the window.
    Quit,
    /// Show a slice of the selected member, by its place among those of the scene, in the CT tab.
    Slice(usize),
    /// Look at a photograph in the Photos tab.
    Photograph(PathBuf),
    /// Choose a photograph in a dialog.
    ChoosePhotograph,
    /// Look at a prediction that was written beside the newest.
    Compare(PathBuf),
    /// Choose that prediction in a dialog.
    ChoosePrediction,
    /// Fill in what is attached to the selected member, with files that were given already, and
    /// where it is: a share of its axis, and a face.
    Fill(Vec<PathBuf>, Option<(f32, Option<Face>)>),
    /// Choose files for that form in a dialog.
    ChooseEvidence,
    /// Attach evidence, as `intrados attach` does.
    Attach(Box<Attachment>),
    /// Detach evidence, as `intrados detach` does: from the member of this id what has this name.
    Detach(String, String),
    /// Write values that a form has changed into the scene's file; how people call that.
    Amend(Vec<Setting>, String),
    /// Take the last change of the evidence or of the scene back.
    Undo,
    /// Make the last change that was taken back again.
    Redo,
    /// Ask for a file name to export to.
    Export,
    /// Choose that file name in a dialog.
    ChooseExport,
    /// Ask where to save something.
    Save(Taken),
    /// Choose that place in a dialog.
    ChooseSave,
    /// Choose in a dialog the folder that the Report tab writes.
    ChooseReportFolder,
    /// Choose in a dialog where the folder of a new structure is made.
    ChooseStructureFolder,
    /// Write the window as it is seen, or one panel of it, as PNG.
    TakePicture(PathBuf, Option<String>),
    /// Write all pictures that can be made of the scene into a folder, as PNG.
    TakeViews(PathBuf),
    /// Put the window as it is seen on the clipboard, or one panel of it.
    CopyPicture(Option<String>),
    /// Show or hide the list of keys.
    Keys,
    /// Show or hide the list of all commands.
    Palette,
    /// Put away whatever is on top: a sheet, a banner, the selection.
    Dismiss,
}

/// Actions that wait for the next frame.
#[derive(Resource, Debug, Default)]
pub struct Actions(Vec<Action>);

impl Actions {
    /// Asks for `action`.
    pub fn ask(&mut self, action: Action) {
        self.0.push(action);
    }

    /// Whether `action` waits.
    #[must_use]
    pub(crate) fn has(&self, action: &Action) -> bool {
        self.0.contains(action)
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Carries out what was asked for.
pub(crate) fn act(world: &mut World) {
    // What is said before the first frame is drawn is said in it, too.
    workspace::speak(world);
    for action in std::mem::take(&mut world.resource_mut::<Actions>().0) {
        let travels = matches!(action, Action::Back | Action::Forward);
        let stop = trail::here(world).filter(|_| !travels);
        carry_out(world, action);
        stop.into_iter().for_each(|stop| trail::leave(world, stop));
    }
}

fn carry_out(world: &mut World, action: Action) {
    match action {
        Action::Choose => Dialogs::open(world, Purpose::Open),
        Action::New => {
            let documents = world.resource::<MachineSetup>().documents.clone();
            world.resource_mut::<Creation>().begin(documents.unwrap_or_default());
        }
        Action::ChooseExport => {
            let name = world.resource::<Export>().to.path.clone();
            Dialogs::open(world, Purpose::Save(name));
        }
        Action::Save(what) => {
            let scene = world.get_resource::<CurrentScene>().map(|s| s.0.name.clone());
            if let Some(scene) = scene {
                world.resource_mut::<Saving>().ask(what, &scene);
            }
        }
        Action::ChooseSave => {
            let saving = world.resource::<Saving>();
            let proposal = saving.proposal();
            let purpose = match saving.is_folder() {
                true => Purpose::Folder(Whose::Sheet, proposal),
                false => Purpose::Take(proposal),
            };
            Dialogs::open(world, purpose);
        }
        Action::ChooseReportFolder => {
            let proposal = world.resource::<Report>().proposal();
            Dialogs::open(world, Purpose::Folder(Whose::Report, proposal));
        }
        Action::ChooseStructureFolder => {
            let proposal = world.resource::<Creation>().proposal();
            Dialogs::open(world, Purpose::Folder(Whose::Structure, proposal));
        }
        Action::TakePicture(path, panel) => take_picture(world, Some(path), panel),
        Action::TakeViews(folder) => world.resource_mut::<Saving>().take_views(folder),
        Action::CopyPicture(panel) => take_picture(world, None, panel),
        Action::Open(path) => open(world, path),
        Action::MakeProject => make_project(world, None),
        Action::Rescale(metres) => make_project(world, Some(metres)),
        Action::Reload => {
            if let Some(path) = world.resource::<Layout>().asked.clone() {
                open(world, path);
            }
        }
        Action::Forget(path) => world.resource_mut::<Recent>().forget(&path),
        Action::StartScreen(on) => world.resource_mut::<Layout>().start = on,
        Action::Pause => {
            let mut refine = world.resource_mut::<Refine>();
            refine.paused = !refine.paused;
        }
        Action::Predict => {
            if let Some(mut progress) = world.get_resource_mut::<Progress>() {
                progress.resume();
            }
        }
        Action::Restart => {
            world.resource_mut::<Refine>().paused = false;
            // The same seed: the same picture, from its first pass.
            world.resource_mut::<RenderSettings>().set_changed();
        }
        Action::Home => {
            world.resource_mut::<Structure>().look(structure::View::Home);
            let home = world.resource::<Viewpoint>().home.clone();
            if let Some(home) = home {
                world.resource_mut::<Viewpoint>().go(home);
            }
        }
        Action::Camera(index) => views::go_to_camera(world, index),
        Action::View(index) => views::go(world, index),
        Action::KeepView(name) => views::keep(world, &name),
        Action::ForgetView(index) => views::forget(world, index),
        Action::Views => {
            let mut views = world.resource_mut::<Views>();
            views.is_open = !views.is_open;
        }
        Action::Frame => frame(world),
        Action::LookFrom(aspect) => {
            world.resource_mut::<Structure>().look_from(aspect);
            show_tab(world, "Structure");
        }
        Action::Legend => world.resource_mut::<Structure>().swap_legend(),
        Action::Fly => fly(world),
        Action::Show(view) => world.resource_mut::<Look>().view = view,
        Action::ShowQuantity(quantity) => world.resource_mut::<Look>().quantity = quantity,
        Action::KeepReference => reference::keep(world),
        Action::LetReferenceGo => *world.resource_mut::<Reference>() = Reference::default(),
        Action::Select(member) => {
            world.resource_mut::<Selection>().set_if_neq(Selection(member));
        }
        Action::Step(forward) => step(world, forward),
        Action::Jump(to) => play::jump(world, to),
        Action::Play => play::toggle(world),
        Action::Back => trail::go(world, false),
        Action::Forward => trail::go(world, true),
        Action::Tab(name) => show_tab(world, name),
        Action::Light => world.resource_mut::<Desk>().light(),
        Action::Panel(name, true) => show_tab(world, &name),
        Action::Panel(name, false) => world.resource_mut::<Desk>().close(&name),
        Action::Arrange(workspace) => world.resource_mut::<Desk>().choose(workspace),
        Action::SwapWorkspace => {
            let mut desk = world.resource_mut::<Desk>();
            let other = desk.shown().other();
            desk.choose(other);
        }
        Action::ResetLayout => world.resource_mut::<Desk>().reset(),
        Action::Theme(theme) => world.resource_mut::<Desk>().dress(theme),
        Action::Speak(language) => world.resource_mut::<Desk>().speak(language),
        Action::Lengths(lengths) => world.resource_mut::<Desk>().measure_in(lengths),
        Action::Colours(colours) => world.resource_mut::<Look>().colours = colours,
        Action::Link => world.resource_mut::<Desk>().swap_links(),
        Action::Fullscreen => world.resource_mut::<Layout>().toggle_fullscreen(),
        Action::Quit => world.resource_mut::<Layout>().quits = true,
        Action::Slice(index) => {
            world.resource_mut::<Ct>().show(index);
            show_tab(world, "CT");
        }
        Action::StepSlice(forward) => {
            // What is not in sight yet is not passed over.
            if world.resource::<Desk>().has_drawn("CT") {
                world.resource_mut::<Ct>().step(forward);
            }
            show_tab(world, "CT");
        }
        Action::Photograph(path) => {
            world.resource_mut::<Photos>().show(path);
            show_tab(world, "Photos");
        }
        Action::ChoosePhotograph => Dialogs::open(world, Purpose::Photograph),
        Action::ChooseEvidence => Dialogs::open(world, Purpose::Evidence),
        Action::Compare(path) => compare(world, &path),
        Action::ChoosePrediction => Dialogs::open(world, Purpose::Prediction),
        Action::Fill(files, place) => fill(world, files, place),
        Action::Attach(what) => edits::begin(world, Edit::Attach(what)),
        Action::Detach(member, name) => edits::begin(world, Edit::Detach { member, name }),
        Action::Amend(settings, what) => edits::begin(world, Edit::Amend(settings, what)),
        Action::Undo => edits::begin(world, Edit::Undo),
        Action::Redo => edits::begin(world, Edit::Redo),
        Action::Export => {
            let name =
                world.get_resource::<CurrentScene>().map(|s| s.0.name.clone()).unwrap_or_default();
            world.resource_mut::<Export>().toggle(&name);
        }
        Action::Keys => {
            let mut layout = world.resource_mut::<Layout>();
            layout.keys = !layout.keys;
        }
        Action::Palette => world.resource_mut::<Palette>().toggle(),
        Action::Dismiss => dismiss(world),
    }
}

/// Of the window, or of a panel that is in sight.
fn take_picture(world: &mut World, path: Option<PathBuf>, panel: Option<String>) {
    let of = panel.map(|panel| world.resource::<Desk>().place(&panel));
    match of {
        Some(None) => world
            .resource_mut::<Banners>()
            .cannot(&tr!("No picture"), &tr!("this panel is not in sight: bring it to the front")),
        of => world.resource_mut::<Saving>().take_picture(path, of.flatten()),
    }
}

/// Opens the form of evidence for the selected member.
fn fill(world: &mut World, files: Vec<PathBuf>, place: Option<(f32, Option<Face>)>) {
    let selected = world.resource::<Selection>().0;
    let scene = world.get_resource::<CurrentScene>().map(|s| s.0.clone());
    let member = scene.as_ref().and_then(|s| s.members.get(selected?));
    match member {
        Some(member) => {
            let mut form = world.resource_mut::<Form>();
            form.begin(&member.id, files);
            if let Some((along, face)) = place {
                form.put_at(along, face);
            }
        }
        None => world.resource_mut::<Banners>().cannot(
            &tr!("Attached to which member?"),
            &tr!("select one first, in the picture or in the list"),
        ),
    }
}

/// Flies along the selected member; halts a flight, or lets it go on.
fn fly(world: &mut World) {
    let is_flying = world.resource::<Structure>().is_flying();
    if !is_flying && world.resource::<Selection>().0.is_none() {
        world.resource_mut::<Banners>().cannot(
            &tr!("A flight along which member?"),
            &tr!("select one first, in the picture or in the list"),
        );
        return;
    }
    show_tab(world, "Structure");
    world.resource_mut::<Structure>().fly_or_halt();
}

/// Opens an earlier prediction of the structure that is open.
fn compare(world: &mut World, path: &Path) {
    let Some(scene) = world.get_resource::<CurrentScene>().map(|s| s.0.clone()) else { return };
    let opened = world.resource_mut::<History>().open(path, &scene);
    match opened {
        Ok(()) => show_tab(world, "Structure"),
        Err(why) => {
            let title = tr!("No prediction to compare with");
            world.resource_mut::<Banners>().cannot(&title, &why);
        }
    }
}

/// Selects the next member, or the one before; around at the ends.
fn step(world: &mut World, forward: bool) {
    let count = world.get_resource::<CurrentScene>().map_or(0, |s| s.0.members.len());
    if count == 0 {
        return;
    }
    let next = match (world.resource::<Selection>().0, forward) {
        (Some(i), true) => (i + 1) % count,
        (Some(i), false) => (i + count - 1) % count,
        (None, true) => 0,
        (None, false) => count - 1,
    };
    world.resource_mut::<Selection>().set_if_neq(Selection(Some(next)));
}

fn open(world: &mut World, path: PathBuf) {
    world.resource_mut::<Banners>().clear();
    world.resource_mut::<Log>().say(tr!("opening {}|log", path.display()));
    world.resource_mut::<Layout>().asked = Some(path.clone());
    world.write_message(OpenScene(path));
}

/// Makes a project of the model that is open, with so many metres a unit, and opens that.
fn make_project(world: &mut World, metres: Option<f64>) {
    if let Some(model) = world.get_resource::<CurrentScene>().map(|s| s.0.path.clone()) {
        world.write_message(OpenAsProject { model, metres });
    }
}

fn show_tab(world: &mut World, name: &str) {
    world.resource_mut::<Desk>().open(name);
}

fn frame(world: &mut World) {
    world.resource_mut::<Structure>().look(structure::View::Framed);
    let Some(scene) = world.get_resource::<CurrentScene>().map(|s| s.0.clone()) else { return };
    let selected = world.resource::<Selection>().0.and_then(|i| scene.members.get(i));
    let bounds = selected.map_or_else(|| scene.bounds(), |member| member.bounds);
    let mut viewpoint = world.resource_mut::<Viewpoint>();
    if let Some(camera) = viewpoint.camera().map(|camera| camera.framing(bounds)) {
        viewpoint.go(camera);
    }
}

fn dismiss(world: &mut World) {
    let mut export = world.resource_mut::<Export>();
    if std::mem::take(&mut export.shown) {
        return;
    }
    if world.resource_mut::<Saving>().dismiss()
        || std::mem::take(&mut world.resource_mut::<Form>().is_open)
        || std::mem::take(&mut world.resource_mut::<Creation>().is_open)
        || std::mem::take(&mut world.resource_mut::<Views>().is_open)
        || std::mem::take(&mut world.resource_mut::<Layout>().keys)
        || world.resource_mut::<Banners>().dismiss()
    {
        return;
    }
    if world.resource::<Desk>().has_drawn("Structure")
        && world.resource_mut::<Structure>().end_flight()
    {
        return;
    }
    // A tool over slices that are seen goes before the selection that they are of, and so does one
    // over the picture of light.
    let [slices, light] = ["CT", "Render"].map(|panel| world.resource::<Desk>().has_drawn(panel));
    if slices && world.resource_mut::<Ct>().end_tool()
        || light && (world.resource_mut::<LightLine>().end() || border::end(world))
    {
        return;
    }
    world.resource_mut::<Selection>().set_if_neq(Selection(None));
}
