//! Thin steel: shells, and bars between nodes of the mesh. Both stand after the bricks, embedded
//! steel, joints and ground in the order of elements.
//!
//! A node of a shell also turns. Its rotation is a node of its own, numbered after those of the
//! mesh, so that it is held, loaded and read like any other: component c of node [`Rotations::of`]
//! is the rotation about axis c.

use glam::DVec3;

use super::{Action, Elastic, Failure, History, Matter, System, Trial};
use crate::{
    element::{
        Element, quad, rod,
        shell::{Resultants, Shell},
    },
    material::steel::{Bar, BarState},
    mesh::{ElementId, Mesh},
    sparse::{Connectivity, Kind, Place},
};

/// Which nodes turn, and the numbers of their rotations.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Rotations {
    /// Nodes of shells, ascending.
    owners: Vec<u32>,
    /// Nodes of the mesh.
    nodes: u32,
}

impl Rotations {
    /// Of a mesh.
    #[must_use]
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let mut owners: Vec<u32> = mesh.shells.iter().flat_map(|s| s.nodes).collect();
        owners.sort_unstable();
        owners.dedup();
        Self { owners, nodes: mesh.nodes.len() as u32 }
    }

    /// The number of a node's rotation; `None` if the node belongs to no shell.
    #[must_use]
    pub(crate) fn of(&self, node: u32) -> Option<u32> {
        self.owners.binary_search(&node).ok().map(|at| self.nodes + at as u32)
    }

    /// The node that turns by this rotation; `None` if it is no rotation.
    #[must_use]
    pub(crate) fn owner(&self, rotation: u32) -> Option<u32> {
        self.owners.get(rotation.checked_sub(self.nodes)? as usize).copied()
    }

    /// All of them, as nodes of the system of equations.
    pub(super) fn places<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = Place> + 'a {
        self.owners.iter().map(|&n| Place {
            position: mesh.nodes[n as usize].to_array(),
            kind: Kind::RotationOf(n),
        })
    }

    fn of_shell(&self, nodes: [u32; 4]) -> [u32; 8] {
        std::array::from_fn(|a| {
            if a < 4 { nodes[a] } else { self.of(nodes[a - 4]).unwrap_or(nodes[a - 4]) }
        })
    }
}

/// The bars of a region.
#[derive(Debug, Clone, Copy)]
struct Rod<'a> {
    steel: &'a Bar,
    area: f64,
    expansion: f64,
}

