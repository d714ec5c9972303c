#![doc = include_str!("../README.md")]

// A member of a scene, computed: what it becomes, how its life goes, what is seen of it.
pub mod analysis;
pub mod frame;
pub mod member;
pub mod plugin;
pub mod skin;
pub mod strength;
pub mod stretch;

// What every body is computed with.
pub(crate) mod heat;
mod limits;
pub mod model;
pub(crate) mod prestress;

// The mathematics beneath, each by itself.
pub mod element;
pub mod material;
pub mod mesh;
pub mod sparse;
pub mod tensor;

// Files of others, and for others.
pub mod deck;
pub mod linear;
pub mod read;
pub mod write;

pub mod verify;

pub use analysis::{Outcome, analyze};
pub use member::{MemberError, Meshing, Prepared, prepare};
pub use model::System;
pub use plugin::MechanicsPlugin;

/// What a model takes that no scene describes: a mesh, its matter, and a march through its loads.
pub mod prelude {
    pub use crate::{
        material::{concrete::Given, law::Setting},
        mesh::{Mesh, block, divide},
        model::{
            Action, Body, Control, Drive, Elastic, Failure, Linear, Load, March, MarchSettings,
            Matter, Model, System,
        },
    };
}
