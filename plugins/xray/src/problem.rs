//! Photons as an instance of the transport problem: x = (point, direction, energy), Φ the collision
//! density, K scattering and flight.
//!
//! The dual walk starts at the tube and carries photons; the primal walk starts at a pixel and
//! carries importance backward, its energy going up: a photon of E′ may have had any E = E′/(1 −
//! (E′/m_e c²)(1 − c)) up to the tube's voltage. Walks stand at collisions. A walk from the tube is
//! linked with the panel, and finds it by leaving the specimen as well (analog); a walk from the
//! panel is linked with the focal spot, whose spectrum is known at the one energy that the angle
//! asks for, and never hits it by itself.
//!
//! A reading is what the response makes of scattered photons, per m² of the pixel and emitted
//! photon. Order n of the Neumann series is n collisions; order 0, the primary, is exact elsewhere
//! (`crate::primary`) and left out here.

use std::{f64::consts::TAU, ops::Range};

use glam::DVec3;
use intrados_stage::random::{Draw, Key};
use intrados_transport::prelude::*;

use crate::{
    physics::{Backward, CUT, Cross, Forward, Matter, energy_before, klein_nishina_total, ratio},
    scanner::Scanner,
    specimen::Specimen,
};

/// Numbers of the random numbers of flights and of ways, apart from those of copies.
pub(crate) const FLIGHT: u32 = 1 << 20;
pub(crate) const WAY: u32 = (1 << 20) + 1;

/// Where a photon is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Place {
    /// At the tube or at the panel.
    #[default]
    Start,
    /// At a collision, in a label.
    Collision(u8),
    /// Away: it has left the specimen.
    Away,
}

/// The next flight, if it has been drawn already.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum Plan {
    /// It has not.
    #[default]
    Free,
    /// To a collision after so many metres in a label.
    Collide(f64, u8),
    /// Out of the specimen.
    Leave,
}

/// One walk.
#[derive(Debug, Clone, Copy, Default)]
pub struct Photon {
    /// Where it is; away: where it was last.
    pub(crate) at: DVec3,
    /// The way of the walk that led here, unit; against the photon's for walks from the panel.
    pub(crate) way: DVec3,
    /// keV.
    pub(crate) kev: f64,
    /// Pixel (walks from the panel).
    pub(crate) bin: u32,
    pub(crate) place: Place,
    /// Collisions so far.
    pub(crate) collisions: u32,
    /// Of its next flight.
    key: Key,
    pub(crate) plan: Plan,
    /// What drawing it has brought into the weight.
    pub(crate) flown: f64,
    /// Cell of the field that steers it.
    pub(crate) cell: u32,
}

/// Columns of photon walks.
#[derive(Debug, Default)]
pub struct PhotonStates {
    pub(crate) photons: Vec<Photon>,
    /// Where the last links went, by row.
    pub(crate) targets: Vec<DVec3>,
}

impl States for PhotonStates {
    fn gather(&mut self, rows: &[u32]) {
        keep(&mut self.photons, rows);
    }

    fn repeat(&mut self, rows: &[u32]) {
        spread(&mut self.photons, rows);
    }
}

/// A way on from an event, drawn from the kernel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way {
    pub(crate) at: DVec3,
    pub(crate) way: DVec3,
    pub(crate) kev: f64,
    /// K/p.
    pub(crate) factor: f64,
}

/// A link of a collision with the other end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Joint {
    /// Unit, and m.
    pub(crate) way: DVec3,
    pub(crate) distance: f64,
    /// Cosine of the angle at the collision.
    pub(crate) c: f64,
    /// What Compton's and Rayleigh's bring over `scale`, and the energies along the way, keV.
    pub(crate) values: [f64; 2],
    pub(crate) kev: [f64; 2],
    /// The photon's energy before Compton's, keV (Rayleigh's has one energy).
    pub(crate) before: f64,
    scale: f64,
}

