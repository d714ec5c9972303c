//! What voids, cracks and lost steel do to projections.
//!
//! A damage mixes another matter, or nothing, into a piece of the specimen: Σ → Σ + d s (Σ′ − Σ),
//! attenuation and scattering alike. The primary of a pixel is known in closed form, and so is what
//! damage does to it,
//!
//! ```text
//! P = ∫ S(E) e^{−τ(E)} dE        ∂P/∂d_j = −∫ S(E) e^{−τ(E)} s_j ∫_j (Σ′ − Σ)(E) ds dE
//! ```
//!
//! Scatter comes by walks through the sound specimen, a [`SensitivityTally`] at their side: flights
//! through the piece take e^{−Δτ}, collisions in it the ratio of what scatters that way at that
//! energy, links both. The walk from the tube is the flux up to the damage and finds the importance
//! from there on, the walk from the panel the other way round: both give ⟨Φ*, ∂K Φ⟩.
//!
//! Not covered: matter where there was none (no walk collides there), and a focal spot's blur of
//! the primary.

mod section;

pub use section::{Planted, section};

use glam::DVec3;
use intrados_stage::{Cancelled, Job};
use intrados_transport::{
    Change, Links, Perturbed, Sensitivities, SensitivityTally, Side, TransportProblem,
    WalkObserver, WalkRule, differentiate, severity,
};
use rayon::prelude::*;

use crate::{
    physics::Matter,
    primary::Lines,
    problem::{Joint, Photon, PhotonProblem, PhotonStates},
    scanner::{Response, Scanner},
    specimen::{Local, PALETTE, Shape, Specimen},
    steer::{Guide, rule},
};

/// A piece of the specimen that becomes something else.
#[derive(Debug, Clone)]
pub struct Fault {
    /// The body that changes.
    pub shape: Shape,
    /// The only label that it takes; `None`: every one.
    pub of: Option<u8>,
    /// Which share of the piece is damaged where damage is whole, 0 to 1: of a crack its width over
    /// that of the piece, of a bar what has gone of its section.
    pub share: f64,
    /// What is there then, each with its kg/m³; none: nothing.
    pub becomes: Vec<(Matter, f64)>,
}

impl Fault {
    /// Nothing within `shape`.
    #[must_use]
    pub fn void(shape: Shape) -> Self {
        Self { shape, of: None, share: 1.0, becomes: Vec::new() }
    }

    fn takes(&self, label: u8) -> bool {
        self.of.is_none_or(|of| of == label)
    }

    /// Attenuation of what it becomes, 1/m.
    fn total(&self, kev: f64) -> f64 {
        self.becomes.iter().map(|(matter, density)| density * matter.total(kev)).sum()
    }

    /// Metres of every label of `specimen` that it takes of a way between two distances.
    fn lengths(
        &self,
        specimen: &Specimen,
        origin: DVec3,
        way: DVec3,
        from: f64,
        to: f64,
    ) -> Option<[f64; PALETTE]> {
        let [a, b] = self.shape.crossed(origin, way)?;
        let (a, b) = (a.max(from), b.min(to));
        if a >= b {
            return None;
        }
        let mut lengths = [0.0; PALETTE];
        specimen.trace(origin, way, a, b, |label, s, t| {
            if self.takes(label) && specimen.density(label) > 0.0 {
                lengths[label as usize] += t - s;
            }
            true
        });
        Some(lengths)
    }

    /// s ∫ (Σ′ − Σ) ds over these.
    fn depth(&self, lengths: &[f64; PALETTE], local: &Local, kev: f64) -> f64 {
        let becomes = self.total(kev);
        self.share
            * lengths
                .iter()
                .zip(local)
                .map(|(l, mu)| if *l > 0.0 { l * (becomes - mu) } else { 0.0 })
                .sum::<f64>()
    }
}

