//! Views of a structure that are kept by name, beside the cameras of its scene.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use bevy_ecs::prelude::*;
use egui::{TextEdit, Ui};
use intrados_scene::{Camera, Scene, plugin::CurrentScene};

use crate::{Action, Actions, Viewpoint, kept, structure::Structure, workspace::Desk};

/// Most views of a scene.
const MOST: usize = 100;

/// Views of every scene by its file, and the sheet that lists those of the one that is open.
#[derive(Resource, Debug, Default)]
pub(crate) struct Views {
    pub(crate) is_open: bool,
    /// What the next one is to be called.
    name: String,
    kept: BTreeMap<PathBuf, Vec<Camera>>,
    /// Where they are kept; none: as long as the window is open.
    file: Option<PathBuf>,
}

impl Views {
    /// As they were kept; a file that is missing or broken has none.
    pub(crate) fn read(file: Option<PathBuf>) -> Self {
        let kept = file.as_deref().and_then(kept::read).unwrap_or_default();
        Self { kept, file, ..Self::default() }
    }

    /// Those of a scene.
    pub(crate) fn of(&self, scene: &Path) -> &[Camera] {
        self.kept.get(&key(scene)).map(Vec::as_slice).unwrap_or_default()
    }

    /// Keeps a view, in place of one that has its name; one without a name gets a number that is
    /// free.
    fn keep(&mut self, scene: &Path, name: &str, camera: Camera) {
        let views = self.kept.entry(key(scene)).or_default();
        let is_free = |name: &String| views.iter().all(|v| v.name != *name);
        let numbered = || (1..=MOST + 1).map(|n| tr!("View {}", n)).find(is_free);
        let name = match name.trim() {
            "" => numbered().unwrap_or_default(),
            name => name.to_owned(),
        };
        let camera = Camera { name, ..camera };
        match views.iter().position(|v| v.name == camera.name) {
            Some(index) => views[index] = camera,
            None if views.len() < MOST => views.push(camera),
            None => {}
        }
        self.write();
    }

    fn forget(&mut self, scene: &Path, index: usize) {
        let key = key(scene);
        let Some(views) = self.kept.get_mut(&key).filter(|v| index < v.len()) else { return };
        views.remove(index);
        if views.is_empty() {
            self.kept.remove(&key);
        }
        self.write();
    }

    fn write(&self) {
        if let Some(file) = &self.file {
            kept::write(file, "the views were", &self.kept);
        }
    }
}

/// Relative paths mean something else tomorrow; a bundled scene has no file, but a name.
fn key(scene: &Path) -> PathBuf {
    let file = scene.exists().then(|| std::path::absolute(scene).ok()).flatten();
    file.unwrap_or_else(|| scene.to_owned())
}

fn scene(world: &World) -> Option<Arc<Scene>> {
    world.get_resource::<CurrentScene>().map(|s| s.0.clone())
}

/// Where the panel that is in sight looks from: the picture of light, else the structure.
fn present(world: &World) -> Option<Camera> {
    let light = world.resource::<Viewpoint>().camera();
    let structure = world.resource::<Structure>().camera();
    let is_light = world.resource::<Desk>().has_drawn("Render");
    let from = if is_light { light } else { structure.or(light) };
    from.cloned()
}

/// Keeps the present view; without a name it gets a number.
pub(crate) fn keep(world: &mut World, name: &str) {
    if let (Some(scene), Some(camera)) = (scene(world), present(world)) {
        world.resource_mut::<Views>().keep(&scene.path, name, camera);
    }
}

/// Looks from there, in both pictures; each keeps its pixels.
pub(crate) fn go(world: &mut World, index: usize) {
    let Some(scene) = scene(world) else { return };
    let Some(view) = world.resource::<Views>().of(&scene.path).get(index).cloned() else { return };
    world.resource_mut::<Structure>().follow(&scene, &view);
    let mut viewpoint = world.resource_mut::<Viewpoint>();
    let Some(now) = viewpoint.camera() else { return };
    let Camera { name, width, height, exposure, .. } = now.clone();
    viewpoint.go(Camera { name, width, height, exposure, ..view });
}

/// Looks through a camera of the scene, in both pictures.
pub(crate) fn go_to_camera(world: &mut World, index: usize) {
    let Some(scene) = scene(world) else { return };
    let Some(camera) = scene.cameras.get(index) else { return };
    world.resource_mut::<Structure>().follow(&scene, camera);
    world.resource_mut::<Viewpoint>().go(camera.clone());
}

