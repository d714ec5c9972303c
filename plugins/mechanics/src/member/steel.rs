//! Bars, stirrups and tendons in the concrete.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use intrados_scene::{
    Part, SteelLine,
    structure::{self, BarEnd, Hold, Place, Prestress, StrandGrade},
};

use super::{Draft, MemberError};
use crate::{
    element::{
        embed::{EmbedError, embed},
        rod::Piece,
    },
    material::{
        DAY,
        bond::Bond,
        chloride::Ingress,
        concrete::Class,
        durability::{Attack, Corrosion, CorrosionError},
        steel::{Bar, Relaxation, Strand},
    },
    mesh::{Locator, Mesh, voxel::distance::Triangles},
    model::{Matter, Rust, Slipping, Steel, SteelKind, Tendon},
    prestress::{self, Jack, Path},
};

impl Draft<'_> {
    /// Lays all steel.
    pub(super) fn lay_steel(&mut self) -> Result<(), MemberError> {
        let mesh = std::mem::take(&mut self.model.mesh);
        let locator = Locator::new(&mesh);
        let skin = self.skin(&mesh)?;
        let lines = self.within(&locator, &mesh);
        let laid: Result<Vec<Steel>, MemberError> = lines
            .iter()
            .map(|line| self.lay(line, &locator, skin.as_ref(), |h| mesh.corners(h as u32)))
            .collect();
        let mut laid = laid?;
        let edges: Vec<Option<f64>> = lines
            .iter()
            .map(|line| Some(f64::from(line.prestress.as_ref()?.plate_mm?) / 1000.0))
            .collect();
        let spirals = self.anchor(&mut laid, &edges, &locator)?;
        laid.extend(spirals);
        drop(locator);
        self.model.mesh = mesh;
        self.model.steel = laid;
        Ok(())
    }

    /// The lines to lay. Of a member that came with a model only what lies in its concrete: bars
    /// lead on into its neighbours, and cubes stand off its surface a little.
    fn within(&mut self, locator: &Locator, mesh: &Mesh) -> Vec<SteelLine> {
        if self.member.body.is_some() {
            return self.member.steel.iter().map(|line| self.run_through(line)).collect();
        }
        let find = |p: DVec3| locator.locate(p).map(|host| (host.hex as usize, host.natural));
        let leaves = |run: &[DVec3]| match embed(run, find, |h| mesh.corners(h as u32)) {
            Err(EmbedError::Outside { along, .. }) => Some(along),
            _ => None,
        };
        let mut lines = Vec::new();
        let [mut all, mut kept] = [0.0; 2];
        for line in &self.member.steel {
            let is_in = |p: DVec3| locator.locate(p).is_some();
            let points: Vec<DVec3> = line.line.iter().map(|p| p.as_dvec3()).collect();
            let runs = inside(&self.off_the_skin(&points, &is_in), is_in);
            let runs: Vec<_> = runs.into_iter().flat_map(|run| parted(run, leaves)).collect();
            all += length(&points);
            kept += runs.iter().map(|run| length(run)).sum::<f64>();
            // A tendon that is cut is none: its anchorages are its ends.
            lines.extend(runs.into_iter().map(|run| SteelLine {
                ends: ends_of(&run, line),
                line: run.iter().map(|p| p.as_vec3()).collect(),
                ..line.clone()
            }));
        }
        if kept < 0.999 * all {
            let what = format!(
                "{:.1} % of the length of its bars and tendons lie outside of its concrete as it is computed, and are left out",
                100.0 * (1.0 - kept / all)
            );
            // Ends in a neighbour are in order; a cage that lies elsewhere is not.
            if kept < 0.7 * all { self.warnings.push(what) } else { self.notes.push(what) }
        }
        lines
    }

    fn lay(
        &self,
        line: &SteelLine,
        locator: &Locator,
        skin: Option<&Skin>,
        corners: impl Fn(usize) -> [DVec3; 8],
    ) -> Result<Steel, MemberError> {
        // Round members are meshed by chords: what lies outside of them by less than a hair's
        // breadth is drawn in.
        let mut points: Vec<DVec3> = line.line.iter().map(|p| self.inward(p.as_dvec3())).collect();
        if self.member.body.is_some() {
            self.go_on(&mut points, line);
        }
        let find = |p: DVec3| locator.locate(p).map(|host| (host.hex as usize, host.natural));
        let embedded = embed(&points, find, corners);
        let pieces = embedded.map_err(|source| MemberError::Embed {
            id: self.id(),
            line: line.name.clone(),
            source,
        })?;
        match &line.prestress {
            None => self.bar(line, pieces, skin),
            Some(stressing) => self.tendon(line, stressing, &points, pieces),
        }
    }

    fn bar(
        &self,
        line: &SteelLine,
        pieces: Vec<Piece>,
        skin: Option<&Skin>,
    ) -> Result<Steel, MemberError> {
        let grade = line.grade.ok_or_else(|| self.without_grade(line))?;
        let bar = Bar::new(f64::from(grade.yield_mpa) * 1e6)
            .map_err(|source| MemberError::Material { id: self.id(), source })?;
        let rupture = grade.ductility.map_or(f64::INFINITY, |[_, strain]| f64::from(strain));
        let hardening = f64::from(grade.hardening_mpa()) * 1e6;
        let diameter = f64::from(line.diameter);
        let rust = skin.map(|skin| skin.rust(diameter, &pieces));
        Ok(Steel {
            name: line.name.clone(),
            pieces,
            area: 0.25 * PI * diameter.powi(2),
            count: 1.0,
            kind: SteelKind::Bar(Bar { hardening, rupture, ..bar }),
            rust,
            gone: Vec::new(),
            bond: self.bond(line, diameter),
            displaces: true,
        })
    }

    fn without_grade(&self, line: &SteelLine) -> MemberError {
        self.unsupported(format!("{}: its steel has no grade known here", line.name))
    }

    fn tendon(
        &self,
        line: &SteelLine,
        stressing: &Prestress,
        points: &[DVec3],
        pieces: Vec<Piece>,
    ) -> Result<Steel, MemberError> {
        let grade = StrandGrade::named(&stressing.steel).ok_or_else(|| self.without_grade(line))?;
        let tendon = jacked(stressing, grade, self.jack(line, stressing, points)?);
        let failed =
            |source| MemberError::Prestress { id: self.id(), line: line.name.clone(), source };
        let path = Path::curve(&points.iter().map(|p| p.to_array()).collect::<Vec<_>>())
            .map_err(failed)?;
        let stations = tendon.stressed(&path).map_err(failed)?;
        let at: Vec<(f64, f64)> = stations.iter().map(|s| (s.length, s.stress())).collect();
        let stress = pieces
            .iter()
            .map(|piece| {
                crate::model::interpolate(&at, 0.5 * (piece.along[0] + piece.along[1]))
                    .unwrap_or(tendon.jacking)
            })
            .collect();
        let kind = SteelKind::Tendon(Tendon {
            strand: tendon.strand,
            at: f64::from(stressing.at_days) * DAY,
            jacking: tendon.jacking,
            stress,
            bonded: stressing.bonded,
            plates: [None, None],
        });
        // A tendon lies in its duct.
        Ok(Steel {
            name: line.name.clone(),
            pieces,
            area: tendon.area,
            count: 1.0,
            kind,
            rust: None,
            gone: Vec::new(),
            bond: None,
            displaces: true,
        })
    }

    /// Where a tendon is stressed from: what runs through a plane of symmetry, from its other end,
    /// as its mirror image is at the same time.
    fn jack(
        &self,
        line: &SteelLine,
        stressing: &Prestress,
        points: &[DVec3],
    ) -> Result<Jack, MemberError> {
        let through =
            |at: Option<&DVec3>| !self.is_tunnel() && at.is_some_and(|at| self.is_mirrored(*at));
        match ([through(points.first()), through(points.last())], stressing.both_ends) {
            ([false, false], false) | ([false, true], true) => Ok(Jack::First),
            ([false, false], true) => Ok(Jack::Both),
            ([true, false], true) => Ok(Jack::Last),
            ([true, true], _) => Err(self.unsupported(format!(
                "{}: it runs from one plane of symmetry to another, so that nothing stresses it: compute all of the member, or hold one end by Directions",
                line.name
            ))),
            (_, false) => Err(self.unsupported(format!(
                "{}: it runs through a plane of symmetry, and stressed from one end it is not symmetric: write both_ends: true, or compute all of the member",
                line.name
            ))),
        }
    }

    /// How a bar slips where the scene asks for it: good conditions, ribs .6 of a diameter apart.
    fn bond(&self, line: &SteelLine, diameter: f64) -> Option<Slipping> {
        let slips = line.part == Part::Bar && line.bond == structure::Bond::Slip;
        let fcm = self.model.bodies.iter().find_map(|b| {
            if let Matter::Concrete(mix) = &b.matter { Some(mix.0.fcm) } else { None }
        })?;
        slips.then(|| Slipping {
            bond: Bond::good(fcm, 0.6 * diameter),
            perimeter: PI * diameter,
            anchored: line.ends.map(|end| end != BarEnd::Straight),
        })
    }

    /// What salt and air come through: all sides, of a tunnel the inside. None where nothing is
    /// computed, and why is in the draft.
    fn skin(&mut self, mesh: &Mesh) -> Result<Option<Skin>, MemberError> {
        let corrosion = self.corrosion()?;
        if let Ok(corrosion) = &corrosion {
            self.notes.extend(
                corrosion.assumed.iter().map(|a| format!("assumed by the exposure class: {a}")),
            );
            self.notes.push(
                "rust takes bars evenly all around; pits are four to eight times as deep".into(),
            );
        }
        self.corrosion = corrosion;
        let Ok(corrosion) = &self.corrosion else { return Ok(None) };
        let along = self.axes.unit[2];
        let faces = if self.is_tunnel() {
            mesh.face_sets.get("inner").cloned().unwrap_or_default()
        } else {
            let mut sides = mesh.outer_faces();
            sides.retain(|&face| {
                mesh.face_middle(face).1.normalize_or_zero().dot(along).abs() < 0.5
            });
            sides
        };
        let surface = Triangles::of_faces(mesh, faces);
        Ok(Some(Skin { surface, corrosion: corrosion.clone(), begin: self.birth() }))
    }

    /// What attacks its steel: by the scene's own chloride, else by its exposure class; or why that
    /// is not computed.
    fn corrosion(&self) -> Result<Result<Corrosion, CorrosionError>, MemberError> {
        if self.member.steel.is_empty() {
            return Ok(Err(CorrosionError::NoBars));
        }
        let Some(exposure) = &self.member.exposure else {
            return Ok(Corrosion::assumed(std::iter::empty(), 0.0, self.model.temperature));
        };
        let fck = self.model.bodies.iter().find_map(|b| {
            if let Matter::Concrete(mix) = &b.matter { Some(mix.0.fck) } else { None }
        });
        let fck =
            fck.unwrap_or(structure::ASSUMED_CONCRETE.parse::<Class>().map_or(30e6, |c| c.fck));
        let Some(chloride) = &exposure.chloride else {
            return Ok(Corrosion::assumed(exposure.classes(), fck, self.model.temperature));
        };
        let ingress = Ingress::new(
            f64::from(chloride.surface_percent),
            f64::from(chloride.initial_percent),
            f64::from(chloride.diffusion_1e12_m2_s) * 1e-12,
            f64::from(chloride.ageing),
        );
        let ingress = ingress.map_err(|source| MemberError::Material { id: self.id(), source })?;
        let attack = Attack::Chloride {
            ingress,
            critical: f64::from(chloride.critical_percent),
            convection: 0.0,
        };
        // 1 µA/cm² is .01 A/m².
        let given = Corrosion::given(attack, 0.01 * f64::from(chloride.current_ua_cm2));
        Ok(Ok(given.beside(exposure.classes(), fck)))
    }

    /// A line with what runs in the skin of the cubes drawn a hair's breadth into them: there it
    /// would be in and out of them by rounding. All else is where it was.
    fn off_the_skin(&self, line: &[DVec3], is_in: &dyn Fn(DVec3) -> bool) -> Vec<DVec3> {
        const HAIR: f64 = 1e-4;
        const LOOKS: u32 = 9;
        let across = [self.axes.unit[0], self.axes.unit[1]].map(|way| HAIR * way);
        let inwards = |p: DVec3| {
            across.map(|way| match [is_in(p + way), is_in(p - way)] {
                [true, false] => 1.0,
                [false, true] => -1.0,
                _ => 0.0_f64,
            })
        };
        let mut drawn = vec![[0.0_f64; 2]; line.len()];
        for (k, ends) in line.windows(2).enumerate() {
            let looks = (1..LOOKS).map(|t| ends[0].lerp(ends[1], f64::from(t) / f64::from(LOOKS)));
            let by = looks.map(inwards).find(|by| *by != [0.0; 2]).unwrap_or_default();
            for end in [k, k + 1] {
                (0..2).for_each(|i| drawn[end][i] = (drawn[end][i] + by[i]).clamp(-1.0, 1.0));
            }
        }
        let moved = |(p, by): (&DVec3, [f64; 2])| *p + by[0] * across[0] + by[1] * across[1];
        line.iter().zip(drawn).map(moved).collect()
    }

    /// A line as it runs through planes of symmetry: where it does, its end is none, whatever the
    /// scene says of it.
    fn run_through(&self, line: &SteelLine) -> SteelLine {
        let planes = self.scene.structure.mirrored(&self.member.id);
        let mut ends = line.ends;
        for (end, at) in ends.iter_mut().zip([line.line.first(), line.line.last()]) {
            let is_near = |face: usize| at.is_some_and(|at| self.is_near(at.as_dvec3(), face));
            if (0..2).any(|face| planes[face] && is_near(face)) {
                *end = BarEnd::Anchored;
            }
        }
        SteelLine { ends, ..line.clone() }
    }

    /// A bar that ends near a face which is held along the axis, and not straight there, runs into
    /// that: into a footing that it starts from, or into the other half of a symmetric member, as
    /// tendons do.
    fn go_on(&self, points: &mut [DVec3], line: &SteelLine) {
        let held = match line.part {
            Part::Bar => self.held_along(),
            Part::Tendon if !self.is_tunnel() => self.scene.structure.mirrored(&self.member.id),
            _ => return,
        };
        let length = self.axes.length;
        let last = points.len().saturating_sub(1);
        for face in (0..2).filter(|&face| held[face]) {
            let z = if face == 0 { 0.0 } else { length };
            let ends = [0, last].into_iter().zip(line.ends);
            for (at, _) in ends.filter(|(_, e)| *e != BarEnd::Straight) {
                if let Some(point) = points.get_mut(at).filter(|p| self.is_near(**p, face)) {
                    let mut local = self.axes.local(*point);
                    local.z = z.clamp(1e-6 * length, (1.0 - 1e-6) * length);
                    *point = self.axes.world(local);
                }
            }
        }
    }

    /// Whether something holds the face where its axis starts, and that where it ends, along it.
    fn held_along(&self) -> [bool; 2] {
        let along = self.axes.unit[2];
        let holds = |s: &structure::Support| match s.hold {
            Hold::Fixed | Hold::Symmetry => true,
            Hold::Directions { x, y, z } => {
                let held = [x, y, z].map(|held| f64::from(u8::from(held)));
                along.abs().dot(DVec3::from_array(held)) > 0.99
            }
            Hold::Springs { .. } => false,
        };
        [Place::Start, Place::End].map(|place| {
            let all = self.scene.structure.supports.iter();
            all.filter(|s| s.member == self.member.id && s.place == place).any(holds)
        })
    }

    /// Whether a place is so near to the face where the axis starts (0) or ends (1) that what ends
    /// there reaches it.
    fn is_near(&self, at: DVec3, face: usize) -> bool {
        let length = self.axes.length;
        let z = if face == 0 { 0.0 } else { length };
        (self.axes.local(at).z - z).abs() < REACHES.min(0.1 * length)
    }

    /// The point, drawn towards the axis a little.
    fn inward(&self, p: DVec3) -> DVec3 {
        let mut local = self.axes.local(p);
        // Ends of tendons lie in the end faces.
        local.z = local.z.clamp(1e-6 * self.axes.length, (1.0 - 1e-6) * self.axes.length);
        self.axes.world(local)
    }
}