/// The projection of a specimen as its faults grow from nothing (0) to whole (1). Faults in one
/// place must not sum up to more than one.
#[derive(Debug)]
pub struct FaultyScan<'a> {
    /// What is looked through.
    pub specimen: &'a Specimen,
    /// Tube and panel; every pixel is a reading.
    pub scanner: &'a Scanner,
    /// Damages.
    pub faults: Vec<Fault>,
    /// From which side scatter is walked.
    pub side: Side,
    /// How it scores; by links.
    pub rule: WalkRule,
    /// Pixels that a collision of a walk from the tube is linked with.
    pub links: usize,
    /// Seed.
    pub seed: u64,
    /// Walks of scatter: from the tube in all, from the panel for each pixel. 0: the primary alone.
    pub walks: u64,
    /// What steers them.
    pub guide: Option<&'a Guide>,
    /// The work.
    pub job: Job,
}

impl<'a> FaultyScan<'a> {
    /// Unsteered walks from the tube.
    #[must_use]
    pub fn new(
        specimen: &'a Specimen,
        scanner: &'a Scanner,
        faults: Vec<Fault>,
        walks: u64,
        seed: u64,
    ) -> Self {
        Self {
            specimen,
            scanner,
            faults,
            side: Side::Dual,
            rule: rule(),
            links: 1,
            seed,
            walks,
            guide: None,
            job: Job::default(),
        }
    }

    /// Of the primary, exactly; the same units as [`crate::primary::primary`].
    #[must_use]
    pub fn primary(&self, damage: &[f64]) -> Sensitivities {
        let of = |rays: &Rays, p: DVec3| {
            let (mut sum, mut slopes) = (0.0, vec![0.0; self.faults.len()]);
            rays.behind(p, false, |_, passed, depths| {
                let passed = passed
                    * (-depths.iter().map(|(j, depth)| damage[*j] * depth).sum::<f64>()).exp();
                sum += passed;
                depths.iter().for_each(|(j, depth)| slopes[*j] -= passed * depth);
            });
            (sum, slopes)
        };
        let (readings, by_damage) = self.pixels(of).into_iter().unzip();
        Sensitivities::exact(readings, by_damage)
    }

    /// What each fault, whole and alone, makes of the primary: no first order, since a void may let
    /// many times more through. Pixels that none meets are left out.
    #[must_use]
    pub fn shadows(&self) -> Vec<Shadow> {
        let counting = matches!(self.scanner.panel.response, Response::Counting);
        let of = |rays: &Rays, p: DVec3| {
            let mut shadow = Shadow { pixel: 0, signal: 0.0, square: 0.0, changes: Vec::new() };
            rays.behind(p, true, |kev, passed, depths| {
                shadow.signal += passed;
                // A photon is taken whole or not at all.
                shadow.square += passed * if counting { 1.0 } else { kev };
                shadow.changes.resize(depths.len(), (0, 0.0));
                for (change, (j, depth)) in shadow.changes.iter_mut().zip(depths) {
                    *change = (*j, change.1 + passed * (-depth).exp_m1());
                }
            });
            shadow
        };
        let numbered =
            self.pixels(of).into_iter().zip(0..).map(|(shadow, pixel)| Shadow { pixel, ..shadow });
        numbered.filter(|shadow| !shadow.changes.is_empty()).collect()
    }

    /// Something of the middle of every pixel, in order.
    fn pixels<T: Send>(&self, of: impl Fn(&Rays, DVec3) -> T + Sync) -> Vec<T> {
        let rays = Rays::new(self);
        (0..self.scanner.panel.len())
            .into_par_iter()
            .map(|bin| of(&rays, self.scanner.panel.place(bin, [0.5; 2])))
            .collect()
    }

