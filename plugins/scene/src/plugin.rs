//! Scenes in the world: loading off the frame, and one entity for each member, lamp, camera and
//! meter.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use bevy_app::{App, Plugin, Update};
use bevy_ecs::prelude::*;
use intrados_stage::{Access, Job, Jobs, Stage, Task};

use crate::{
    LoadError, Scene,
    import::{ImportError, Imported, Told, import},
};

/// Asks for a scene: a file, or a bundled scene by its name. The scene that is there stays until
/// the new one is ready.
#[derive(Message, Debug, Clone, PartialEq, Eq)]
pub struct OpenScene(pub PathBuf);

/// Asks for a model (glTF, IFC) as a project of its own, in a folder beside it: only there evidence
/// has a place. One that was made before is opened as it is.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct OpenAsProject {
    /// The model.
    pub model: PathBuf,
    /// Metres per unit of it; none: what its format says.
    pub metres: Option<f64>,
}

/// Another scene is in [`CurrentScene`], and its entities are there.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub struct SceneChanged;

/// A scene was asked for and could not be loaded.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct SceneFailed(pub LoadError);

/// The scene that everybody works on.
#[derive(Resource, Debug, Clone)]
pub struct CurrentScene(pub Arc<Scene>);

/// On every entity that came with the scene; they go when the next one comes.
#[derive(Component, Debug, Clone, Copy, PartialEq, Eq)]
pub struct FromScene;

/// Where an entity stands in its list of the [`Scene`]: the third member has 2.
#[derive(Component, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SceneIndex(pub usize);

/// The load that runs, if one does. A newer wish replaces it, and dropping the task cancels it.
#[derive(Resource, Default)]
struct Loading(Mutex<Option<Task<Result<Scene, LoadError>>>>);

/// Loads scenes in [`Stage::Load`] and spreads them over entities. The resource [`Access`] says
/// what they may read.
#[derive(Debug, Clone, Copy, Default)]
pub struct ScenePlugin;

impl Plugin for ScenePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Loading>()
            .init_resource::<Access>()
            .init_resource::<Jobs>()
            .add_message::<OpenScene>()
            .add_message::<OpenAsProject>()
            .add_message::<SceneChanged>()
            .add_message::<SceneFailed>()
            .add_systems(Update, (start_loading, finish_loading).chain().in_set(Stage::Load));
    }
}

/// Puts a scene that is in memory into the world, in place of the one before, and says so with
/// [`SceneChanged`].
pub fn install(world: &mut World, scene: Scene) {
    let old: Vec<Entity> = world.query_filtered::<Entity, With<FromScene>>().iter(world).collect();
    for entity in old {
        world.despawn(entity);
    }
    let scene = Arc::new(scene);
    spawn(world, &scene.members);
    spawn(world, &scene.lamps);
    spawn(world, &scene.cameras);
    spawn(world, &scene.meters);
    world.insert_resource(CurrentScene(scene));
    world.write_message(SceneChanged);
}

fn spawn<T: Component + Clone>(world: &mut World, list: &[T]) {
    for (i, item) in list.iter().enumerate() {
        world.spawn((item.clone(), SceneIndex(i), FromScene));
    }
}

fn start_loading(
    mut wishes: MessageReader<OpenScene>,
    mut projects: MessageReader<OpenAsProject>,
    loading: ResMut<Loading>,
    access: Res<Access>,
    mut jobs: ResMut<Jobs>,
) {
    let as_it_is = |wish: &OpenScene| (wish.0.clone(), is_ifc(&wish.0).then(Told::default));
    let scene = wishes.read().last().map(as_it_is);
    let told = |metres| Told { metres, ..Told::default() };
    let project = projects.read().last().map(|wish| (wish.model.clone(), Some(told(wish.metres))));
    let Some((path, told)) = project.or(scene) else { return };
    let access = access.clone();
    let task =
        Task::spawn(&mut jobs, format!("opening {}", path.display()), move |job| match &told {
            Some(told) => imported(&path, told, &access, job),
            None => Scene::open_within(&path, &access, job),
        });
    *loading.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(task);
}

/// IFC is no scene: it is always imported.
fn is_ifc(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ifc"))
}

/// A model that is imported into a folder beside it: `bridge.ifc` into `bridge.intrados`. Where nothing can be written there, the folder lies among the temporary ones.
/// What was imported before, and may have been edited, is opened as it is.
fn imported(path: &Path, told: &Told, access: &Access, job: &Job) -> Result<Scene, LoadError> {
    // What was made of it in its own unit is another structure.
    let scaled = if told.metres.is_some() { "scaled." } else { "" };
    let beside = path.with_extension(format!("{scaled}intrados"));
    // Two models of one name are not to meet there.
    let whole = path.canonicalize().unwrap_or_else(|_| path.into());
    let key = blake3::hash(whole.as_os_str().as_encoded_bytes()).to_hex();
    let aside = std::env::temp_dir().join(format!("intrados-import-{scaled}{key}"));
    for folder in [beside, aside] {
        let scene = folder.join("scene.ron");
        let mut remarks = Vec::new();
        if !scene.exists() {
            match import(path, &folder, told, access, &job.part(0.0, 0.9)) {
                Err(ImportError::CannotWrite(_)) => continue,
                other => remarks = remarks_on(&other?, &folder),
            }
        }
        let mut scene = Scene::load_within(&scene, access, &job.part(0.9, 1.0))?;
        scene.warnings.extend(remarks);
        return Ok(scene);
    }
    let message = "its folder cannot be written: copy it elsewhere, or use `intrados import --out`";
    Err(LoadError::bad(path.display().to_string(), "CANNOT_WRITE", message))
}

