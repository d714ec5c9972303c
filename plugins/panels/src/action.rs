//! What a user can ask for.

use std::path::PathBuf;

use bevy_ecs::prelude::*;
use intrados_light::{RenderSettings, View};
use intrados_predict::Progress;
use intrados_scene::plugin::{CurrentScene, OpenScene};

use crate::{
    Banners, Log, Look, Place, Quantity, Refine, Selection, Viewpoint,
    ct::Ct,
    dialog::{Dialogs, Purpose},
    export::Export,
    layout::Layout,
    photos::Photos,
    place::Panels,
    recent::Recent,
};

/// Something that a user can ask for by a button, a menu, or a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Choose a file to open.
    Choose,
    /// Open a file, or a bundled scene by its name.
    Open(PathBuf),
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
    /// Another camera of the scene, by its place in the list.
    Camera(usize),
    /// Look at another side.
    Show(View),
    /// Light or its error.
    ShowQuantity(Quantity),
    /// Select a member, or nothing.
    Select(Option<usize>),
    /// Go to a tab in the centre, by its name.
    Tab(&'static str),
    /// Show a slice of the selected member, by its place among those of the scene, in the CT tab.
    Slice(usize),
    /// Look at a photograph in the Photos tab.
    Photograph(PathBuf),
    /// Choose a photograph in a dialog.
    ChoosePhotograph,
    /// Ask for a file name to export to.
    Export,
    /// Choose that file name in a dialog.
    ChooseExport,
    /// Show or hide the list of keys.
    Keys,
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
    for action in std::mem::take(&mut world.resource_mut::<Actions>().0) {
        carry_out(world, action);
    }
}

fn carry_out(world: &mut World, action: Action) {
    match action {
        Action::Choose => Dialogs::open(world, Purpose::Open),
        Action::ChooseExport => {
            let name = world.resource::<Export>().path.clone();
            Dialogs::open(world, Purpose::Save(name));
        }
        Action::Open(path) => open(world, path),
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
            let home = world.resource::<Viewpoint>().home.clone();
            if let Some(home) = home {
                world.resource_mut::<Viewpoint>().go(home);
            }
        }
        Action::Camera(index) => {
            let camera =
                world.get_resource::<CurrentScene>().and_then(|s| s.0.cameras.get(index).cloned());
            if let Some(camera) = camera {
                world.resource_mut::<Viewpoint>().go(camera);
            }
        }
        Action::Frame => frame(world),
        Action::Show(view) => world.resource_mut::<Look>().view = view,
        Action::ShowQuantity(quantity) => world.resource_mut::<Look>().quantity = quantity,
        Action::Select(member) => {
            world.resource_mut::<Selection>().set_if_neq(Selection(member));
        }
        Action::Tab(name) => show_tab(world, name),
        Action::Slice(index) => {
            world.resource_mut::<Ct>().show(index);
            show_tab(world, "CT");
        }
        Action::Photograph(path) => {
            world.resource_mut::<Photos>().show(path);
            show_tab(world, "Photos");
        }
        Action::ChoosePhotograph => Dialogs::open(world, Purpose::Photograph),
        Action::Export => {
            let name =
                world.get_resource::<CurrentScene>().map(|s| s.0.name.clone()).unwrap_or_default();
            world.resource_mut::<Export>().toggle(&name);
        }
        Action::Keys => {
            let mut layout = world.resource_mut::<Layout>();
            layout.keys = !layout.keys;
        }
        Action::Dismiss => dismiss(world),
    }
}

fn open(world: &mut World, path: PathBuf) {
    world.resource_mut::<Banners>().clear();
    world.resource_mut::<Log>().say(format!("opening {}", path.display()));
    world.resource_mut::<Layout>().asked = Some(path.clone());
    world.write_message(OpenScene(path));
}

fn show_tab(world: &mut World, name: &str) {
    let tab = world
        .resource::<Panels>()
        .0
        .iter()
        .filter(|p| p.place == Place::Tab)
        .position(|p| p.name == name);
    if let Some(tab) = tab {
        world.resource_mut::<Layout>().tab = tab;
    }
}

fn frame(world: &mut World) {
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
    if std::mem::take(&mut world.resource_mut::<Layout>().keys)
        || world.resource_mut::<Banners>().dismiss()
    {
        return;
    }
    world.resource_mut::<Selection>().set_if_neq(Selection(None));
}
