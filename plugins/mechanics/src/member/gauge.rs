//! Gauges of the scene in the mesh.

use glam::DVec3;
use intrados_scene::structure::{Direction, Measures};

use super::Draft;
use crate::{mesh::Locator, model::Gauge};

impl Draft<'_> {
    /// The gauges on this member; those that lie outside of it are told in the notes.
    pub(super) fn gauges(&mut self) -> Vec<(String, Gauge)> {
        let locator = Locator::new(&self.model.mesh);
        let (mut gauges, mut lost) = (Vec::new(), Vec::new());
        for gauge in self.scene.structure.gauges.iter().filter(|g| g.member == self.member.id) {
            let (sin, cos) = f64::from(gauge.angle_deg).to_radians().sin_cos();
            let radial = cos * self.axes.unit[0] + sin * self.axes.unit[1];
            let axis = self.axes.world(DVec3::Z * f64::from(gauge.along) * self.axes.length);
            let Some(place) =
                self.surface(axis, radial, f64::from(gauge.depth_mm) / 1000.0, &locator)
            else {
                lost.push(format!("gauge {} lies outside its member: it is left out", gauge.name));
                continue;
            };
            let along = |direction: Direction| match direction {
                Direction::Axial => self.axes.unit[2],
                Direction::Radial => radial,
                Direction::Hoop => self.axes.unit[2].cross(radial),
            };
            gauges.push((
                gauge.name.clone(),
                match gauge.measures {
                    Measures::Strain(direction) => Gauge::Strain(place, along(direction)),
                    Measures::Stress(direction) => Gauge::Stress(place, along(direction)),
                    Measures::Displacement(direction) => {
                        Gauge::Displacement(place, direction.as_dvec3().normalize_or_zero())
                    }
                },
            ));
        }
        drop(locator);
        self.notes.extend(lost);
        gauges
    }

    /// The brick and place in it under the surface: from the axis outwards for a solid section, the
    /// first concrete met; for a tunnel its inner face.
    fn surface(
        &self,
        axis: DVec3,
        outwards: DVec3,
        depth: f64,
        locator: &Locator,
    ) -> Option<crate::mesh::Host> {
        const STEPS: usize = 400;
        let reach = self.model.mesh.bounds().map_or(1.0, |[low, high]| (high - low).length());
        let at = |k: usize| axis + outwards * (reach * k as f64 / STEPS as f64);
        let inside: Vec<usize> = (0..STEPS).filter(|&k| locator.locate(at(k)).is_some()).collect();
        // The face lies between the last point inside and the next outside (first and the one
        // before, for a tunnel): found by halving.
        let (mut inner, mut outer) = if self.is_tunnel() {
            let first = *inside.first()?;
            (at(first), at(first.checked_sub(1)?))
        } else {
            let last = *inside.last()?;
            (at(last), at(last + 1))
        };
        for _ in 0..40 {
            let middle = 0.5 * (inner + outer);
            if locator.locate(middle).is_some() { inner = middle } else { outer = middle }
        }
        let into = if self.is_tunnel() { outwards } else { -outwards };
        locator.locate(inner + into * depth.max(1e-6)).or_else(|| locator.locate(inner))
    }
}
