//! A stretch of a member by itself, in finer bricks than the rest of it, driven at its cuts by what
//! the whole does there: a submodel (Saint-Venant: what the coarse bricks miss within themselves
//! dies off within a section's height or so).

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::{
    analysis::Observer,
    element::hex8,
    member::{Axes, Part, Prepared},
    mesh::{Hex, HexFace, Host, Locator, Mesh},
    model::{
        Action, Failure, Gauge, Ground, History, Load, Model, Point, Rust, Steel, SteelKind, Step,
        System, Tendon,
    },
};

/// Why a stretch cannot be computed by itself.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("member {id}: {why}")]
pub struct StretchError {
    /// Of the member.
    pub id: String,
    /// Why, and what to do.
    pub why: String,
}

/// A stretch of a finer mesh of a member, and where it is cut off.
#[derive(Debug, Clone)]
pub struct Stretch {
    fine: Prepared,
    /// Nodes in the cuts, and where each lies in the bricks of the whole.
    cut: Vec<(u32, Host)>,
}

/// What the whole does at the cuts of a stretch: watches its life.
#[derive(Debug, Clone)]
pub struct Driven {
    stretch: Stretch,
    /// Equilibria: when, and the displacements of the nodes in the cuts, m.
    seen: Vec<(f64, Vec<DVec3>)>,
}

impl Stretch {
    /// What lies between two shares of the axis, `from` and `to`, of a `fine` model of the same
    /// member as `whole`; whole bricks, those whose middle lies between.
    ///
    /// # Errors
    /// It is all of the member or none of it; or what it has is more than a stretch can cut:
    /// joints, shells, tendons that are not bonded or that end there, bars that slip.
    pub fn of(
        whole: &Prepared,
        fine: &Prepared,
        axes: &Axes,
        [from, to]: [f64; 2],
    ) -> Result<Self, StretchError> {
        let refuse = |why: String| StretchError { id: whole.id.clone(), why };
        let mesh = &fine.model.mesh;
        if !mesh.interfaces.is_empty() || !mesh.shells.is_empty() || !mesh.rods.is_empty() {
            return Err(refuse("a stretch cuts through no joints and no thin steel: analyze all of it with a smaller --element".into()));
        }
        if !fine.model.initial.is_empty() {
            return Err(refuse("a stretch begins without stress, and there is some before anything acts: analyze all of it".into()));
        }
        let within = |hex: u32| {
            (from..=to).contains(&(axes.local(mesh.centre(hex)).z / axes.length.max(1e-300)))
        };
        let kept: Vec<u32> = (0..mesh.hexes.len() as u32).filter(|&hex| within(hex)).collect();
        if kept.is_empty() || kept.len() == mesh.hexes.len() {
            return Err(refuse(format!(
                "between {from} and {to} of its axis lie {} of its {} bricks: give another stretch or smaller bricks",
                kept.len(),
                mesh.hexes.len()
            )));
        }
        let renumbered = Renumbered::new(mesh, &kept);
        let cut = renumbered.cut(mesh);
        let mut part = renumbered.prepared(fine, &cut).map_err(refuse)?;
        part.notes.push(format!(
            "the stretch between {from} and {to} of its axis in bricks of {:.3} m, driven at its cuts by the whole in bricks of {:.3} m",
            longest(&fine.model.mesh),
            longest(&whole.model.mesh)
        ));
        let locator = Locator::new(&whole.model.mesh);
        let host = |&node: &u32| {
            let at = part.model.mesh.nodes[node as usize];
            let host = locator.locate(at).ok_or_else(|| {
                refuse(
                    "a cut of the stretch lies outside of the whole's bricks: give it elsewhere"
                        .into(),
                )
            })?;
            Ok((node, host))
        };
        let cut = cut.iter().map(host).collect::<Result<Vec<_>, StretchError>>()?;
        Ok(Self { fine: part, cut })
    }

    /// To watch the life of the whole with.
    #[must_use]
    pub fn driven(self) -> Driven {
        Driven { stretch: self, seen: Vec::new() }
    }
}