/// The transport problem of one specimen in one scanner.
#[derive(Debug)]
pub struct PhotonProblem<'a> {
    pub(crate) specimen: &'a Specimen,
    pub(crate) scanner: &'a Scanner,
    /// Pixels that a collision of a dual walk is linked with, each one of its share of the panel.
    links: usize,
    /// Lowest and highest energy of walks, keV.
    pub(crate) energies: [f64; 2],
    /// Bounding sphere of the specimen.
    ball: (DVec3, f64),
}

impl<'a> PhotonProblem<'a> {
    /// The problem of `specimen` in `scanner`.
    #[must_use]
    pub fn new(specimen: &'a Specimen, scanner: &'a Scanner) -> Self {
        let [low, high] = specimen.bounds();
        let ball = (0.5 * (low + high), 0.5 * (high - low).length());
        Self { specimen, scanner, links: 1, energies: [CUT, scanner.spectrum.top()], ball }
    }

    /// The same with so many links from every collision of a walk from the tube, for panels of many
    /// pixels.
    #[must_use]
    pub fn linked(self, links: usize) -> Self {
        Self { links: links.clamp(1, (self.scanner.panel.len() as usize).min(64)), ..self }
    }

    pub(crate) fn label(photon: &Photon) -> Option<u8> {
        if let Place::Collision(label) = photon.place { Some(label) } else { None }
    }

    /// The way from the start of a walk, whose direction and energy come from three random numbers.
    pub(crate) fn depart(&self, side: Side, bin: u32, [a, b, e]: [f64; 3], draw: &mut Draw) -> Way {
        match side {
            Side::Dual => {
                let (way, factor) = self.scanner.emit([a, b]);
                Way {
                    at: self.scanner.spot([draw.unit(), draw.unit()]),
                    way,
                    kev: self.scanner.spectrum.sample(e),
                    factor,
                }
            }
            Side::Primal => {
                // A point of the pixel, any energy, a direction within the cone around the
                // specimen.
                let panel = &self.scanner.panel;
                let at = panel.place(bin, [draw.unit(), draw.unit()]);
                let [low, high] = self.energies;
                let kev = low + (high - low) * e;
                let (centre, radius) = self.ball;
                let toward = centre - at;
                let sin2 = radius * radius / toward.length_squared();
                let least = if sin2 < 1.0 { (1.0 - sin2).sqrt() } else { 0.0 };
                let c = least + (1.0 - least) * a;
                let axis = if sin2 < 1.0 { toward.normalize() } else { -panel.normal() };
                let way = turned(axis, c, TAU * b);
                let cos = -way.dot(panel.normal());
                let factor = if cos > 0.0 {
                    panel.response.of(kev, cos) * cos * TAU * (1.0 - least) * (high - low)
                } else {
                    0.0
                };
                Way { at, way, kev, factor }
            }
        }
    }

    /// Values of the third of those numbers for `count` equal steps of energy, from 0 to 1.
    pub(crate) fn energy_numbers(&self, side: Side, count: usize) -> Vec<f64> {
        let [low, high] = self.energies;
        let number = |i: usize| match side {
            _ if i == 0 => 0.0,
            _ if i == count => 1.0,
            Side::Primal => i as f64 / count as f64,
            Side::Dual => self.scanner.spectrum.below(low + (high - low) * i as f64 / count as f64),
        };
        (0..=count).map(number).collect()
    }

