//! Sectors of what repeats around an axis. Along r, θ and z one side of a sector moves as the other
//! does; in vibrations of m nodal diameters e^(imφ) times as much, φ the angle of the sector (Thomas,
//! *Dynamics of rotationally periodic structures*, 1979). Real and imaginary parts are two copies of
//! the sector that its sides bind, so that every frequency comes twice.

use std::{
    collections::{BTreeSet, HashSet},
    f64::consts::TAU,
};

use glam::{DQuat, DVec3};

use super::{
    constraint::Equation,
    matter::six,
    mesh::name_of,
    model::{Deck, Phase},
    read::{Kind, Reader, Surface, plain},
    tie::{Face, Foot},
};
use crate::{
    read::{
        Fault,
        abaqus::card::{Card, Row},
        quote,
    },
    tensor,
};

/// A `*TIE` between the sides of a sector.
#[derive(Debug, Clone)]
pub(super) struct Sides {
    name: Option<String>,
    /// Names of surfaces.
    slave: String,
    master: String,
    /// How far nodes may be from those that they move with, m.
    tolerance: Option<f64>,
}

/// How far off a face, or beside it, a node may lie, over the face's reach.
const BEYOND: f64 = 0.1;
/// How far off the axis a node may lie that is on both sides, over the largest radius.
const ON_AXIS: f64 = 1e-6;
/// Error of the angle between both sides, over itself.
const ASKEW: f64 = 0.01;
/// How far nodes may be from those that they move with, over the mean distance of neighbours.
const NEAR: f64 = 0.005;
/// What an arc counts beside a distance in the half plane: little, so that it decides between
/// masters at one place there alone.
const ASIDE: f64 = 0.1;

/// The axis of a sector.
#[derive(Clone, Copy)]
struct Axis {
    origin: DVec3,
    along: DVec3,
}

impl Axis {
    /// From the axis to a place.
    fn arm(self, place: DVec3) -> DVec3 {
        (place - self.origin).reject_from_normalized(self.along)
    }

    /// Radius and height.
    fn section(self, place: DVec3) -> [f64; 2] {
        [self.arm(place).length(), (place - self.origin).dot(self.along)]
    }

    /// How far apart two places are once both are in one half plane.
    fn apart(self, a: DVec3, b: DVec3) -> f64 {
        let ([r, z], [s, y]) = (self.section(a), self.section(b));
        (r - s).hypot(z - y)
    }

    /// By what angle a place lies ahead of another.
    fn angle(self, ahead: DVec3, of: DVec3) -> f64 {
        let (a, b) = (self.arm(of), self.arm(ahead));
        self.along.dot(a.cross(b)).atan2(a.dot(b))
    }

    fn turned(self, place: DVec3, angle: f64) -> DVec3 {
        self.origin + DQuat::from_axis_angle(self.along, angle) * (place - self.origin)
    }

    /// r, θ and z there.
    fn frame(self, place: DVec3) -> [DVec3; 3] {
        let (place, origin, along) = (place.to_array(), self.origin, self.along);
        tensor::cylindrical(place, origin.to_array(), along.to_array()).map(DVec3::from_array)
    }
}

impl Reader {
    /// Keeps a `*TIE, CYCLIC SYMMETRY` for the card that says which axis it is about.
    pub(super) fn sided(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NAME", "POSITION TOLERANCE", "CYCLIC SYMMETRY"])?;
        let row = card.one_row()?.ok_or_else(|| card.fault("needed are: slave, master"))?;
        let [slave, master] = row.exactly("slave, master")?.map(str::to_ascii_uppercase);
        let tolerance = card.get("POSITION TOLERANCE").map(|t| row.number(t)).transpose()?;
        let tolerance = tolerance.filter(|t| *t > 0.0).map(|t| t * self.units.length());
        self.sides.push(Sides { name: name_of(card, "NAME")?, slave, master, tolerance });
        Ok(())
    }