impl Driven {
    /// The stretch, its cuts moved as the whole has moved them; linear between its equilibria.
    #[must_use]
    pub fn prepared(self) -> Prepared {
        let Self { stretch: Stretch { mut fine, cut }, seen } = self;
        fine.times = seen.iter().map(|(time, _)| *time).collect();
        fine.begin = fine.times.first().copied().unwrap_or(fine.begin);
        // One hat a moment: their sum is the course.
        for (k, (time, moved)) in seen.iter().enumerate() {
            let before = k.checked_sub(1).map(|before| (seen[before].0, 0.0));
            let after = seen.get(k + 1).map(|(time, _)| (*time, 0.0));
            let values = cut.iter().zip(moved).flat_map(|(&(node, _), moved)| {
                moved.to_array().into_iter().enumerate().map(move |(c, u)| (node, c as u8, u))
            });
            fine.model.loads.push(Load {
                name: "what the rest of it does".into(),
                action: Action::Displacement(values.collect()),
                history: before.into_iter().chain([(*time, 1.0)]).chain(after).collect(),
            });
        }
        fine
    }
}

impl Observer for Driven {
    fn see(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        _: &[[Point; 8]],
    ) -> Result<(), Failure> {
        let mesh = &structure.model.mesh;
        let moved = self.stretch.cut.iter().map(|(_, host)| {
            let shape = hex8::shape(host.natural);
            let nodes = mesh.hexes[host.hex as usize].nodes.iter().zip(shape);
            let of = |n: u32| DVec3::from_slice(&history.x[3 * n as usize..3 * n as usize + 3]);
            nodes.map(|(&n, share)| share * of(n)).sum()
        });
        self.seen.push((step.time, moved.collect()));
        Ok(())
    }
}

fn longest(mesh: &Mesh) -> f64 {
    (0..mesh.hexes.len() as u32).map(|hex| mesh.longest(hex)).fold(0.0, f64::max)
}

/// New numbers of the bricks that are kept and of their nodes.
struct Renumbered {
    hexes: BTreeMap<u32, u32>,
    nodes: BTreeMap<u32, u32>,
}

impl Renumbered {
    fn new(mesh: &Mesh, kept: &[u32]) -> Self {
        let used: BTreeSet<u32> =
            kept.iter().flat_map(|&hex| mesh.hexes[hex as usize].nodes).collect();
        Self {
            hexes: kept.iter().copied().zip(0..).collect(),
            nodes: used.into_iter().zip(0..).collect(),
        }
    }

    /// Nodes that bricks on both sides share, by their new numbers.
    fn cut(&self, mesh: &Mesh) -> BTreeSet<u32> {
        let left = (0u32..).zip(&mesh.hexes).filter(|(hex, _)| !self.hexes.contains_key(hex));
        left.flat_map(|(_, hex)| hex.nodes).filter_map(|n| self.nodes.get(&n).copied()).collect()
    }

    fn prepared(&self, all: &Prepared, cut: &BTreeSet<u32>) -> Result<Prepared, String> {
        let hex = |h: &u32| self.hexes.get(h).copied();
        let part = |part: &Part| Part {
            hexes: part.hexes.iter().filter_map(hex).collect(),
            geometry: None,
            ..part.clone()
        };
        let gauges = all.gauges.iter().filter_map(|(name, gauge)| {
            let on = |host: Host| Some(Host { hex: hex(&host.hex)?, ..host });
            let kept = match *gauge {
                Gauge::Displacement(host, along) => Gauge::Displacement(on(host)?, along),
                Gauge::Strain(host, along) => Gauge::Strain(on(host)?, along),
                Gauge::Stress(host, along) => Gauge::Stress(on(host)?, along),
            };
            Some((name.clone(), kept))
        });
        Ok(Prepared {
            model: self.model(&all.model, cut)?,
            parts: all.parts.iter().map(part).collect(),
            gauges: gauges.collect(),
            mirrored: all.mirrored.iter().filter_map(|face| self.face(*face)).collect(),
            raised: None,
            ..all.clone()
        })
    }

