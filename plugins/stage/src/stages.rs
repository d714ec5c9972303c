use bevy_app::{App, Plugin, Update};
use bevy_ecs::schedule::{IntoScheduleConfigs, SystemSet};

use crate::{Jobs, Pace};

/// What happens in a frame, in this order. Data flows the same way: a stage reads what the stages
/// before it wrote.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Files become scenes.
    Load,
    /// Scenes become what the solvers work on: trees, meshes, tables.
    Model,
    /// Solvers advance by as many passes as the [`Pace`] allows.
    Transport,
    /// Sums become estimates: images, readings, error bars.
    Estimate,
    /// Evidence becomes damage per member.
    Damage,
    /// Results become files.
    Report,
    /// Results become pixels of a window.
    Present,
}

/// Adds the chain of [`Stage`]s, the [`Pace`] and the list of running [`Jobs`].
pub struct StagePlugin;

impl Plugin for StagePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Pace>().init_resource::<Jobs>().configure_sets(
            Update,
            (
                Stage::Load,
                Stage::Model,
                Stage::Transport,
                Stage::Estimate,
                Stage::Damage,
                Stage::Report,
                Stage::Present,
            )
                .chain(),
        );
    }
}