    /// `*CYCLIC SYMMETRY MODEL`: how many sectors the whole has, and two points of its axis.
    pub(super) fn cyclic(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        if plain(card) != "CYCLICSYMMETRYMODEL" {
            return Ok(());
        }
        card.only(&["N", "NGRAPH", "TIE", "ELSET", "CHECK"])?;
        let sectors = card.get("N").and_then(|n| n.parse::<u32>().ok()).filter(|n| *n > 1);
        let sectors = sectors.ok_or_else(|| card.fault("N is how many sectors there are"))?;
        let phase = TAU / f64::from(sectors);
        let [a, b] = six(card)?;
        let same = || card.fault("both points of the axis are the same");
        let along = (b - a).try_normalize().ok_or_else(same)?;
        let axis = Axis { origin: self.units.length() * a, along };
        let sides = match name_of(card, "TIE")? {
            Some(name) => self.sides.iter().find(|s| s.name.as_ref() == Some(&name)),
            None => self.sides.first().filter(|_| self.sides.len() == 1),
        };
        let none = || card.fault("which *TIE, CYCLIC SYMMETRY? Name one by TIE=…");
        let sides = sides.cloned().ok_or_else(none)?;
        let row = Row { line: card.line, text: "" };
        let (slaves, masters) = (self.on(&sides.slave, row)?, self.on(&sides.master, row)?);
        let pairs = self.paired(&slaves, &masters, axis, phase);
        let angle = self.between(&pairs, axis);
        let is_askew = (angle.abs() - phase).abs() > ASKEW * phase;
        if is_askew && card.word("CHECK").as_deref() != Some("NO") {
            let (angle, phase) = (angle.to_degrees().abs(), phase.to_degrees());
            let what =
                format!("the sides are {angle:.3}° apart, but N={sectors} makes {phase:.3}°");
            return Err(card.fault(what));
        }
        let reach = pairs.iter().map(|p| axis.section(self.place(p.0))[0]).fold(0.0, f64::max);
        let tolerance = sides.tolerance.unwrap_or_else(|| NEAR * self.distance(&masters));
        let faces = self.faces_of(&sides.master, &masters);
        for (slave, master) in pairs {
            let place = self.place(slave);
            let (shares, frames) = if slave == master {
                if axis.section(place)[0] > ON_AXIS * reach {
                    let label = self.deck.labels[slave as usize];
                    let what = "is on both sides of the sector, but not on its axis";
                    return Err(card.fault(format!("node {label} {what}")));
                }
                let turn = DQuat::from_axis_angle(axis.along, -angle);
                (vec![(slave, 1.0)], [DVec3::AXES, DVec3::AXES.map(|e| turn * e)])
            } else if axis.apart(place, self.place(master)) <= tolerance {
                let there = axis.frame(self.place(master));
                (vec![(master, 1.0)], [axis.frame(place), there])
            } else {
                let there = axis.turned(place, -angle);
                let shares = self.shared(slave, there, &faces, card)?;
                (shares, [axis.frame(place), axis.frame(there)])
            };
            self.bind(slave, &shares, frames, phase, card.line);
        }
        Ok(())
    }

    /// Vibrations of nodal diameters are of sectors.
    pub(super) fn sectored(&self) -> Result<(), Fault> {
        let asked = self.deck.steps.iter().any(|s| s.diameters.is_some());
        if asked && self.deck.phases.is_empty() {
            let why = "*SELECT CYCLIC SYMMETRY MODES without *CYCLIC SYMMETRY MODEL";
            return Err(Fault::whole(why));
        }
        Ok(())
    }

    fn place(&self, node: u32) -> DVec3 {
        self.deck.nodes[node as usize]
    }