    fn model(&self, all: &Model, cut: &BTreeSet<u32>) -> Result<Model, String> {
        let free = |node: &u32| self.nodes.get(node).copied().filter(|n| !cut.contains(n));
        let mesh = Mesh {
            nodes: self.nodes.keys().map(|&n| all.mesh.nodes[n as usize]).collect(),
            hexes: self.hexes.keys().map(|&hex| self.hex(&all.mesh.hexes[hex as usize])).collect(),
            regions: all.mesh.regions.clone(),
            ..Mesh::default()
        };
        let kept = |values: &[f64]| match values {
            [] => Vec::new(),
            values => self.hexes.keys().map(|&hex| values[hex as usize]).collect(),
        };
        let steel = all.steel.iter().map(|steel| self.steel(steel));
        let ground = all.ground.iter().filter_map(|ground| {
            Some(Ground { face: self.face(ground.face)?, bedding: ground.bedding })
        });
        let holds = all.holds.iter().filter_map(|(node, c)| Some((free(node)?, *c)));
        let loads = all
            .loads
            .iter()
            .map(|load| Load { action: self.action(&load.action, &free), ..load.clone() });
        Ok(Model {
            mesh,
            steel: steel.collect::<Result<Vec<_>, String>>()?.into_iter().flatten().collect(),
            ground: ground.collect(),
            holds: holds.collect(),
            loads: loads.collect(),
            softening: kept(&all.softening),
            initial: BTreeMap::new(),
            ..all.clone()
        })
    }

    fn hex(&self, hex: &Hex) -> Hex {
        Hex { nodes: hex.nodes.map(|n| self.nodes[&n]), region: hex.region }
    }

    fn face(&self, face: HexFace) -> Option<HexFace> {
        Some(HexFace { hex: *self.hexes.get(&face.hex)?, ..face })
    }

    fn action(&self, action: &Action, free: &impl Fn(&u32) -> Option<u32>) -> Action {
        match action {
            Action::Nodes(forces) => {
                Action::Nodes(forces.iter().filter_map(|(n, f)| Some((free(n)?, *f))).collect())
            }
            Action::Faces(pressures) => {
                let kept = pressures.iter().filter_map(|(f, p)| Some((self.face(*f)?, *p)));
                Action::Faces(kept.collect())
            }
            Action::Displacement(moved) => {
                let kept = moved.iter().filter_map(|(n, c, u)| Some((free(n)?, *c, *u)));
                Action::Displacement(kept.collect())
            }
            Action::Temperature(warmth) => {
                Action::Temperature(self.nodes.keys().map(|&n| warmth[n as usize]).collect())
            }
            Action::Shells(_) | Action::Weight(_) => action.clone(),
        }
    }

    /// What of a bar lies in the stretch; none: nothing.
    fn steel(&self, steel: &Steel) -> Result<Option<Steel>, String> {
        let kept: Vec<usize> = (0..steel.pieces.len())
            .filter(|&p| self.hexes.contains_key(&(steel.pieces[p].host as u32)))
            .collect();
        if kept.is_empty() {
            return Ok(None);
        }
        let of = |values: &[f64]| match values {
            [] => Vec::new(),
            values => kept.iter().map(|&p| values[p]).collect(),
        };
        if steel.bond.is_some() {
            return Err(format!(
                "{} slips beyond the stretch: let its bond be perfect, without laps",
                steel.name
            ));
        }
        let kind = match &steel.kind {
            SteelKind::Bar(bar) => SteelKind::Bar(*bar),
            SteelKind::Stressed(bar, stress) => SteelKind::Stressed(*bar, of(stress)),
            SteelKind::Tendon(tendon) => {
                let ends = [0, steel.pieces.len() - 1].map(|end| kept.contains(&end));
                if !tendon.bonded || ends.contains(&true) {
                    return Err(format!(
                        "{} is not bonded or ends in the stretch, and works beyond it: choose a stretch between its anchors",
                        steel.name
                    ));
                }
                let (stress, plates) = (of(&tendon.stress), [None, None]);
                SteelKind::Tendon(Tendon { stress, plates, ..tendon.clone() })
            }
        };
        let rust = steel.rust.as_ref().map(|rust| Rust {
            since: of(&rust.since),
            cover: of(&rust.cover),
            ..rust.clone()
        });
        let pieces = kept.iter().map(|&p| {
            let piece = &steel.pieces[p];
            let host = self.hexes[&(piece.host as u32)] as usize;
            crate::element::rod::Piece { host, ..piece.clone() }
        });
        let (pieces, gone) = (pieces.collect(), of(&steel.gone));
        Ok(Some(Steel { pieces, kind, rust, gone, ..steel.clone() }))
    }
}
