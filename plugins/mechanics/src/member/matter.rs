//! What the regions of a member are made of, and since when.

use intrados_scene::{
    Scene,
    structure::{Body as Shape, Cement as Written, GroundModel},
};

use super::{
    Draft, MemberError, STRIKE,
    body::{CUSHION, GROUND, JOINT, RING_JOINT, SEGMENTS},
};
use crate::{
    element::interface::Friction,
    material::{
        DAY, Error,
        concrete::{Cement, Class, Code, Given, Properties},
        creep::Creep,
        law::{Cracks, Setting},
    },
    model::{Body, Elastic, Matter},
};

/// Stiffness of a cushion layer, Pa: a plastic membrane (a few tens of MPa); tests on the product
/// should replace it.
const CUSHION_MODULUS: f64 = 50e6;
/// Friction of a cushion layer.
const CUSHION_FRICTION: f64 = 0.2;
/// Age of precast segments when they are built in, s.
const PRECAST: f64 = 90.0 * DAY;

impl Draft<'_> {
    /// One body a region.
    pub(super) fn give_matter(&mut self) -> Result<(), MemberError> {
        let regions = self.model.mesh.regions.clone();
        let mut bodies = Vec::with_capacity(regions.len());
        for region in &regions {
            bodies.push(self.body(region)?);
        }
        self.model.bodies = bodies;
        Ok(())
    }

    fn body(&mut self, region: &str) -> Result<Body, MemberError> {
        let always = |matter| Body { matter, birth: f64::NEG_INFINITY };
        let Some(Shape::Tunnel { segments, cushion_mm, ground, .. }) = &self.member.body else {
            return self.poured(region);
        };
        let joint = segments.as_ref().map(|s| s.joint.clone()).unwrap_or_default();
        let normal = f64::from(joint.stiffness_gpa_m) * 1e9;
        let dry = Friction {
            normal,
            shear: 0.5 * normal,
            friction: f64::from(joint.friction),
            cohesion: 0.0,
        };
        Ok(match region {
            JOINT | RING_JOINT => always(Matter::Joint(dry)),
            CUSHION => {
                let thick = f64::from(*cushion_mm) / 1000.0;
                let normal = if thick > 0.0 { CUSHION_MODULUS / thick } else { normal };
                always(Matter::Joint(Friction {
                    normal,
                    shear: 0.3 * normal,
                    friction: CUSHION_FRICTION,
                    cohesion: 0.0,
                }))
            }
            GROUND => {
                let Some(GroundModel::Solid { youngs_mpa, poisson, .. }) =
                    ground.as_ref().map(|g| &g.model)
                else {
                    return Err(self.unsupported("a region of ground without solid ground"));
                };
                let law = Elastic {
                    modulus: f64::from(*youngs_mpa) * 1e6,
                    poisson: f64::from(*poisson),
                    expansion: 0.0,
                    density: 0.0,
                };
                always(Matter::Elastic(law))
            }
            SEGMENTS => {
                let class = segments
                    .as_ref()
                    .and_then(|s| s.concrete.as_deref())
                    .unwrap_or(&self.member.concrete);
                let matter = self.concrete(class)?;
                Body { matter, birth: self.begin() - PRECAST }
            }
            _ => self.poured(region)?,
        })
    }

    /// A part that is poured on the site.
    fn poured(&mut self, region: &str) -> Result<Body, MemberError> {
        let class = &self.member.concrete;
        let pour = match region.rsplit_once("/pour ") {
            Some((_, number)) => {
                number.parse::<usize>().ok().and_then(|n| self.member.pours.get(n - 1))
            }
            None => self.member.pours.first(),
        };
        let birth = pour.map_or(0.0, |p| f64::from(p.at_days) * DAY);
        Ok(Body { matter: self.concrete(class)?, birth })
    }

    /// When its first part is poured, s.
    pub(super) fn birth(&self) -> f64 {
        self.member.pours.iter().map(|p| f64::from(p.at_days) * DAY).reduce(f64::min).unwrap_or(0.0)
    }

    /// When the member begins to bear, s: the forms of the first pour are struck in a tunnel, whose
    /// ring holds the others; a beam's falsework stands until the last one is old enough.
    pub(super) fn begin(&self) -> f64 {
        let days = self.member.pours.iter().map(|p| f64::from(p.at_days));
        let pour = if self.is_tunnel() { days.reduce(f64::min) } else { days.reduce(f64::max) };
        pour.unwrap_or(0.0) * DAY + STRIKE
    }

    /// A concrete by its name: a class, or one of the scene's own.
    fn concrete(&mut self, name: &str) -> Result<Matter, MemberError> {
        let properties = properties(self.scene, name)
            .map_err(|source| MemberError::Material { id: self.id(), source })?;
        let note = format!(
            "concrete {name}: {}",
            properties
                .assumed
                .iter()
                .map(|a| format!("{} {:.4e} by {}", a.quantity, a.value, a.source))
                .collect::<Vec<_>>()
                .join("; ")
        );
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
        let humidity = f64::from(self.scene.structure.climate.humidity_percent) / 100.0;
        let creep = Creep::new(properties.clone(), humidity, self.notional_size());
        let creep = creep.map_err(|source| MemberError::Material { id: self.id(), source })?;
        // One damage for all directions leaves a brick that is cracked through without hold: beams
        // break in shear that they bear (see docs/experiments.md).
        let setting = Setting { cracks: Cracks::Planes, ..Setting::long_term(0.1, creep) };
        Ok(Matter::Concrete(Box::new((properties, setting))))
    }

    /// h₀ = 2 A/u of the section, from the mesh: 2 V over the surface that is not an end, m.
    fn notional_size(&self) -> f64 {
        let mesh = &self.model.mesh;
        let along = self.axes.unit[2];
        let side: f64 = mesh
            .outer_faces()
            .into_iter()
            .map(|face| mesh.face_middle(face).1)
            .filter(|normal| normal.dot(along).abs() < 0.5 * normal.length())
            .map(glam::DVec3::length)
            .sum();
        2.0 * mesh.volume() / side.max(1e-9)
    }
}

/// All that is known and assumed of a concrete by its name.
pub(crate) fn properties(scene: &Scene, name: &str) -> Result<Properties, Error> {
    let given = match scene.structure.concrete(name) {
        Some(c) => Given {
            code: Code::Ec2,
            fck: Some(f64::from(c.fck_mpa) * 1e6),
            fcm: c.fcm_mpa.map(|v| f64::from(v) * 1e6),
            fctm: c.fctm_mpa.map(|v| f64::from(v) * 1e6),
            modulus: c.ecm_gpa.map(|v| f64::from(v) * 1e9),
            poisson: c.poisson.map(f64::from),
            density: c.density_kg_m3.map(f64::from),
            fracture_energy: c.fracture_n_m.map(f64::from),
            cement: Some(match c.cement {
                Written::S => Cement::S,
                Written::N => Cement::N,
                Written::R => Cement::R,
            }),
            ..Given::default()
        },
        None => Given::from(name.parse::<Class>()?),
    };
    given.complete()
}