/// What somebody should know of an import who has not read the page that it wrote.
fn remarks_on(imported: &Imported, folder: &Path) -> Vec<String> {
    let left: Vec<String> =
        imported.scenery.iter().map(|(class, count)| format!("{count} {class}")).collect();
    let left = if left.is_empty() { "none".into() } else { left.join(", ") };
    let page = folder.join("README.md");
    let whole = format!(
        "imported from {}; no members, and shown as they are: {left}; what was assumed is said in {}",
        imported.format,
        page.display()
    );
    std::iter::once(whole).chain(imported.notes.iter().cloned()).collect()
}

fn finish_loading(world: &mut World) {
    let done = {
        let loading = world.resource::<Loading>();
        let mut task = loading.0.lock().unwrap_or_else(PoisonError::into_inner);
        let result = task.as_ref().and_then(Task::poll);
        if result.is_some() {
            *task = None;
        }
        result
    };
    match done {
        None => {}
        Some(Ok(Ok(scene))) => install(world, scene),
        Some(Ok(Err(error))) => {
            world.write_message(SceneFailed(error));
        }
        Some(Err(_)) => {
            world.write_message(SceneFailed(LoadError::bad(
                "",
                "INTERNAL",
                "the loader broke off: please report this file",
            )));
        }
    }
}

#[cfg(test)]
mod tests {
    use bevy_ecs::message::Messages;
    use intrados_stage::StagePlugin;

    use super::*;
    use crate::{Camera, Member, Meter};

    fn app() -> App {
        let mut app = App::new();
        app.add_plugins((StagePlugin, ScenePlugin));
        app
    }

    fn count<T: Component>(app: &mut App) -> usize {
        app.world_mut().query_filtered::<(), (With<T>, With<FromScene>)>().iter(app.world()).count()
    }

    /// Frames until nothing loads any more; how many scenes changed and failed meanwhile.
    fn settle(app: &mut App) -> (usize, usize) {
        let mut sum = (0, 0);
        loop {
            app.update();
            sum.0 += app.world_mut().resource_mut::<Messages<SceneChanged>>().drain().count();
            sum.1 += app.world_mut().resource_mut::<Messages<SceneFailed>>().drain().count();
            if app.world().resource::<Loading>().0.lock().unwrap().is_none() {
                return sum;
            }
        }
    }

    #[test]
    fn scenes_come_and_go_with_their_entities() {
        let mut app = app();
        app.world_mut().write_message(OpenScene("column".into()));
        assert_eq!(settle(&mut app), (1, 0));
        assert_eq!(
            (count::<Member>(&mut app), count::<Camera>(&mut app), count::<Meter>(&mut app)),
            (4, 2, 3)
        );

        // What cannot be opened leaves what is there.
        app.world_mut().write_message(OpenScene("no such scene".into()));
        assert_eq!(settle(&mut app), (0, 1));
        assert_eq!(app.world().resource::<CurrentScene>().0.name, "column");
        assert_eq!(count::<Member>(&mut app), 4);

        // Of two wishes the later one counts.
        app.world_mut().write_message(OpenScene("tunnel".into()));
        app.world_mut().write_message(OpenScene("room".into()));
        assert_eq!(settle(&mut app), (1, 0));
        assert_eq!(app.world().resource::<CurrentScene>().0.name, "room");
        assert_eq!(
            (count::<Member>(&mut app), count::<Camera>(&mut app), count::<Meter>(&mut app)),
            (0, 1, 2)
        );
        assert!(app.world_mut().resource_mut::<Jobs>().running().is_empty());
    }

    #[test]
    fn a_model_in_millimetres_is_opened_again_in_metres() {
        use glam::{Mat4, Vec3};

        use crate::{Material, Mesh, Object, Part, gltf, import::likely_unit};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.glb");
        let write = |size: f32| {
            let mesh = Mesh {
                positions: [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|p| size * p).to_vec(),
                triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
                ..Mesh::default()
            };
            let object = Object {
                name: "block".into(),
                mesh: 0,
                transform: Mat4::IDENTITY,
                material: 0,
                member: None,
                part: Part::Scenery,
            };
            let model = gltf::Model {
                meshes: vec![Arc::new(mesh)],
                objects: vec![object],
                materials: vec![Material::default()],
                ..gltf::Model::default()
            };
            gltf::write_glb(&path, &model).unwrap();
        };
        let mut app = app();
        for (size, unit) in [(30.0, None), (3e4, Some(1e-3)), (5e-4, Some(1e3)), (1e7, None)] {
            write(size);
            app.world_mut().write_message(OpenScene(path.clone()));
            assert_eq!(settle(&mut app), (1, 0), "{size}");
            let scene = app.world().resource::<CurrentScene>().0.clone();
            assert_eq!(likely_unit(&scene), unit, "{size}");
        }
        write(3e4);
        app.world_mut().write_message(OpenAsProject { model: path, metres: Some(1e-3) });
        assert_eq!(settle(&mut app), (1, 0));
        let scene = app.world().resource::<CurrentScene>().0.clone();
        let [low, high] = scene.bounds();
        assert!(((high - low).max_element() - 30.0).abs() < 1e-3, "{low} {high}");
        assert!(scene.path.starts_with(folder.path().join("block.scaled.intrados")));
        let doubts: Vec<_> = scene.warnings.iter().filter(|w| w.contains("mm or m?")).collect();
        assert!(likely_unit(&scene).is_none() && doubts.is_empty(), "{doubts:?}");
    }

    #[test]
    fn a_scene_in_memory_needs_no_loading() {
        let mut app = app();
        install(app.world_mut(), Scene { name: "mine".into(), ..Scene::default() });
        assert_eq!(app.world_mut().resource_mut::<Messages<SceneChanged>>().drain().count(), 1);
        assert_eq!(app.world().resource::<CurrentScene>().0.name, "mine");
    }
}