    /// Nodes of a side, which runs through solids alone.
    fn on(&self, name: &str, row: Row<'_>) -> Result<Vec<u32>, Fault> {
        let undefined = || row.fault(format!("surface {} is not defined", quote(name)));
        let nodes: BTreeSet<u32> = match self.surfaces.get(name).ok_or_else(undefined)? {
            Surface::Nodes(nodes) => nodes.iter().copied().collect(),
            Surface::Faces(faces) => {
                faces.iter().flat_map(|&(e, face)| self.raw[e as usize].side(face)).collect()
            }
        };
        let thin = self.raw.iter().filter(|raw| matches!(raw.kind, Kind::Thin(_)));
        let turning: HashSet<u32> = thin.flat_map(|raw| raw.nodes.iter().copied()).collect();
        match nodes.iter().find(|n| turning.contains(n)) {
            Some(&node) => {
                let label = self.deck.labels[node as usize];
                let why = "sides of a sector that run through beams or shells are not computed";
                Err(row.fault(format!("node {label}: {why}")))
            }
            None if nodes.is_empty() => {
                Err(row.fault(format!("surface {} has no nodes", quote(name))))
            }
            None => Ok(nodes.into_iter().collect()),
        }
    }

    /// The master of every slave: itself where it is on both sides, else that nearest to it, both
    /// turned into one half plane. Of several at one place there, which sides with a step around
    /// the axis have, it is the one that is a sector away. Masters ascend.
    fn paired(&self, slaves: &[u32], masters: &[u32], axis: Axis, phase: f64) -> Vec<(u32, u32)> {
        let off = |slave: u32, master: u32| {
            let (slave, master) = (self.place(slave), self.place(master));
            let askew = (axis.angle(slave, master).abs() - phase).abs();
            axis.apart(slave, master) + ASIDE * axis.arm(slave).length() * askew
        };
        let nearest = |&slave: &u32| {
            let own = masters.binary_search(&slave).map(|_| slave).ok();
            let order = |a: &u32, b: &u32| off(slave, *a).total_cmp(&off(slave, *b));
            let master = own.or_else(|| masters.iter().copied().min_by(order))?;
            Some((slave, master))
        };
        slaves.iter().filter_map(nearest).collect()
    }

    /// The angle by which slaves lie ahead of masters: that of the pair that fits best.
    fn between(&self, pairs: &[(u32, u32)], axis: Axis) -> f64 {
        let radius = |p: &(u32, u32)| axis.section(self.place(p.1))[0];
        let reach = pairs.iter().map(radius).fold(0.0, f64::max);
        let apart = |p: &(u32, u32)| axis.apart(self.place(p.0), self.place(p.1));
        let far = pairs.iter().filter(|p| p.0 != p.1 && radius(p) > 0.1 * reach);
        let best = far.min_by(|a, b| apart(a).total_cmp(&apart(b)));
        best.map_or(0.0, |p| axis.angle(self.place(p.0), self.place(p.1)))
    }

    /// The mean distance of nodes to their neighbours.
    fn distance(&self, nodes: &[u32]) -> f64 {
        let nearest = |&n: &u32| {
            let others = nodes.iter().filter(|&&m| m != n);
            others.map(|&m| self.place(m).distance(self.place(n))).fold(f64::INFINITY, f64::min)
        };
        nodes.iter().map(nearest).sum::<f64>() / nodes.len() as f64
    }

    /// Faces of a side: those that it names, or all whose nodes are of it.
    fn faces_of(&self, name: &str, nodes: &[u32]) -> Vec<Face> {
        if let Some(Surface::Faces(faces)) = self.surfaces.get(name) {
            let face =
                |&(e, face): &(u32, u8)| Face::new(&self.deck, self.raw[e as usize].cell?, face);
            return faces.iter().filter_map(face).collect();
        }
        let own: HashSet<u32> = nodes.iter().copied().collect();
        let cells = (0..).zip(&self.deck.cells);
        let all =
            cells.flat_map(|(cell, of)| (0..).zip(of.shape.faces()).map(move |f| (cell, f.0)));
        all.filter_map(|(cell, face)| Face::new(&self.deck, cell, face))
            .filter(|face| face.nodes().iter().all(|n| own.contains(n)))
            .collect()
    }