    /// The kernel at a collision in `label`.
    pub(crate) fn turn(&self, side: Side, label: u8, kev: f64) -> Turn<'_> {
        let matter = self.specimen.matter(label);
        let cross = matter.cross(kev);
        let law = match side {
            Side::Dual => Law::Forward(Forward::new(kev)),
            Side::Primal => Law::Backward(Backward::new(kev, self.energies[1])),
        };
        let compton = match law {
            Law::Forward(_) => cross.compton,
            // What is drawn from is larger than the adjoint kernel, by about so much.
            Law::Backward(back) => cross.compton * back.total / klein_nishina_total(kev),
        };
        Turn { matter, cross, law, compton, energies: self.energies, kev }
    }

    /// Natural survival probability at a collision.
    pub(crate) fn survival(&self, side: Side, label: u8, kev: f64) -> f64 {
        self.turn(side, label, kev).survival()
    }

    /// The free flight from `from`: where it collides next.
    pub(crate) fn flight(&self, at: DVec3, way: DVec3, kev: f64, key: Key) -> Option<(f64, u8)> {
        let mut draw = Draw::new(key);
        self.specimen.fly(&self.specimen.local(kev), at, way, || draw.unit())
    }

    /// The link of a collision with a point of the panel (walks from the tube) or of the focal
    /// spot.
    #[inline]
    pub(crate) fn joint(&self, side: Side, label: u8, photon: &Photon, p: DVec3) -> Option<Joint> {
        let d = p - photon.at;
        let distance = d.length();
        let way = d / distance;
        let (matter, kev, c) = (self.specimen.matter(label), photon.kev, photon.way.dot(way));
        let cross = matter.cross(kev);
        let (geometry, values, kev, before) = match side {
            Side::Dual => {
                let cos = way.dot(self.scanner.panel.normal());
                if cos <= 0.0 {
                    return None;
                }
                let after = kev * ratio(kev, c);
                let response = |kev| self.scanner.panel.response.of(kev, cos);
                let compton = if after < self.energies[0] {
                    0.0
                } else {
                    cross.compton * matter.compton_pdf(kev, c) * response(after)
                };
                let rayleigh = cross.rayleigh * matter.rayleigh_pdf(kev, c) * response(kev);
                (cos, [compton, rayleigh], [after, kev], kev)
            }
            Side::Primal => {
                let intensity = self.scanner.intensity(-way);
                if intensity <= 0.0 {
                    return None;
                }
                let spectrum = &self.scanner.spectrum;
                let before = energy_before(kev, c);
                let density =
                    if before < self.energies[1] { spectrum.density(before) } else { 0.0 };
                let compton = if density > 0.0 {
                    compton_back(matter, kev, before, c) * density
                } else {
                    0.0
                };
                let rayleigh = cross.rayleigh * matter.rayleigh_pdf(kev, c) * spectrum.density(kev);
                (intensity, [compton, rayleigh], [before, kev], before)
            }
        };
        Some(Joint {
            way,
            distance,
            c,
            values,
            kev,
            before,
            scale: geometry / (distance * distance * cross.total()),
        })
    }

    /// What it finds, the share of the panel that `p` stands for apart.
    pub(crate) fn joined(&self, side: Side, label: u8, photon: &Photon, p: DVec3) -> f64 {
        let through =
            |j: Joint| self.through(photon.at, j.way, j.distance, j.values, j.kev) * j.scale;
        self.joint(side, label, photon, p).map_or(0.0, through)
    }

    /// Σ value·transmission of two energies along one way.
    fn through(
        &self,
        at: DVec3,
        way: DVec3,
        distance: f64,
        values: [f64; 2],
        kev: [f64; 2],
    ) -> f64 {
        if values[0] + values[1] <= 0.0 {
            return 0.0;
        }
        let local =
            kev.map(|e| self.specimen.local(if e.is_finite() { e } else { self.energies[1] }));
        let mut depth = [0.0; 2];
        self.specimen.trace(at, way, 0.0, distance, |label, a, b| {
            depth[0] += local[0][label as usize] * (b - a);
            depth[1] += local[1][label as usize] * (b - a);
            true
        });
        values[0] * (-depth[0]).exp() + values[1] * (-depth[1]).exp()
    }
}

/// The kernel at one collision: where photons of one energy go, or came from.
pub(crate) struct Turn<'m> {
    matter: &'m Matter,
    cross: Cross,
    law: Law,
    /// What of Compton is drawn from, over ρ.
    compton: f64,
    energies: [f64; 2],
    kev: f64,
}

