//! The ray tracer: which triangle does a ray meet first, and does it meet any.
//!
//! All triangles of a scene are in one eight-wide tree of boxes. Rays come in batches, and two
//! kernels answer them: in large scenes each ray walks its own way and tests eight boxes or eight
//! triangles at once; in small ones eight rays of a kind walk together and test one box or triangle
//! at a time. Both give the same bits, whatever else is in the batch: of two hits at the same
//! distance the triangle with the lower index wins.
//!
//! No ray slips between two triangles that share an edge: the test of Woop, Benthin and Wald,
//! "Watertight ray/triangle intersection" (JCGT 2:1, 2013), with rounding rules that make its
//! fall-back to double precision superfluous (see `single.rs`). Where a hit is, how far that may be
//! wrong, and where the next ray has to start is in [`offset`].
//!
//! ```
//! use glam::Vec3;
//! use intrados_scene::tracer::{Hit, Ray, Scratch, Tracer};
//!
//! let tracer = Tracer::build(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]);
//! let rays = [Ray::new(Vec3::new(0.2, 0.2, 2.0), -Vec3::Z, f32::INFINITY), Ray::new(Vec3::ONE, Vec3::Z, f32::INFINITY)];
//! let mut hits = [Hit::MISS; 2];
//! tracer.closest(&rays, &mut hits, &mut Scratch::default());
//! assert_eq!(hits, [Hit { t: 2.0, triangle: 0 }, Hit::MISS]);
//! ```

mod build;
pub mod offset;
mod packet;
mod reinsert;
mod single;
mod tree;

use glam::Vec3;
use intrados_stage::{Cancelled, Job};

pub use packet::Scratch;

/// Triangles with a coordinate beyond this are never hit, nor are rays from there, m. Products of
/// three stay finite.
pub(crate) const LARGEST: f32 = 1e9;

/// Rays whose direction has its largest component outside this range hit nothing.
const LENGTHS: [f32; 2] = [1e-12, 1e12];

/// A ray, 32 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Where it starts, m.
    pub origin: [f32; 3],
    /// Hits at this distance or beyond are no hits. In units of `direction`'s length.
    pub t_max: f32,
    /// Where it goes; need not be unit.
    pub direction: [f32; 3],
    /// For the caller.
    pub tag: u32,
}

impl Ray {
    /// From `origin` along `direction`, up to `t_max` times its length; tag 0.
    #[must_use]
    pub const fn new(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin: origin.to_array(), t_max, direction: direction.to_array(), tag: 0 }
    }

    /// Whether it can hit anything: finite, of some length, with some way to go.
    fn is_valid(&self) -> bool {
        // NaN fails every comparison.
        let within = |v: [f32; 3], limit: f32| v.iter().all(|x| x.abs() <= limit);
        let some_way = self.direction.iter().any(|x| x.abs() >= LENGTHS[0]);
        self.t_max > 0.0
            && within(self.origin, LARGEST)
            && within(self.direction, LENGTHS[1])
            && some_way
    }
}

/// What a ray met first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in units of the direction's length; infinite where nothing was met.
    pub t: f32,
    /// Index of the triangle, in the order given to [`Tracer::build`]; [`Hit::NONE`] where nothing
    /// was met.
    pub triangle: u32,
}

impl Hit {
    /// No triangle.
    pub const NONE: u32 = u32::MAX;
    /// Nothing was met.
    pub const MISS: Self = Self { t: f32::INFINITY, triangle: Self::NONE };

    /// Whether something was met.
    #[must_use]
    pub const fn is_hit(&self) -> bool {
        self.triangle != Self::NONE
    }
}

/// How a batch is answered. The results are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// Each ray on its own way, eight boxes or triangles at a time.
    Single,
    /// Eight rays of similar direction together, one box or triangle at a time.
    Packet,
}

/// Up to this many triangles packets are faster. Measured on the rays of diffuse walks in a room of
/// 36·k² triangles (bench `tracer`, Zen 4), ns a ray, packet against single: 26 and 63 with 36
/// triangles, 63 and 78 with 144, 86 and 80 with 324, 105 and 79 with 576, 118 and 85 with 900.
/// Whether anything is hit: 11 and 55 with 36, 39 and 68 with 324, 49 and 82 with 576. A walk sends
/// nearly two of the former for one of the latter.
const PACKET_TRIANGLES: usize = 450;

impl Kernel {
    /// The faster one for so many triangles.
    #[must_use]
    pub(crate) const fn for_triangles(count: usize) -> Self {
        if count <= PACKET_TRIANGLES { Self::Packet } else { Self::Single }
    }
}

/// All triangles of a scene in one eight-wide tree.
#[derive(Debug)]
pub struct Tracer {
    tree: tree::Tree,
    kernel: Kernel,
    triangles: usize,
}

impl Default for Tracer {
    /// Nothing to hit.
    fn default() -> Self {
        Self { tree: tree::Tree::default(), kernel: Kernel::Single, triangles: 0 }
    }
}

impl Tracer {
    /// Builds the tree, the same one on any number of threads. Triangles that are not finite, or
    /// without area, are never hit.
    #[must_use]
    pub fn build(triangles: &[[Vec3; 3]]) -> Self {
        Self::build_with(triangles, Kernel::for_triangles(triangles.len()))
    }

    /// [`Tracer::build`] for a given kernel.
    #[must_use]
    pub fn build_with(triangles: &[[Vec3; 3]], kernel: Kernel) -> Self {
        // Nobody else knows this job, so nobody cancels it.
        Self::built(triangles, kernel, &Job::default()).unwrap_or_default()
    }

    /// [`Tracer::build`] that shows its progress.
    ///
    /// # Errors
    /// [`Cancelled`] soon after the job was cancelled.
    pub fn build_job(triangles: &[[Vec3; 3]], job: &Job) -> Result<Self, Cancelled> {
        Self::built(triangles, Kernel::for_triangles(triangles.len()), job)
    }

    fn built(triangles: &[[Vec3; 3]], kernel: Kernel, job: &Job) -> Result<Self, Cancelled> {
        Ok(Self { tree: build::build(triangles, kernel, job)?, kernel, triangles: triangles.len() })
    }

    /// How many triangles it was built from.
    #[must_use]
    pub const fn triangles(&self) -> usize {
        self.triangles
    }

    /// How it answers batches.
    #[must_use]
    pub const fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// What each ray meets first, written to the place in `hits` that the ray has in `rays`.
    ///
    /// Rays that are not finite, have no direction, or a `t_max` that is not positive meet nothing.
    /// Batches of a few thousand rays are best: packets need enough of each kind, and the batch
    /// should stay in cache.
    pub fn closest(&self, rays: &[Ray], hits: &mut [Hit], scratch: &mut Scratch) {
        debug_assert_eq!(rays.len(), hits.len());
        let rays = &rays[..rays.len().min(hits.len())];
        match self.kernel {
            Kernel::Single => single::closest(&self.tree, rays, hits, &mut scratch.flight),
            Kernel::Packet => packet::closest(&self.tree, rays, hits, scratch),
        }
    }

    /// Whether each ray meets anything before its `t_max`: `closest` would give a hit.
    pub fn any(&self, rays: &[Ray], blocked: &mut [bool], scratch: &mut Scratch) {
        debug_assert_eq!(rays.len(), blocked.len());
        let rays = &rays[..rays.len().min(blocked.len())];
        match self.kernel {
            Kernel::Single => single::any(&self.tree, rays, blocked, &mut scratch.flight),
            Kernel::Packet => packet::any(&self.tree, rays, blocked, scratch),
        }
    }
}