    /// The shares of the nodes of the nearest face in a place.
    fn shared(
        &self,
        slave: u32,
        place: DVec3,
        faces: &[Face],
        card: &Card<'_>,
    ) -> Result<Vec<(u32, f64)>, Fault> {
        let away = |foot: &Foot| foot.off + foot.beside;
        let feet = faces.iter().map(|face| (face.foot(&self.deck, place), face.reach()));
        let nearest = feet.min_by(|a, b| away(&a.0).total_cmp(&away(&b.0)));
        match nearest {
            Some((foot, reach)) if away(&foot) <= BEYOND * reach => {
                Ok(foot.nodes.into_iter().zip(foot.shares).collect())
            }
            _ => {
                let label = self.deck.labels[slave as usize];
                Err(card.fault(format!("node {label} lies on no face of the other side")))
            }
        }
    }

    /// Binds a node of one side along its axes to what moves along those of the other.
    fn bind(
        &mut self,
        slave: u32,
        shares: &[(u32, f64)],
        [own, others]: [[DVec3; 3]; 2],
        angle: f64,
        line: u32,
    ) {
        let part =
            |node: u32, along: DVec3| (3 * node..).zip(along.to_array()).filter(|t| t.1 != 0.0);
        for (own, other) in own.into_iter().zip(others) {
            let mut terms: Vec<(u32, f64)> = part(slave, own).collect();
            let ahead = terms.len();
            terms.extend(shares.iter().flat_map(|&(node, share)| part(node, -share * other)));
            self.deck.phases.insert(self.deck.equations.len(), Phase { ahead, angle });
            self.deck.equations.push(Equation { terms, value: 0.0, line });
        }
    }
}

