//! What the regions of a member are made of, and since when.

use intrados_scene::{
    Assembly, Scene,
    structure::{Body as Shape, Cement as Written, Code as Rules, GroundModel},
};

use super::{
    Draft, MemberError, STRIKE,
    body::{CUSHION, GROUND, JOINT, PIPE, PIPE_CUSHION, RING_JOINT, SEGMENTS},
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
/// Structural steel (EN 1993-1-1, 3.2.6).
const PIPE_STEEL: Elastic =
    Elastic { modulus: 210e9, poisson: 0.3, expansion: 1.2e-5, density: 7850.0 };
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
            PIPE | PIPE_CUSHION => self.piped(region, normal),
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

    /// The wall of a tunnel's steel pipe, or the soft layer about it; without one steel lies on
    /// concrete, whose contact is as stiff as that of joints (`bare`, Pa/m).
    fn piped(&self, region: &str, bare: f64) -> Body {
        let Some(pipe) = self.pipe() else {
            return Body { matter: Matter::Elastic(PIPE_STEEL), birth: 0.0 };
        };
        let last = self.member.pours.iter().map(|p| f64::from(p.at_days) * DAY);
        let bears = last.reduce(f64::max).unwrap_or(0.0) + STRIKE;
        let birth = pipe.at_days.map_or(bears, |days| f64::from(days) * DAY);
        let [thickness, cushion] =
            [pipe.thickness_mm, pipe.cushion_mm].map(|mm| f64::from(mm) / 1000.0);
        let normal = match cushion {
            0.0 => bare,
            cushion => f64::from(pipe.cushion_mpa) * 1e6 / cushion,
        };
        let matter = match region {
            PIPE => Matter::Shell { elastic: PIPE_STEEL, thickness },
            _ => Matter::Joint(Friction {
                normal,
                shear: 0.3 * normal,
                friction: CUSHION_FRICTION,
                cohesion: 0.0,
            }),
        };
        Body { matter, birth }
    }

    /// A part that is poured on the site.
    fn poured(&mut self, region: &str) -> Result<Body, MemberError> {
        if let Some(matter) = elastic(self.member) {
            self.notes.extend(self.member.matter.as_ref().map(|m| {
                format!(
                    "{} is elastic, alike in all directions ({} GPa, {} kg/m³): its creep, its joints and what is weaker across a grain are not computed",
                    m.name, m.modulus_gpa, m.density_kg_m3
                )
            }));
            return Ok(Body { matter: Matter::Elastic(matter.law), birth: f64::NEG_INFINITY });
        }
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

/// An elastic material, and what it bears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticMatter {
    /// Its law.
    pub law: Elastic,
    /// Tension that it bears, Pa.
    pub strength: f64,
}

/// The matter of an assembly that is computed as elastic; none: it is computed as concrete.
#[must_use]
pub fn elastic(assembly: &Assembly) -> Option<ElasticMatter> {
    let matter = assembly.matter.as_ref()?;
    let law = Elastic {
        modulus: f64::from(matter.modulus_gpa) * 1e9,
        poisson: f64::from(matter.poisson),
        expansion: f64::from(matter.expansion_1e6_k) * 1e-6,
        density: f64::from(matter.density_kg_m3),
    };
    Some(ElasticMatter { law, strength: f64::from(matter.strength_mpa?) * 1e6 })
}

/// What an assembly is like as long as nothing breaks: of its own matter, or of its concrete.
pub(crate) fn unbroken(scene: &Scene, assembly: &Assembly) -> Result<ElasticMatter, Error> {
    if let Some(matter) = elastic(assembly) {
        return Ok(matter);
    }
    let p = properties(scene, &assembly.concrete)?;
    let law = Elastic {
        modulus: p.modulus,
        poisson: p.poisson,
        expansion: p.expansion,
        density: p.density,
    };
    Ok(ElasticMatter { law, strength: p.fctm })
}

/// All that is known and assumed of a concrete by its name.
pub(crate) fn properties(scene: &Scene, name: &str) -> Result<Properties, Error> {
    let given = match scene.structure.concrete(name) {
        Some(c) => Given {
            code: match c.code {
                Rules::Ec2 => Code::Ec2,
                Rules::Mc2010 => Code::Mc2010,
            },
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
