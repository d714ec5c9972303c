//! A scan of one member at one place, kept so that it can be restored again with other corrections;
//! and its sinogram while it forms.

use std::sync::{Arc, Mutex, PoisonError};

use intrados_stage::{Job, random::Key};

use super::{
    Behind, Corrections, Drawing, Energies, Exposure, Known, Protocol, Rays, Restored, ScanError,
    ScatterMap, ScatterSettings, Target, expose::expose_seen, restore,
};
use crate::{
    physics::Library,
    recon::Window,
    specimen::concrete::{Subject, substances},
};

/// What a scan has brought, before anything is taken out of it.
#[derive(Debug)]
pub struct Acquisition {
    /// The specimen.
    pub target: Target,
    /// What its correction may know: data sheet and drawing.
    pub known: Known,
    /// The scatter as it is estimated for the correction: other walks, through what the drawing
    /// shows.
    pub scatter_map: ScatterMap,
    /// What the panel has read.
    pub exposure: Exposure,
}

impl Acquisition {
    /// Scans a subject at `along` of its axis; `slices` round the scan plane are to be restored.
    /// The sinogram of the panel's middle row forms in `sinogram`.
    ///
    /// # Errors
    /// [`ScanError`].
    pub fn take(
        member: Subject,
        along: f32,
        protocol: &Protocol,
        slices: usize,
        seed: u64,
        sinogram: &Forming,
        job: &Job,
    ) -> Result<Self, ScanError> {
        let target = Target::of_member(member, along, protocol, slices, seed, job)?;
        let known = Known {
            protocol: protocol.clone(),
            drawing: Drawing::of_recipe(&target.concrete.recipe),
            slices: target.slices,
        };
        // The tube as it is and the concrete as it was cast make the readings.
        let real = protocol.as_it_is(Key::new(seed, 7))?;
        let energies = Energies::new(&real, substances(&target.concrete, &Library::builtin()?)?);
        let (drawn, made) = (known.drawing.solids(protocol)?, target.solids(protocol)?);
        let correction = Behind { specimen: &drawn, protocol, seed: seed.wrapping_add(1 << 40) };
        let truth = Behind { specimen: &made, protocol: &real, seed };
        let [scatter_map, truth] =
            ScatterMap::cast([correction, truth], &ScatterSettings::of(protocol), job)?;
        job.relabel(format!("exposing {} at {along}", member.id()));
        let exposure = expose_seen(
            &Rays::new(&target.painted),
            &energies,
            Some(&truth),
            &real,
            seed,
            sinogram,
            job,
        )?;
        Ok(Self { target, known, scatter_map, exposure })
    }

    /// Slices with these corrections.
    ///
    /// # Errors
    /// [`ScanError`].
    pub fn restore(&self, corrections: Corrections, job: &Job) -> Result<Restored, ScanError> {
        restore(
            &self.exposure,
            &self.known,
            Some(&self.scatter_map),
            corrections,
            Window::Hann,
            job,
        )
    }
}

/// The sinogram of the panel's middle row, which grows while a scan runs; for whoever looks on.
#[derive(Debug, Clone, Default)]
pub struct Forming(Arc<Mutex<Row>>);

/// A sinogram as far as it is there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Row {
    /// Bins of a view.
    pub bins: usize,
    /// Views of the whole scan.
    pub views: usize,
    /// −ln of what came over the flat field, `[view][bin]`, of the views so far.
    pub lines: Vec<f32>,
}

impl Forming {
    /// Begins with nothing.
    pub(super) fn begin(&self, views: usize, bins: usize) {
        *self.lock() = Row { bins, views, lines: Vec::with_capacity(views * bins) };
    }

    /// One view more.
    pub(super) fn add(&self, line: impl Iterator<Item = f32>) {
        self.lock().lines.extend(line);
    }

    /// Values so far: it has changed where this has.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lock().lines.len()
    }

    /// Whether there is nothing yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// As it is now.
    #[must_use]
    pub fn row(&self) -> Row {
        self.lock().clone()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Row> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