    /// Of scatter, by walks.
    ///
    /// # Errors
    /// [`Cancelled`] soon after the job was.
    pub fn scatter(&self, damage: &[f64]) -> Result<Sensitivities, Cancelled> {
        let plain = || {
            PhotonProblem::new(self.specimen, self.scanner).linked(if self.side == Side::Dual {
                self.links
            } else {
                1
            })
        };
        let problem = plain();
        let size = [self.scanner.panel.len() as usize, self.faults.len()];
        let walks = if self.side == Side::Dual { self.walks } else { self.walks * size[0] as u64 };
        let severity: Vec<f64> = damage
            .iter()
            .zip(&self.faults)
            .map(|(d, f)| severity(d * f.share) / f.share.max(f64::MIN_POSITIVE))
            .collect();
        let begin = || Crossings::new(&problem, self.side, &self.faults, &severity);
        let (shared, side) = (self.side == Side::Dual, self.side);
        match self.guide {
            Some(guide) => differentiate(
                &guide.steer(plain(), side),
                side,
                &self.rule,
                self.seed,
                0..walks,
                size,
                shared,
                begin,
                &self.job,
            ),
            None => differentiate(
                &problem,
                side,
                &self.rule,
                self.seed,
                0..walks,
                size,
                shared,
                begin,
                &self.job,
            ),
        }
    }
}

/// What faults make of the primary of a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Shadow {
    /// Number of the pixel.
    pub pixel: usize,
    /// Behind the sound specimen, as [`crate::primary::primary`].
    pub signal: f64,
    /// The same of the squares of what photons count: the variance of one emitted photon's signal.
    pub square: f64,
    /// Changes of the signal, by fault.
    pub changes: Vec<(usize, f64)>,
}

/// Rays from the tube to the panel.
struct Rays<'r> {
    scan: &'r FaultyScan<'r>,
    lines: Lines,
    /// Attenuation of what faults become, by fault and bin, 1/m.
    becomes: Vec<Vec<f64>>,
}

impl<'r> Rays<'r> {
    fn new(scan: &'r FaultyScan) -> Self {
        let lines = Lines::new(scan.specimen, scan.scanner);
        let becomes =
            scan.faults.iter().map(|f| lines.kev.iter().map(|&e| f.total(e)).collect()).collect();
        Self { scan, lines, becomes }
    }

    /// Calls `visit` with every energy, what of it the sound specimen lets through to a point of
    /// the panel, and s ∫ (Σ′ − Σ) ds of every fault that the ray meets; never, if only faults
    /// count and there is none.
    fn behind(
        &self,
        p: DVec3,
        only_faults: bool,
        mut visit: impl FnMut(f64, f64, &[(usize, f64)]),
    ) {
        let FaultyScan { specimen, scanner, faults, .. } = self.scan;
        let (way, distance) = ((p - scanner.source).normalize(), (p - scanner.source).length());
        let crossed = |(j, fault): (usize, &Fault)| {
            Some((j, fault.lengths(specimen, scanner.source, way, 0.0, distance)?))
        };
        let crossed: Vec<(usize, [f64; PALETTE])> =
            faults.iter().enumerate().filter_map(crossed).collect();
        if only_faults && crossed.is_empty() {
            return;
        }
        let (open, mut depths) = (scanner.open(p), Vec::new());
        self.lines.along(specimen, scanner, p, |bin, passed| {
            let depth = |&(j, ref lengths): &(usize, [f64; PALETTE])| {
                let met = lengths.iter().zip(&self.lines.mu).filter(|(l, _)| **l > 0.0);
                (
                    j,
                    faults[j].share
                        * met.map(|(l, mu)| l * (self.becomes[j][bin] - mu[bin])).sum::<f64>(),
                )
            };
            depths.clear();
            depths.extend(crossed.iter().map(depth));
            visit(self.lines.kev[bin], open * passed, &depths);
        });
    }
}

/// Readings: primary and scatter of every pixel, row by row.
impl Perturbed for FaultyScan<'_> {
    type Error = Cancelled;

    fn damages(&self) -> usize {
        self.faults.len()
    }

    /// By closed form and by the walks of the sound specimen, weighed for the damaged one.
    fn readings(&mut self, damage: &[f64]) -> Result<Vec<f64>, Cancelled> {
        Ok(self.sensitivities(damage)?.readings)
    }

    fn sensitivities(&mut self, damage: &[f64]) -> Result<Sensitivities, Cancelled> {
        let primary = self.primary(damage);
        if self.walks == 0 { Ok(primary) } else { Ok(primary.plus(&self.scatter(damage)?)) }
    }
}