/// Angles of Compton scattering, by side.
#[derive(Clone, Copy)]
enum Law {
    Forward(Forward),
    Backward(Backward),
}

/// A change of direction.
pub(crate) struct Bend {
    pub(crate) cosine: f64,
    /// Energy after it.
    pub(crate) kev: f64,
    /// K/p.
    pub(crate) factor: f64,
}

impl Turn<'_> {
    /// Size of the kernel over the attenuation, rough on the way back.
    pub(crate) fn survival(&self) -> f64 {
        ((self.compton + self.cross.rayleigh) / self.cross.total()).min(1.0)
    }

    /// A change of direction from uniform numbers: `kind` says whether it is Compton's or
    /// Rayleigh's.
    #[inline]
    pub(crate) fn draw(&self, kind: f64, draw: &mut Draw) -> Bend {
        let all = self.compton + self.cross.rayleigh;
        let (matter, total) = (self.matter, self.cross.total());
        let (cosine, kev, factor) = if kind * all >= self.compton {
            (matter.rayleigh_sample(self.kev, draw), self.kev, all / total)
        } else {
            match &self.law {
                Law::Forward(photons) => {
                    let c = matter.compton_sample(photons, draw);
                    (c, self.kev * ratio(self.kev, c), all / total)
                }
                Law::Backward(back) => {
                    let c = back.sample(draw);
                    let before = energy_before(self.kev, c).min(self.energies[1]);
                    let density = self.compton / all * back.density(c) * total;
                    (c, before, compton_back(matter, self.kev, before, c) / density)
                }
            }
        };
        Bend { cosine, kev, factor: if kev < self.energies[0] { 0.0 } else { factor } }
    }
}

/// The adjoint Compton kernel per sr and mass: Σ_C(E) p(c|E) dE/dE′, with k = E′/E, dE/dE′ = 1/k².
fn compton_back(matter: &Matter, kev: f64, before: f64, c: f64) -> f64 {
    let k = kev / before;
    matter.cross(before).compton * matter.compton_pdf(before, c) / (k * k)
}

/// `way` turned by the angle of cosine `c`, in the azimuth `phi`.
#[inline]
pub(crate) fn turned(way: DVec3, c: f64, phi: f64) -> DVec3 {
    let (a, b) = way.any_orthonormal_pair();
    let (sin, cos) = phi.sin_cos();
    tilted(way, cos * a + sin * b, c).normalize()
}

/// `way` turned by the angle of cosine `c` toward `side`, a unit vector across it.
#[inline]
pub(crate) fn tilted(way: DVec3, side: DVec3, c: f64) -> DVec3 {
    c * way + (1.0 - c * c).max(0.0).sqrt() * side
}