pub(crate) fn forget(world: &mut World, index: usize) {
    if let Some(scene) = scene(world) {
        world.resource_mut::<Views>().forget(&scene.path, index);
    }
}

/// Entries of a menu: the cameras of the scene, and what was kept.
pub(crate) fn menu(ui: &mut Ui, world: &World, asked: &mut Vec<Action>) {
    let Some(scene) = scene(world) else { return };
    let views = world.resource::<Views>().of(&scene.path);
    let scenes = scene.cameras.iter().enumerate().map(|(i, c)| (&c.name, Action::Camera(i)));
    let kept = views.iter().enumerate().map(|(i, v)| (&v.name, Action::View(i)));
    for (name, action) in scenes.chain(kept) {
        if ui.button(name).clicked() {
            asked.push(action);
        }
    }
    if scene.cameras.is_empty() && views.is_empty() {
        ui.weak(tr!("The scene has none of its own."));
    }
    ui.separator();
    if ui.button(tr!("Keep this view…")).clicked() {
        asked.push(Action::Views);
    }
}

/// The sheet that names a view, keeps it, and lists all of them.
pub(crate) fn sheet(ui: &Ui, world: &mut World) {
    let Some(scene) = scene(world).filter(|_| world.resource::<Views>().is_open) else { return };
    let mut views = world.resource_mut::<Views>();
    let views = views.bypass_change_detection();
    let (mut open, mut asked) = (true, Vec::new());
    egui::Window::new(tr!("Views"))
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .default_pos(ui.ctx().content_rect().left_top() + egui::vec2(24.0, 80.0))
        .show(ui.ctx(), |ui| {
            naming(ui, &mut views.name, &mut asked);
            ui.separator();
            list(ui, &scene, views.of(&scene.path), &mut asked);
        });
    views.is_open = open;
    asked.into_iter().for_each(|action| world.resource_mut::<Actions>().ask(action));
}

fn naming(ui: &mut Ui, name: &mut String, asked: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let label = ui.label(tr!("Name of the view"));
        let field = TextEdit::singleline(name).desired_width(160.0);
        let hint = tr!("Where the picture that is in sight looks from, for this scene");
        let field = ui.add(field).labelled_by(label.id);
        let is_entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let button = ui.button(tr!("Keep this view")).on_hover_text(hint);
        if button.clicked() || is_entered {
            asked.push(Action::KeepView(std::mem::take(name)));
        }
    });
}

fn list(ui: &mut Ui, scene: &Scene, kept: &[Camera], asked: &mut Vec<Action>) {
    egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
        for (index, camera) in scene.cameras.iter().enumerate() {
            let hint = tr!("A camera of the scene, for the structure and the picture of light");
            if ui.button(&camera.name).on_hover_text(hint).clicked() {
                asked.push(Action::Camera(index));
            }
        }
        for (index, view) in kept.iter().enumerate() {
            ui.horizontal(|ui| {
                if ui.button(&view.name).clicked() {
                    asked.push(Action::View(index));
                }
                let remove = ui.small_button("🗑");
                let name = tr!("Forget the view {}", view.name);
                remove.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
                if remove.on_hover_text(&name).clicked() {
                    asked.push(Action::ForgetView(index));
                }
            });
        }
    });
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn at(x: f32) -> Camera {
        Camera { position: Vec3::X * x, ..Camera::overview([Vec3::ZERO, Vec3::ONE]) }
    }

    #[test]
    fn views_are_kept_by_scene_and_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("deep/views.json");
        let [one, other] = ["/a/one.ron", "other"].map(Path::new);
        let mut views = Views::read(Some(file.clone()));
        views.keep(one, "", at(1.0));
        views.keep(one, " from the river ", at(2.0));
        views.keep(one, "", at(3.0));
        views.keep(one, "from the river", at(4.0));
        let again = Views::read(Some(file.clone()));
        let named: Vec<(&str, f32)> =
            again.of(one).iter().map(|v| (v.name.as_str(), v.position.x)).collect();
        assert_eq!(named, [("View 1", 1.0), ("from the river", 4.0), ("View 2", 3.0)]);
        assert!(again.of(other).is_empty());
        views.forget(one, 0);
        views.forget(one, 9);
        views.keep(one, "", at(5.0));
        let again = Views::read(Some(file.clone()));
        assert_eq!(again.of(one).last().map(|v| v.name.as_str()), Some("View 1"));
        std::fs::write(&file, "{[").unwrap();
        assert!(Views::read(Some(file)).of(one).is_empty());
    }
}