impl System<'_> {
    /// Adds shells and rods to the elements.
    ///
    /// # Errors
    /// If their material is not for them.
    pub(super) fn add_thin(
        mesh: &Mesh,
        bodies: &[super::Body],
        rotations: &Rotations,
        elements: &mut Connectivity,
    ) -> Result<(), Failure> {
        let wrong = |id: ElementId| Err(Failure::Kind { element: mesh.name(id) });
        for (i, shell) in mesh.shells.iter().enumerate() {
            if !matches!(bodies[shell.region as usize].matter, Matter::Shell { .. }) {
                return wrong(ElementId::Shell(i as u32));
            }
            elements.push(&rotations.of_shell(shell.nodes));
        }
        for (i, rod) in mesh.rods.iter().enumerate() {
            if !matches!(bodies[rod.region as usize].matter, Matter::Bar { .. }) {
                return wrong(ElementId::Rod(i as u32));
            }
            elements.push(&rod.nodes);
        }
        Ok(())
    }

    /// Number of the first shell or rod among the elements.
    fn first_thin(&self) -> usize {
        self.elements.len() - self.model.mesh.shells.len() - self.model.mesh.rods.len()
    }

    fn thin_is_alive(&self, thin: usize, time: f64) -> bool {
        let mesh = &self.model.mesh;
        let region = mesh
            .shells
            .get(thin)
            .map(|s| s.region)
            .or_else(|| mesh.rods.get(thin - mesh.shells.len()).map(|r| r.region));
        region.is_some_and(|region| self.model.bodies[region as usize].birth <= time)
    }

    /// As [`System::bear`], for shells and rods.
    pub(super) fn bear_thin(&self, history: &mut History, time: f64) {
        let first = self.first_thin();
        for thin in 0..self.elements.len() - first {
            if self.thin_is_alive(thin, time) && !self.thin_is_alive(thin, history.time) {
                let mut shape = [0.0; 24];
                for (to, node) in
                    shape.as_chunks_mut::<3>().0.iter_mut().zip(self.elements.get(first + thin))
                {
                    *to = std::array::from_fn(|c| history.x[3 * *node as usize + c]);
                }
                history.born.insert((first + thin) as u32, shape);
            }
        }
    }

    /// Displacements (and rotations) of the nodes of a shell or rod, counted from where it was
    /// born.
    fn thin_strained<const N: usize>(&self, thin: usize, history: &History, x: &[f64]) -> [f64; N] {
        let element = self.first_thin() + thin;
        let nodes = self.elements.get(element);
        let born = history.born.get(&(element as u32));
        std::array::from_fn(|i| x[3 * nodes[i / 3] as usize + i % 3] - born.map_or(0.0, |b| b[i]))
    }

    /// Stiffness and force of a shell or rod.
    pub(super) fn thin(
        &self,
        thin: usize,
        trial: Trial,
        x: &[f64],
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<(), Failure> {
        if !self.thin_is_alive(thin, trial.time) {
            return Ok(());
        }
        let shells = self.model.mesh.shells.len();
        if thin < shells {
            let (shell, elastic) = self.shell(thin)?;
            let u = self.thin_strained(thin, trial.history, x);
            let warm = self.thin_warmth(self.model.mesh.shells[thin].nodes, &trial.warmth[1]);
            let element = shell.integrate(&u, |point| {
                heated(&elastic, shell.thickness, &warm, quad::GAUSS[point])
            });
            fill(&element.map_err(|source| self.of_shell(thin, source))?, k, f);
        } else {
            let (stress, tangent, _) = self.rod(thin - shells, trial, x)?;
            let rod = &self.model.mesh.rods[thin - shells];
            let area = self.bar(thin - shells)?.area;
            let element = rod::rod(
                &rod.nodes.map(|n| self.model.mesh.nodes[n as usize]),
                &[0.0; 6],
                area,
                |_| (stress, tangent),
            );
            fill(&element.map_err(|source| self.of_rod(thin - shells, source))?, k, f);
        }
        Ok(())
    }

    /// What bars remember before anything has happened: an initial stress is a strain that they
    /// have lost beforehand.
    pub(super) fn resting_bars(&self) -> Vec<BarState> {
        let initial = |rod: usize| {
            self.model.initial.get(&ElementId::Rod(rod as u32)).map_or(0.0, |stress| stress[0])
        };
        let rest = |rod: usize| self.bar(rod).map_or(0.0, |bar| -initial(rod) / bar.steel.modulus);
        (0..self.model.mesh.rods.len())
            .map(|rod| BarState { plastic: rest(rod), ..BarState::default() })
            .collect()
    }

    /// What bars remember after a trial.
    pub(super) fn commit_bars(&self, trial: Trial, x: &[f64]) -> Result<Vec<BarState>, Failure> {
        let shells = self.model.mesh.shells.len();
        let each = |rod: usize| match self.thin_is_alive(shells + rod, trial.time) {
            true => Ok(self.rod(rod, trial, x)?.2),
            false => Ok(trial.history.bars[rod]),
        };
        (0..self.model.mesh.rods.len()).map(each).collect()
    }

    /// Stress of a bar of the mesh in a history, Pa.
    ///
    /// # Errors
    /// [`Failure::Element`] if it has no length.
    pub(crate) fn bar_stress(&self, rod: usize, history: &History) -> Result<f64, Failure> {
        if !self.thin_is_alive(self.model.mesh.shells.len() + rod, history.time) {
            return Ok(0.0);
        }
        let warmth = self.warmth([history.time; 2]);
        Ok(self.rod(rod, Trial::still(history, &warmth), &history.x)?.0)
    }

    /// Stress in the middle of a shell's wall, around an axis and along it, Pa.
    ///
    /// # Errors
    /// [`Failure::Element`] if it is folded.
    pub(crate) fn wall_stress(
        &self,
        shell: usize,
        axis: DVec3,
        history: &History,
    ) -> Result<[f64; 2], Failure> {
        if !self.thin_is_alive(shell, history.time) {
            return Ok([0.0; 2]);
        }
        let thickness = self.shell(shell)?.0.thickness;
        let found = self.resultants(shell, [0.0; 2], history)?;
        let [one, two, normal] = found.frame;
        let [n11, n22, n12] = found.membrane;
        let along = |way: DVec3| {
            let [a, b] = [way.dot(one), way.dot(two)];
            (n11 * a * a + n22 * b * b + 2.0 * n12 * a * b) / thickness
        };
        Ok([along(axis.cross(normal).normalize_or_zero()), along(axis)])
    }

    /// Forces and moments of a shell at natural coordinates in a history, heat included.
    ///
    /// # Errors
    /// [`Failure::Element`] if it is folded.
    pub(crate) fn resultants(
        &self,
        shell: usize,
        [r, s]: [f64; 2],
        history: &History,
    ) -> Result<Resultants, Failure> {
        let (element, elastic) = self.shell(shell)?;
        let [_, warmth] = self.warmth([history.time; 2]);
        let warm = self.thin_warmth(self.model.mesh.shells[shell].nodes, &warmth);
        let initial = |point: usize| heated(&elastic, element.thickness, &warm, quad::GAUSS[point]);
        let u = self.thin_strained(shell, history, &history.x);
        let mut found =
            element.resultants(&u, initial, r, s).map_err(|source| self.of_shell(shell, source))?;
        let free = heated(&elastic, element.thickness, &warm, (r, s, 1.0));
        found.membrane.iter_mut().zip(free).for_each(|(n, free)| *n += free);
        Ok(found)
    }

    /// Weight of shells and rods under an acceleration, or pressure on shells.
    pub(super) fn add_thin_load(
        &self,
        action: &Action,
        time: f64,
        mut add: impl FnMut(u32, DVec3),
    ) -> Result<(), Failure> {
        let mesh = &self.model.mesh;
        let mut spread = |shell: usize, force: &dyn Fn(DVec3) -> DVec3| -> Result<(), Failure> {
            let element = self.shell(shell)?.0;
            let load = element
                .load(|_, normal| force(normal))
                .map_err(|source| self.of_shell(shell, source))?;
            mesh.shells[shell]
                .nodes
                .iter()
                .zip(load.as_chunks::<3>().0)
                .for_each(|(&n, f)| add(n, DVec3::from_array(*f)));
            Ok(())
        };
        match action {
            Action::Weight(acceleration) => {
                for shell in (0..mesh.shells.len()).filter(|&s| self.thin_is_alive(s, time)) {
                    let (element, elastic) = self.shell(shell)?;
                    spread(shell, &|_| elastic.density * element.thickness * *acceleration)?;
                }
                for (_, rod) in mesh
                    .rods
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| self.thin_is_alive(mesh.shells.len() + i, time))
                {
                    let Matter::Bar { area, density, .. } =
                        self.model.bodies[rod.region as usize].matter
                    else {
                        continue;
                    };
                    let [a, b] = rod.nodes.map(|n| mesh.nodes[n as usize]);
                    rod.nodes.iter().for_each(|&n| {
                        add(n, 0.5 * density * area * a.distance(b) * *acceleration)
                    });
                }
            }
            Action::Shells(pressures) => {
                for &(shell, pressure) in
                    pressures.iter().filter(|(s, _)| self.thin_is_alive(*s as usize, time))
                {
                    spread(shell as usize, &|normal| pressure * normal)?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn shell(&self, shell: usize) -> Result<(Shell, Elastic), Failure> {
        let cell = &self.model.mesh.shells[shell];
        let Matter::Shell { elastic, thickness } = self.model.bodies[cell.region as usize].matter
        else {
            return Err(Failure::Kind {
                element: self.model.mesh.name(ElementId::Shell(shell as u32)),
            });
        };
        let nodes = cell.nodes.map(|n| self.model.mesh.nodes[n as usize]);
        Ok((Shell { nodes, thickness, young: elastic.modulus, poisson: elastic.poisson }, elastic))
    }

    fn bar(&self, rod: usize) -> Result<Rod<'_>, Failure> {
        match &self.model.bodies[self.model.mesh.rods[rod].region as usize].matter {
            Matter::Bar { steel, area, expansion, .. } => {
                Ok(Rod { steel, area: *area, expansion: *expansion })
            }
            _ => Err(Failure::Kind { element: self.model.mesh.name(ElementId::Rod(rod as u32)) }),
        }
    }

    /// Stress, tangent and memory of a bar at displacements `x`.
    fn rod(&self, rod: usize, trial: Trial, x: &[f64]) -> Result<(f64, f64, BarState), Failure> {
        let (cell, bar) = (&self.model.mesh.rods[rod], self.bar(rod)?);
        let u: [f64; 6] = self.thin_strained(self.model.mesh.shells.len() + rod, trial.history, x);
        let [a, b] = cell.nodes.map(|n| self.model.mesh.nodes[n as usize]);
        let (along, apart) = (b - a, DVec3::new(u[3] - u[0], u[4] - u[1], u[5] - u[2]));
        let [ta, tb] = self.thin_warmth(cell.nodes, &trial.warmth[1]);
        let strain = along.dot(apart) / along.length_squared() - 0.5 * bar.expansion * (ta + tb);
        Ok(bar.steel.respond(strain, &trial.history.bars[rod]))
    }

    fn thin_warmth<const N: usize>(&self, nodes: [u32; N], warmth: &[f64]) -> [f64; N] {
        nodes.map(|n| warmth.get(n as usize).copied().unwrap_or(0.0))
    }

    fn of_shell(&self, shell: usize, source: crate::element::ElementError) -> Failure {
        Failure::Element { element: self.model.mesh.name(ElementId::Shell(shell as u32)), source }
    }

    fn of_rod(&self, rod: usize, source: crate::element::ElementError) -> Failure {
        Failure::Element { element: self.model.mesh.name(ElementId::Rod(rod as u32)), source }
    }
}

/// Membrane forces that hold back the expansion, −E h α T/(1 − ν) (N/m).
fn heated(
    elastic: &Elastic,
    thickness: f64,
    warm: &[f64; 4],
    (r, s, _): (f64, f64, f64),
) -> [f64; 3] {
    let warmth: f64 = quad::shape(r, s).iter().zip(warm).map(|(n, t)| n * t).sum();
    let force = -elastic.modulus * thickness * elastic.expansion * warmth / (1.0 - elastic.poisson);
    [force, force, 0.0]
}

fn fill<const N: usize>(element: &Element<N>, k: &mut [f64], f: &mut [f64]) {
    k.copy_from_slice(element.stiffness.as_flattened());
    f.copy_from_slice(&element.force);
}

#[cfg(test)]
mod tests {
    use intrados_stage::Job;

    use super::*;
    use crate::{
        mesh::{Cell, block},
        model::{Body, Drive, Load, March, MarchSettings, Model},
    };

    const STEEL: Bar = Bar::elastic(200e9);

    fn solve(model: &Model, time: f64) -> History {
        let structure = System::new(model).unwrap();
        let mut march = March::new(
            &structure,
            structure.rest(0.0),
            Drive::Loads,
            MarchSettings { tolerance: 1e-9, ..MarchSettings::default() },
        );
        march.advance(time, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
        march.history
    }

    /// A square sheet, 30 K warmer: free it grows without force, held it is pressed by E h α T/(1 −
    /// ν).
    #[test]
    fn a_warm_sheet_grows_or_presses() {
        let elastic = Elastic { modulus: 200e9, poisson: 0.3, expansion: 1.2e-5, density: 7850.0 };
        let nodes = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let shells = vec![Cell { nodes: [0, 1, 2, 3], region: 0 }];
        let mesh = Mesh { nodes, shells, regions: vec!["sheet".into()], ..Mesh::default() };
        let bodies = vec![Body {
            matter: Matter::Shell { elastic, thickness: 0.01 },
            birth: f64::NEG_INFINITY,
        }];
        let loads = vec![Load {
            name: "heat".into(),
            action: Action::Temperature(vec![30.0; 4]),
            history: vec![],
        }];
        let mut model = Model { mesh, bodies, loads, ..Model::default() };
        model.holds = vec![(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (3, 0), (3, 2)];
        let history = solve(&model, 1.0);
        assert!(
            (history.x[6] / 3.6e-4 - 1.0).abs() < 1e-9
                && (history.x[7] / 3.6e-4 - 1.0).abs() < 1e-9,
            "{:?}",
            history.x
        );
        let force = 200e9 * 0.01 * 3.6e-4 / 0.7;
        let membrane = |model: &Model, history: &History| {
            System::new(model).unwrap().resultants(0, [0.2, -0.4], history).unwrap().membrane
        };
        assert!(membrane(&model, &history).iter().all(|n| n.abs() < 1e-9 * force));
        let rotations = Rotations::new(&model.mesh);
        assert_eq!(
            (rotations.of(2), rotations.owner(6), rotations.owner(3)),
            (Some(6), Some(2), None)
        );
        model.holds = (0..7).flat_map(|n| [(n, 0), (n, 1), (n, 2)]).collect();
        let held = membrane(&model, &solve(&model, 1.0));
        assert!(
            (held[0] / force + 1.0).abs() < 1e-9
                && (held[1] / force + 1.0).abs() < 1e-9
                && held[2].abs() < 1e-9 * force,
            "{held:?}"
        );
    }

    /// A bar under load and a second one at the same nodes, born later: it bears half of what comes
    /// later. An initial stress adds up.
    #[test]
    fn bars_are_born_free_and_keep_what_they_had() {
        let rods = vec![Cell { nodes: [0, 1], region: 0 }, Cell { nodes: [0, 1], region: 1 }];
        let mesh = Mesh {
            nodes: vec![DVec3::ZERO, DVec3::X],
            rods,
            regions: vec!["a".into(), "b".into()],
            ..Mesh::default()
        };
        let bar = |birth: f64| Body {
            matter: Matter::Bar { steel: STEEL, area: 1e-3, expansion: 0.0, density: 0.0 },
            birth,
        };
        let pull = Load {
            name: "pull".into(),
            action: Action::Nodes(vec![(1, 1e4 * DVec3::X)]),
            history: vec![(0.0, 0.0), (3.0, 3.0)],
        };
        let mut model = Model {
            mesh,
            bodies: vec![bar(f64::NEG_INFINITY), bar(1.5)],
            loads: vec![pull],
            ..Model::default()
        };
        model.holds = vec![(0, 0), (0, 1), (0, 2), (1, 1), (1, 2)];
        let structure = System::new(&model).unwrap();
        let mut march =
            March::new(&structure, structure.rest(0.0), Drive::Loads, MarchSettings::default());
        for (time, expected) in [(1.0, [10e6, 0.0]), (3.0, [20e6, 10e6])] {
            march.advance(time, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
            let found = [0, 1].map(|rod| structure.bar_stress(rod, &march.history).unwrap());
            assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1.0), "{time} {found:?}");
        }
        model.bodies[1].birth = f64::NEG_INFINITY;
        model.initial.insert(ElementId::Rod(1), [5e6, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let history = solve(&model, 1.0);
        let found =
            [0, 1].map(|rod| System::new(&model).unwrap().bar_stress(rod, &history).unwrap());
        assert!((found[0] - 2.5e6).abs() < 1.0 && (found[1] - 7.5e6).abs() < 1.0, "{found:?}");
    }

    /// A brick with a stress that nothing balances lets it go; held, it keeps it.
    #[test]
    fn a_brick_keeps_its_initial_stress_where_it_is_held() {
        let mesh = block(&[0.0, 1.0], &[0.0, 1.0], &[0.0, 1.0], "brick").unwrap();
        let matter =
            Matter::Elastic(Elastic { modulus: 30e9, poisson: 0.0, expansion: 0.0, density: 0.0 });
        let mut model =
            Model { bodies: vec![Body { matter, birth: f64::NEG_INFINITY }], ..Model::default() };
        model.initial.insert(ElementId::Hex(0), [3e6, 0.0, 0.0, 0.0, 0.0, 0.0]);
        for (i, p) in mesh.nodes.iter().enumerate() {
            (0..3)
                .filter(|&c| p[usize::from(c)] == 0.0)
                .for_each(|c| model.holds.push((i as u32, c)));
        }
        model.mesh = mesh;
        for (held, stress, moved) in [(false, 0.0, -1e-4), (true, 3e6, 0.0)] {
            if held {
                model.holds.extend(
                    (0..8)
                        .filter(|&n| model.mesh.nodes[n as usize].x > 0.5)
                        .map(|n| (n, 0))
                        .collect::<Vec<_>>(),
                );
            }
            let history = solve(&model, 1.0);
            let found = System::new(&model).unwrap().points(0, &history).unwrap()[3].stress[0];
            let end = model.mesh.nodes.iter().position(|p| *p == DVec3::ONE).unwrap();
            assert!(
                (found - stress).abs() < 1.0 && (history.x[3 * end] - moved).abs() < 1e-12,
                "{held} {found} {}",
                history.x[3 * end]
            );
        }
    }
}
