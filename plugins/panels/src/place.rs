//! Where panels go, and how an app adds one.

use bevy_app::App;
use bevy_ecs::{
    prelude::*,
    system::{IntoSystem, SystemId},
};
use egui::Ui;

/// Where in the window a panel goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Place {
    /// Below the member tree.
    Left,
    /// Below the inspector.
    Right,
    /// A tab beside convergence, jobs and log.
    Bottom,
    /// A tab in the centre.
    Tab,
}

/// Adds panels to an [`App`].
pub trait AddPanel {
    /// Adds a panel: a system that draws into the `Ui` it is given.
    fn add_panel<M>(
        &mut self,
        place: Place,
        name: &str,
        system: impl IntoSystem<InMut<'static, Ui>, (), M> + 'static,
    ) -> &mut Self;
}

impl AddPanel for App {
    fn add_panel<M>(
        &mut self,
        place: Place,
        name: &str,
        system: impl IntoSystem<InMut<'static, Ui>, (), M> + 'static,
    ) -> &mut Self {
        let system = self.register_system(system);
        self.world_mut().get_resource_or_init::<Panels>().0.push(Panel {
            place,
            name: name.to_owned(),
            system,
        });
        self
    }
}

/// All panels, in the order in which they were added.
#[derive(Resource, Default)]
pub(crate) struct Panels(pub(crate) Vec<Panel>);

#[derive(Clone)]
pub(crate) struct Panel {
    pub(crate) place: Place,
    pub(crate) name: String,
    pub(crate) system: SystemId<InMut<'static, Ui>>,
}

/// The member that is selected, everywhere: its place in the scene's list.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Selection(pub Option<usize>);