impl Deck {
    /// What binds real and imaginary parts of vibrations of so many nodal diameters, from what binds
    /// the sector, of which so many supports come first.
    pub(super) fn waved(
        &self,
        equations: &[Equation],
        supports: usize,
        diameters: u32,
    ) -> Vec<Equation> {
        let copy = 3 * self.nodes.len() as u32;
        let mut all = Vec::with_capacity(2 * equations.len());
        for (i, equation) in equations.iter().enumerate() {
            let phase = i.checked_sub(supports).and_then(|i| self.phases.get(&i));
            let ahead = phase.map_or(equation.terms.len(), |p| p.ahead.min(equation.terms.len()));
            let (own, others) = equation.terms.split_at(ahead);
            let angle = phase.map_or(0.0, |p| p.angle) * f64::from(diameters);
            for [real, imaginary] in [[0, copy], [copy, 0]] {
                // (c + is)(R + iI): cR − sI, and cI + sR.
                let sine = if real == 0 { -angle.sin() } else { angle.sin() };
                let mut terms: Vec<(u32, f64)> = own.iter().map(|&(u, f)| (u + real, f)).collect();
                for &(u, f) in others {
                    terms.extend([(u + real, f * angle.cos()), (u + imaginary, f * sine)]);
                }
                all.push(Equation { terms, value: 0.0, line: equation.line });
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use std::{
        f64::consts::{FRAC_PI_3, FRAC_PI_6},
        fmt::Write as _,
        path::Path,
    };

    use intrados_stage::Job;

    use crate::{linear::parse, linear::solve::Solved, read::Units};

    const MATTER: &str =
        "*MATERIAL,NAME=M\n*ELASTIC\n200.,.3\n*DENSITY\n3.\n*SOLID SECTION,ELSET=E,MATERIAL=M\n";
    const SIDES: &str = "*SURFACE,NAME=L,TYPE=NODE\nLOW\n*SURFACE,NAME=H,TYPE=NODE\nHIGH\n\
        *TIE,CYCLIC SYMMETRY,NAME=T\nH,L\n*CYCLIC SYMMETRY MODEL,N=6\n0.,0.,0.,0.,0.,1.\n";

    fn solve(deck: &str) -> Vec<Solved> {
        let deck = parse(deck.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
        deck.solve(&Job::default()).unwrap()
    }

    /// Nodes at so many stations, so far apart, of these radii and heights.
    fn stations(count: usize, angle: f64, places: &[[f64; 2]]) -> String {
        let mut text = String::from("*NODE\n");
        for k in 0..count {
            let (sin, cos) = (k as f64 * angle).sin_cos();
            for (j, [r, z]) in places.iter().enumerate() {
                let number = places.len() * k + j + 1;
                writeln!(text, "{number},{:?},{:?},{z:?}", r * cos, r * sin).unwrap();
            }
        }
        text
    }

    /// A ring of bricks that is held inside, or one of its six sectors.
    fn ring(is_whole: bool) -> String {
        let (count, parts) = if is_whole { (6, 6) } else { (2, 1) };
        let mut text =
            stations(count, FRAC_PI_3, &[[1.0, 0.0], [2.0, 0.0], [2.2, 1.0], [1.0, 1.0]]);
        text += "*ELEMENT,TYPE=C3D8,ELSET=E\n";
        for k in 0..parts {
            let number = |k: usize, j: usize| 4 * (k % count) + j + 1;
            let nodes = [k + 1, k].into_iter().flat_map(|k| (0..4).map(move |j| number(k, j)));
            let nodes: Vec<String> = nodes.map(|n| n.to_string()).collect();
            writeln!(text, "{},{}", k + 1, nodes.join(",")).unwrap();
        }
        text += MATTER;
        if !is_whole {
            text += "*NSET,NSET=LOW\n1,2,3,4\n*NSET,NSET=HIGH\n5,6,7,8\n";
            text += SIDES;
        }
        text += "*BOUNDARY\n";
        (0..count).for_each(|k| writeln!(text, "{},1,3\n{},1,3", 4 * k + 1, 4 * k + 4).unwrap());
        text
    }

    /// Six wedges around an axis, held below, or one of them.
    fn disc(is_whole: bool) -> String {
        let (count, parts) = if is_whole { (6, 6) } else { (2, 1) };
        let mut text = stations(count, FRAC_PI_3, &[[2.0, 0.0], [2.2, 1.0]]);
        text += "101,0.,0.,0.\n102,0.,0.,1.\n*ELEMENT,TYPE=C3D6,ELSET=E\n";
        for k in 0..parts {
            let number = |k: usize, j: usize| 2 * (k % count) + j + 1;
            let [a, b, c, d] = [(k, 0), (k + 1, 0), (k, 1), (k + 1, 1)].map(|(k, j)| number(k, j));
            writeln!(text, "{},101,{a},{b},102,{c},{d}", k + 1).unwrap();
        }
        text += MATTER;
        if !is_whole {
            text += "*NSET,NSET=LOW\n1,2,101,102\n*NSET,NSET=HIGH\n3,4,101,102\n";
            text += SIDES;
        }
        text += "*BOUNDARY\n101,1,3\n";
        (0..count).for_each(|k| writeln!(text, "{},1,3", 2 * k + 1).unwrap());
        text
    }

    /// A ring of two layers that is held inside, or one of its six sectors, of which the outer layer
    /// lies half a sector ahead of the inner one: its sides have a step around the axis.
    fn stepped(is_whole: bool) -> String {
        let count = if is_whole { 12 } else { 4 };
        let places = [[1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [1.0, 1.0], [2.0, 1.0], [3.0, 1.0]];
        let mut text = stations(count, FRAC_PI_6, &places);
        text += "*ELEMENT,TYPE=C3D8,ELSET=E\n";
        let parts = if is_whole { 12 } else { 2 };
        let layers = [(0, [0, 1, 4, 3]), (if is_whole { 0 } else { 1 }, [1, 2, 5, 4])];
        let bricks = layers
            .into_iter()
            .flat_map(|(begin, section)| (begin..begin + parts).map(move |k| (k, section)));
        for (number, (k, section)) in bricks.enumerate() {
            let node = |k: usize, j: usize| (6 * (k % count) + j + 1).to_string();
            let nodes = [k + 1, k].into_iter().flat_map(|k| section.map(|j| node(k, j)));
            writeln!(text, "{},{}", number + 1, Vec::from_iter(nodes).join(",")).unwrap();
        }
        text += MATTER;
        if !is_whole {
            text += "*NSET,NSET=LOW\n1,2,4,5,8,9,11,12\n*NSET,NSET=HIGH\n13,14,16,17,20,21,23,24\n";
            text += SIDES;
        }
        text += "*BOUNDARY\n";
        let held = if is_whole { 12 } else { 3 };
        (0..held).for_each(|k| writeln!(text, "{},1,3\n{},1,3", 6 * k + 1, 6 * k + 4).unwrap());
        text
    }

    #[test]
    fn sides_with_a_step_are_paired_a_sector_apart() {
        let load = |inner: std::ops::Range<usize>, outer: std::ops::Range<usize>| {
            let faces: String = inner.chain(outer).map(|e| format!("{e},P4,3.\n")).collect();
            format!("*STEP\n*STATIC\n*DLOAD\n{faces}*END STEP\n")
        };
        let whole = solve(&(stepped(true) + &load(1..13, 13..25)));
        let sector = solve(&(stepped(false) + &load(1..3, 3..5)));
        let used = (0..24).filter(|n| ![2, 5, 18, 21].contains(n));
        for n in used {
            let [a, b] = [&sector, &whole].map(|solved| solved[0].displacements[n]);
            assert!(a.distance(b) < 1e-11, "node {}: {a} is not {b}", n + 1);
        }
        assert!(whole[0].displacements[2].length() > 1e-3);
    }

    #[test]
    fn sides_without_nodes_are_refused() {
        let deck = ring(false).replace("LOW\n1,2,3,4\n", "LOW\n901,902\n");
        let deck = deck.replace("N=6", "N=6,CHECK=NO") + "*STEP\n*STATIC\n*END STEP\n";
        let why = parse(deck.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap_err();
        assert!(why.to_string().contains("has no nodes"), "{why}");
    }

    /// Those of 0 and 3 diameters are once in the whole; others twice, as they go around.
    #[test]
    fn sectors_vibrate_as_the_whole_does() {
        for model in [ring, disc] {
            let whole = model(true) + "*STEP\n*FREQUENCY\n40\n*END STEP\n";
            let whole = &solve(&whole)[0].eigenvalues;
            let sector = model(false)
                + "*STEP\n*FREQUENCY\n40\n*SELECT CYCLIC SYMMETRY MODES,NMIN=0,NMAX=3\n*END STEP\n";
            let found = solve(&sector);
            assert_eq!(found.len(), 4);
            let mut all: Vec<f64> = Vec::new();
            for (diameters, solved) in found.iter().enumerate() {
                let step = if diameters % 3 == 0 { 2 } else { 1 };
                all.extend(solved.eigenvalues.iter().copied().step_by(step));
            }
            all.sort_by(f64::total_cmp);
            assert_eq!(all.len(), whole.len());
            for (a, b) in all.iter().zip(whole) {
                assert!((a - b).abs() < 1e-8 * b, "{a} is not {b}");
            }
        }
    }

    #[test]
    fn sectors_move_as_the_whole_does() {
        let load = |parts: usize| {
            let faces: String = (1..=parts).map(|e| format!("{e},P4,3.\n")).collect();
            format!("*STEP\n*STATIC\n*DLOAD\n{faces}*END STEP\n")
        };
        let whole = solve(&(ring(true) + &load(6)));
        let sector = solve(&(ring(false) + &load(1)));
        for (a, b) in sector[0].displacements.iter().zip(&whole[0].displacements) {
            assert!(a.distance(*b) < 1e-11, "{a} is not {b}");
        }
        assert!(whole[0].displacements[1].x < -1e-3);
    }

    #[test]
    fn sectors_that_do_not_close_are_refused() {
        let deck = ring(false).replace("N=6", "N=5") + "*STEP\n*STATIC\n*END STEP\n";
        let why = parse(deck.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap_err();
        assert!(why.to_string().contains("60.000° apart, but N=5 makes 72.000°"), "{why}");
    }
}
