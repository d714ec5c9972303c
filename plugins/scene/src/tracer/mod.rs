//! Ray tracer. (Interface first; kernels follow.)

use glam::Vec3;

/// A ray, 32 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Where it starts, m.
    pub origin: [f32; 3],
    /// Hits beyond this are no hits. In units of `direction`'s length.
    pub t_max: f32,
    /// Where it goes; need not be unit.
    pub direction: [f32; 3],
    /// For the caller.
    pub tag: u32,
}

/// What a ray met first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in units of the direction's length; infinite where nothing was met.
    pub t: f32,
    /// Index of the triangle, in the order given to [`Tracer::build`]; [`Hit::NONE`] where nothing was met.
    pub triangle: u32,
}

impl Hit {
    /// No triangle.
    pub const NONE: u32 = u32::MAX;
}

/// All triangles of a scene in one eight-wide tree.
#[derive(Debug)]
pub struct Tracer;

impl Tracer {
    /// Builds the tree.
    pub fn build(_triangles: &[[Vec3; 3]]) -> Self {
        todo!()
    }
}
