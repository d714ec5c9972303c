#![doc = include_str!("../README.md")]

pub mod analysis;
pub mod deck;
pub mod element;
pub(crate) mod heat;
mod limits;
pub mod material;
pub mod member;
pub mod mesh;
pub mod model;
pub mod plugin;
pub(crate) mod prestress;
pub mod read;
pub mod skin;
pub mod sparse;
pub mod tensor;
pub mod verify;
pub mod write;

pub use plugin::MechanicsPlugin;