impl TransportProblem for PhotonProblem<'_> {
    type Value = f64;
    type States = PhotonStates;

    fn channels(&self, side: Side) -> usize {
        if side == Side::Dual { self.links } else { 1 }
    }

    fn bins(&self) -> usize {
        self.scanner.panel.len() as usize
    }

    /// Walks from the panel go through its pixels in order.
    fn start(&self, side: Side, walks: Range<u64>, keys: &[Key], states: &mut PhotonStates) {
        states.photons.clear();
        states.photons.resize(keys.len(), Photon { flown: 1.0, ..Photon::default() });
        if side == Side::Primal {
            for (photon, walk) in states.photons.iter_mut().zip(walks) {
                photon.bin = (walk % u64::from(self.scanner.panel.len())) as u32;
            }
        }
    }

    fn arrive(
        &self,
        side: Side,
        channel: usize,
        states: &PhotonStates,
        ends: &mut Ends<f64>,
    ) -> bool {
        if side == Side::Primal || channel > 0 {
            return false;
        }
        let panel = &self.scanner.panel;
        let mut found = false;
        for (i, photon) in states.photons.iter().enumerate() {
            if photon.place != Place::Away || photon.collisions == 0 {
                continue;
            }
            if let Some((bin, cos)) = panel.met(photon.at, photon.way) {
                found = true;
                ends.value[i] = panel.response.of(photon.kev, cos) / panel.area();
                ends.bin[i] = bin;
                // The panel stands off the specimen, so that links have no pole and are as good
                // everywhere: they take all.
                (ends.kernel_density[i], ends.link_density[i]) = (1.0, f64::INFINITY);
            }
        }
        found
    }

    fn link(
        &self,
        side: Side,
        channel: usize,
        event: u32,
        keys: &[Key],
        states: &mut PhotonStates,
        links: &mut Links<f64>,
    ) -> bool {
        if event == 0 {
            return false;
        }
        let first = dimension(event, 8 + 4 * channel as u32);
        let pixels = self.scanner.panel.len() as usize;
        let (from, to) = (channel * pixels / self.links, (channel + 1) * pixels / self.links);
        states.targets.resize(states.photons.len(), DVec3::ZERO);
        for (i, photon) in states.photons.iter().enumerate() {
            let Some(label) = Self::label(photon) else { continue };
            let u: [f64; 3] = [0, 1, 2].map(|k| f64::from(keys[i].unit(first + k)));
            links.link_density[i] = f64::INFINITY;
            let (bin, target, share) = if side == Side::Primal {
                (photon.bin, self.scanner.spot([u[1], u[2]]), 1.0)
            } else {
                let bin = (from + ((to - from) as f64 * u[0]) as usize) as u32;
                (bin, self.scanner.panel.place(bin, [u[1], u[2]]), (to - from) as f64)
            };
            links.bin[i] = bin;
            links.value[i] = share * self.joined(side, label, photon, target);
            states.targets[i] = target;
        }
        true
    }

    /// Links know already what stands in their way.
    fn reveal(&self, _: Side, _: &mut PhotonStates, _: &mut Links<f64>) {}

    fn scatter(
        &self,
        side: Side,
        event: u32,
        keys: &[Key],
        states: &mut PhotonStates,
        steps: &mut Steps<f64>,
    ) {
        for (i, photon) in states.photons.iter_mut().enumerate() {
            let mut draw = Draw::new(keys[i].split(event, WAY));
            let way = match photon.place {
                Place::Start => {
                    let numbers = [draw.unit(), draw.unit(), draw.unit()];
                    self.depart(side, photon.bin, numbers, &mut draw)
                }
                Place::Collision(label) => {
                    let turn = self.turn(side, label, photon.kev);
                    steps.survival[i] = turn.survival();
                    let kind = draw.unit();
                    let Bend { cosine, kev, factor } = turn.draw(kind, &mut draw);
                    Way {
                        at: photon.at,
                        way: turned(photon.way, cosine, TAU * draw.unit()),
                        kev,
                        factor,
                    }
                }
                Place::Away => continue,
            };
            steps.factor[i] = way.factor;
            photon.go(&way, keys[i].split(event, FLIGHT));
        }
    }

    fn fly(&self, _: Side, states: &mut PhotonStates) {
        for photon in &mut states.photons {
            let met = match std::mem::take(&mut photon.plan) {
                Plan::Free => self.flight(photon.at, photon.way, photon.kev, photon.key),
                Plan::Collide(distance, label) => Some((distance, label)),
                Plan::Leave => None,
            };
            photon.place = match met {
                Some((distance, label)) => {
                    photon.at += distance * photon.way;
                    photon.collisions += 1;
                    Place::Collision(label)
                }
                None => Place::Away,
            };
        }
    }
}

impl Photon {
    pub(crate) fn go(&mut self, way: &Way, key: Key) {
        (self.at, self.way, self.kev, self.key) = (way.at, way.way, way.kev, key);
        self.flown = 1.0;
    }
}
