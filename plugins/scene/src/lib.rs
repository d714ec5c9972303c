#![doc = include_str!("../README.md")]

pub mod gltf;
pub mod lamp;
pub mod material;
pub mod member;
pub mod mesh;
mod scene;
pub mod sensor;
pub mod tracer;

pub use lamp::{Lamp, LampKind};
pub use material::{Material, Surface, Texture, TextureRef, Wrap};
pub use member::{Damage, Member, MemberKind, Slices};
pub use mesh::Mesh;
pub use scene::{Object, Part, Scene};
pub use sensor::{Camera, Meter};
pub use tracer::{Hit, Ray, Tracer};