/// A bar that ends within this distance of a held face runs into what holds it, m: covers are no
/// deeper.
const REACHES: f64 = 0.1;

/// How the ends of a part of a line hold: where it was cut off, the bar goes on in a neighbour.
fn ends_of(part: &[DVec3], whole: &SteelLine) -> [BarEnd; 2] {
    let is_own = |at: Option<&DVec3>, end: Option<&Vec3>| {
        at.zip(end).is_some_and(|(at, end)| at.distance(end.as_dvec3()) < SHORTEST)
    };
    let own = [is_own(part.first(), whole.line.first()), is_own(part.last(), whole.line.last())];
    std::array::from_fn(|i| if own[i] { whole.ends[i] } else { BarEnd::Anchored })
}

fn length(line: &[DVec3]) -> f64 {
    line.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// What of a bar is looked at to find where it leaves the concrete, and what is too short to be a
/// bar, m.
const STEP: f64 = 0.01;
const SHORTEST: f64 = 0.01;

/// A line parted wherever it `leaves` the concrete (m from its start) for less than a step, at a
/// corner of a cube say: a centimetre after that is left out.
fn parted(line: Vec<DVec3>, leaves: impl Fn(&[DVec3]) -> Option<f64>) -> Vec<Vec<DVec3>> {
    const HAIR: f64 = 1e-4;
    let (mut rest, mut parts) = (line, Vec::new());
    while length(&rest) > SHORTEST {
        let Some(along) = leaves(&rest) else {
            parts.push(rest);
            break;
        };
        let before = cut(&rest, 0.0, along - HAIR);
        if length(&before) > SHORTEST {
            parts.push(before);
        }
        rest = cut(&rest, along + STEP, f64::INFINITY);
    }
    parts
}

/// What of a line lies between two distances from its start, m.
fn cut(line: &[DVec3], from: f64, to: f64) -> Vec<DVec3> {
    let (mut kept, mut before) = (Vec::new(), 0.0);
    for ends in line.windows(2) {
        let long = ends[0].distance(ends[1]);
        let [first, last] = [from, to].map(|at| ((at - before) / long).clamp(0.0, 1.0));
        if long > 0.0 && last > first {
            if kept.is_empty() {
                kept.push(ends[0].lerp(ends[1], first));
            }
            kept.push(ends[0].lerp(ends[1], last));
        }
        before += long;
    }
    kept
}

/// The parts of a line that are inside, to a tenth of a millimetre; none shorter than a centimetre.
fn inside(line: &[DVec3], is_in: impl Fn(DVec3) -> bool) -> Vec<Vec<DVec3>> {
    let mut runs: Vec<Vec<DVec3>> = Vec::new();
    let mut run: Vec<DVec3> = Vec::new();
    for ends in line.windows(2) {
        let at = |t: f64| ends[0].lerp(ends[1], t);
        let count = (ends[0].distance(ends[1]) / STEP).ceil().clamp(1.0, 1e5) as u32;
        let share = |k: u32| f64::from(k) / f64::from(count);
        // Where it crosses the surface between two places, by halving; the place inside.
        let crossing = |mut inner: f64, mut outer: f64| {
            for _ in 0..7 {
                let middle = 0.5 * (inner + outer);
                if is_in(at(middle)) { inner = middle } else { outer = middle }
            }
            inner
        };
        let mut before = is_in(at(0.0));
        if before && run.is_empty() {
            run.push(at(0.0));
        }
        for k in 1..=count {
            let now = is_in(at(share(k)));
            match (before, now) {
                (true, false) => {
                    run.push(at(crossing(share(k - 1), share(k))));
                    runs.push(std::mem::take(&mut run));
                }
                (false, true) => run.push(at(crossing(share(k), share(k - 1)))),
                _ => {}
            }
            before = now;
        }
        if before {
            run.push(at(1.0));
        }
    }
    runs.push(run);
    runs.retain(|run| length(run) > SHORTEST);
    runs
}

/// The surface that salt and air come through.
struct Skin {
    surface: Triangles,
    corrosion: Corrosion,
    /// When they begin to come, s.
    begin: f64,
}

impl Skin {
    /// When each piece of a bar begins to rust: when the side of it that is nearest to the surface
    /// has lost its skin.
    fn rust(&self, diameter: f64, pieces: &[Piece]) -> Rust {
        let over = |piece: &Piece| {
            self.surface.distance(0.5 * (piece.ends[0] + piece.ends[1])) - 0.5 * diameter
        };
        let cover: Vec<f64> = pieces.iter().map(over).collect();
        let since =
            cover.iter().map(|&cover| self.begin + self.corrosion.initiation(cover)).collect();
        Rust { diameter, current: self.corrosion.current, since, cover }
    }
}

/// A tendon of the scene as one that is jacked.
fn jacked(p: &Prestress, grade: StrandGrade, jack: Jack) -> prestress::Tendon {
    let pascal = |mpa: f32| f64::from(mpa) * 1e6;
    prestress::Tendon {
        strand: Strand {
            modulus: pascal(grade.modulus_mpa),
            strength: pascal(grade.strength_mpa),
            proof: pascal(grade.proof_mpa),
            relaxation: match p.relaxation_class {
                1 => Relaxation::Ordinary,
                3 => Relaxation::Bars,
                _ => Relaxation::Low,
            },
        },
        area: f64::from(p.strands) * f64::from(p.strand_mm2) * 1e-6,
        jacking: f64::from(p.stress_mpa) * 1e6,
        friction: f64::from(p.friction),
        wobble: f64::from(p.wobble_per_m),
        slip: f64::from(p.slip_mm) / 1000.0,
        jack,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bar that passes the corner of a notch: 4 mm of it are in the air, which a look every
    /// centimetre does not see.
    #[test]
    fn a_bar_that_leaves_the_concrete_for_less_than_a_step_is_parted_there() {
        let line = [0.0, 1.0, 2.0].map(|x| DVec3::new(x, 0.0, 0.0)).to_vec();
        let air = [1.2033, 1.2073];
        let is_in = |p: DVec3| !(air[0]..air[1]).contains(&p.x);
        assert_eq!(inside(&line, is_in), vec![line.clone()]);
        let leaves = |run: &[DVec3]| {
            let (from, to) = (run[0].x, run[run.len() - 1].x);
            (from < air[1] && to > air[0]).then(|| (air[0] - from).max(0.0))
        };
        let parts = parted(line, leaves);
        let ends: Vec<[f64; 2]> = parts.iter().map(|p| [p[0].x, p[p.len() - 1].x]).collect();
        let wanted = [[0.0, 1.2032], [1.2133, 2.0]];
        let off = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        assert_eq!(ends.len(), 2);
        assert!(ends.iter().zip(&wanted).all(|both| off(both) < 1e-9), "{ends:?}");
        // The middle point is kept.
        assert_eq!(parts[0].len(), 3);
    }
}
