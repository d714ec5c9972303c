//! The window's world, and what becomes of it when something in it panics.

use bevy_app::{App, PluginsState};
use bevy_ecs::world::World;
use egui::Ui;
use intrados_stage::{Fault, catch};

use crate::{
    Action, Actions, Banners, Log, banner, layout, recent::Recent, session::Session, views::Views,
};

/// An app with panels that outlives a panic in any of its systems.
///
/// A panic leaves a world half changed, and bevy's schedules out of their place. So the world is
/// thrown away then and another one is built; log, recent files and the name of the scene come
/// along, a banner says what broke, and the user decides whether the scene is opened again. A panel
/// that panics takes only itself along ([`show`](crate::show)).
pub struct Window {
    app: App,
    build: Box<dyn Fn() -> App>,
}

impl Window {
    /// Builds the app, which must have the [`PanelsPlugin`](crate::PanelsPlugin), now and whenever
    /// it has to begin anew.
    #[must_use]
    pub fn new(build: impl Fn() -> App + 'static) -> Self {
        Self { app: ready(build()), build: Box::new(build) }
    }

    /// What is in it.
    pub fn world(&mut self) -> &mut World {
        self.app.world_mut()
    }

    /// The app of now.
    pub fn app(&self) -> &App {
        &self.app
    }

    /// One frame of the world.
    pub fn update(&mut self) {
        if self.app.world().resource::<Actions>().has(&Action::Reload) {
            let asked = std::mem::take(&mut *self.app.world_mut().resource_mut::<Actions>());
            self.begin_anew();
            *self.app.world_mut().resource_mut::<Actions>() = asked;
        }
        if let Err(fault) = catch(|| self.app.update()) {
            self.outlive(&fault);
        }
    }

    /// Draws it.
    pub fn show(&mut self, ui: &mut Ui) {
        if let Err(fault) = catch(|| layout::show(ui, self.app.world_mut())) {
            self.outlive(&fault);
        }
    }

    fn outlive(&mut self, fault: &Fault) {
        self.begin_anew();
        let world = self.app.world_mut();
        let mut log = std::mem::take(&mut *world.resource_mut::<Log>());
        banner::tell(
            &mut world.resource_mut::<Banners>(),
            &mut log,
            &tr!("The scene had to be closed"),
            fault,
        );
        *world.resource_mut::<Log>() = log;
    }

    /// Another world in place of this one.
    fn begin_anew(&mut self) {
        let mut old = std::mem::replace(&mut self.app, ready((self.build)()));
        let (from, to) = (old.world_mut(), self.app.world_mut());
        *to.resource_mut::<Log>() = std::mem::take(&mut *from.resource_mut::<Log>());
        *to.resource_mut::<Recent>() = std::mem::take(&mut *from.resource_mut::<Recent>());
        *to.resource_mut::<Session>() = std::mem::take(&mut *from.resource_mut::<Session>());
        *to.resource_mut::<Views>() = std::mem::take(&mut *from.resource_mut::<Views>());
        let asked = from.resource_mut::<layout::Layout>().asked.take();
        to.resource_mut::<layout::Layout>().asked = asked;
        // What broke may break once more while it goes.
        if let Err(fault) = catch(|| drop(old)) {
            tracing::error!("{fault}");
        }
    }
}

/// What a runner of bevy would do.
fn ready(mut app: App) -> App {
    while app.plugins_state() == PluginsState::Adding {}
    app.finish();
    app.cleanup();
    app
}
