#![doc = include_str!("../README.md")]

pub mod attach;
pub mod crack;
pub mod file;
pub mod finish;
pub mod gltf;
pub mod import;
pub mod lamp;
mod lens;
mod load;
pub mod material;
pub mod member;
pub mod mesh;
pub mod parametric;
pub mod plugin;
mod polygon;
pub mod problem;
mod scene;
pub mod sensor;
mod sources;
pub mod structure;
mod summary;
pub mod tracer;

pub use crack::{CrackSurface, Mouth, Spalled, SurfaceDamage, SurfaceFile};
pub use file::{parse_ron, reference};
pub use finish::{Finish, FinishKind, StainKind};
pub use lamp::{Lamp, LampKind};
pub use lens::Lens;
pub use load::{Card, ErrorKind, LoadError, bundled, cards, validate};
pub use material::{Material, Surface, Texture, TextureRef, Wrap};
pub use member::{AxisRuns, Damage, Drilled, Frame, Member, MemberKind, Slices};
pub use mesh::Mesh;
pub use plugin::ScenePlugin;
pub use problem::{Problem, Severity};
pub use scene::{Object, Part, Roulette, Scene, Transport, Written};
pub use sensor::{Camera, Meter};
pub use sources::SourceFiles;
pub use structure::{Assembly, SteelLine, Structure};
pub use summary::Summary;
pub use tracer::{Hit, Ray, Tracer};

/// What a plugin needs that works on the scene which is open.
pub mod prelude {
    pub use crate::{
        Camera, Member, Meter, Scene,
        plugin::{CurrentScene, FromScene, OpenScene, SceneChanged, SceneFailed, SceneIndex},
    };
}