/// Notes where photons cross faults and collide in them.
struct Crossings<'c> {
    ledger: SensitivityTally,
    problem: &'c PhotonProblem<'c>,
    side: Side,
    faults: &'c [Fault],
    damage: &'c [f64],
    /// By row: at the event, and leaving it.
    here: Vec<Photon>,
    gone: Vec<Photon>,
    /// By row what the link of now changes, and rows that nothing changes.
    links: Vec<Option<Change>>,
    linking: bool,
}

impl<'c> Crossings<'c> {
    fn new(problem: &'c PhotonProblem, side: Side, faults: &'c [Fault], damage: &'c [f64]) -> Self {
        let ledger = SensitivityTally::new(faults.len());
        Self {
            ledger,
            problem,
            side,
            faults,
            damage,
            here: Vec::new(),
            gone: Vec::new(),
            links: Vec::new(),
            linking: false,
        }
    }

    /// s (k′/k − 1) of every fault that a collision in `label` at `p` lies in, k what scatters by
    /// the cosine `c`: by Compton (from `before` keV) or by Rayleigh.
    fn ratios(&self, label: u8, p: DVec3, compton: bool, before: f64, c: f64) -> Vec<(u32, f64)> {
        let scatters = |matter: &Matter, density: f64| {
            let cross = matter.cross(before);
            density
                * if compton {
                    cross.compton * matter.compton_pdf(before, c)
                } else {
                    cross.rayleigh * matter.rayleigh_pdf(before, c)
                }
        };
        let specimen = self.problem.specimen;
        let within =
            self.faults.iter().enumerate().filter(|(_, f)| f.takes(label) && f.shape.contains(p));
        within
            .map(|(j, f)| {
                let after: f64 =
                    f.becomes.iter().map(|(matter, density)| scatters(matter, *density)).sum();
                let now = scatters(specimen.matter(label), specimen.density(label));
                (j as u32, f.share * if now > 0.0 { after / now - 1.0 } else { -1.0 })
            })
            .collect()
    }

    /// 1 + Σ d s (k′/k − 1), which damage in one place may not make 0.
    fn mixed(&self, ratios: &[(u32, f64)]) -> f64 {
        (1.0 + ratios.iter().map(|&(j, r)| self.damage[j as usize] * r).sum::<f64>()).max(1e-9)
    }

    /// Δτ of each fault that a way crosses.
    fn depths(&self, at: DVec3, way: DVec3, to: f64, kev: &[f64]) -> Vec<(u32, Vec<f64>)> {
        let specimen = self.problem.specimen;
        let crossed = |(j, f): (usize, &Fault)| {
            let lengths = f.lengths(specimen, at, way, 0.0, to)?;
            Some((
                j as u32,
                kev.iter().map(|&e| f.depth(&lengths, &specimen.local(e), e)).collect(),
            ))
        };
        self.faults.iter().enumerate().filter_map(crossed).collect()
    }

    /// The turn at a collision and the way to the next.
    fn step(&self, here: &Photon, gone: &Photon, landed: &Photon) -> Option<Change> {
        PhotonProblem::label(landed)?;
        let mut change = Change::default();
        if let Some(label) = PhotonProblem::label(here) {
            let before = if self.side == Side::Dual { here.kev } else { gone.kev };
            let ratios =
                self.ratios(label, here.at, gone.kev != here.kev, before, here.way.dot(gone.way));
            let mixed = self.mixed(&ratios);
            change.factor *= mixed;
            change.slopes.extend(ratios.iter().map(|&(j, r)| (j, r / mixed)));
        }
        for (j, depth) in
            self.depths(gone.at, gone.way, (landed.at - gone.at).length(), &[gone.kev])
        {
            change.factor *= (-self.damage[j as usize] * depth[0]).exp();
            change.slopes.push((j, -depth[0]));
        }
        (!change.slopes.is_empty()).then_some(change)
    }

    /// A link, whose two parts have turned and fly at energies of their own.
    fn join(&self, photon: &Photon, target: DVec3) -> Option<Change> {
        let label = PhotonProblem::label(photon)?;
        let Joint { way, distance, c, values, kev, before, .. } =
            self.problem.joint(self.side, label, photon, target)?;
        let ratios = [true, false].map(|compton| {
            self.ratios(label, photon.at, compton, if compton { before } else { photon.kev }, c)
        });
        let depths = self.depths(
            photon.at,
            way,
            distance,
            &kev.map(|e| if e.is_finite() { e } else { photon.kev }),
        );
        if ratios[0].is_empty() && depths.is_empty() {
            return None;
        }
        let (mut sound, mut sum, mut slopes) = (0.0, 0.0, vec![0.0; self.faults.len()]);
        for part in 0..2 {
            if values[part] <= 0.0 {
                continue;
            }
            let specimen = self.problem.specimen;
            let value = values[part]
                * (-specimen.depth(&specimen.local(kev[part]), photon.at, way, 0.0, distance))
                    .exp();
            let added: f64 = depths.iter().map(|(j, d)| self.damage[*j as usize] * d[part]).sum();
            let flown = value * (-added).exp();
            let mixed = self.mixed(&ratios[part]);
            sound += value;
            sum += flown * mixed;
            ratios[part].iter().for_each(|&(j, r)| slopes[j as usize] += flown * r);
            depths.iter().for_each(|(j, d)| slopes[*j as usize] -= flown * mixed * d[part]);
        }
        let slopes = slopes
            .into_iter()
            .zip(0..)
            .filter(|(s, _)| *s != 0.0)
            .map(|(s, j)| (j, s / sum))
            .collect();
        (sum > 0.0).then_some(Change { factor: sum / sound, slopes })
    }
}

impl From<Crossings<'_>> for SensitivityTally {
    fn from(crossings: Crossings) -> Self {
        crossings.ledger
    }
}

impl<P: TransportProblem<Value = f64, States = PhotonStates>> WalkObserver<P> for Crossings<'_> {
    fn begin(&mut self, n: usize) {
        self.ledger.begin(n);
        self.here.clear();
        self.here.resize(n, Photon::default());
    }

    fn follow(&mut self, rows: &[u32]) {
        self.ledger.follow(rows);
        self.here = rows.iter().map(|&row| self.here[row as usize]).collect();
    }

    fn depart(&mut self, _: u32, states: &PhotonStates, _: &[f64], _: &[f64]) {
        self.ledger.depart();
        self.gone.clone_from(&states.photons);
    }

    fn land(&mut self, _: u32, states: &PhotonStates, _: &[f64]) {
        self.linking = false;
        for (row, landed) in states.photons.iter().enumerate() {
            if let Some(change) = self.step(&self.here[row], &self.gone[row], landed) {
                self.ledger.arrive(row, &change);
            }
        }
        self.here.clone_from(&states.photons);
    }

    fn link(&mut self, _: u32, _: usize, states: &PhotonStates, links: &Links<f64>) {
        self.linking = true;
        let changes = states.photons.iter().zip(&states.targets).zip(&links.value);
        let changes = changes.map(
            |((photon, target), value)| {
                if *value > 0.0 { self.join(photon, *target) } else { None }
            },
        );
        self.links = changes.collect();
    }

    /// What comes to the panel by itself counts for nothing beside links.
    fn score(&mut self, row: usize, bin: u32, value: f64) {
        if self.linking {
            match self.links.get(row).and_then(Option::as_ref) {
                Some(change) => self.ledger.linked(row, bin as usize, value, change),
                None => self.ledger.linked(row, bin as usize, value, &Change::default()),
            }
        }
    }
}
