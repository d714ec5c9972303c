//! The bridge of `infra-bridge.ifc` as one frame, held against the same frame in CalculiX: bars as
//! B32 with rectangles, plates as S4, rigid arms as beams a million times as stiff.
//!
//! What moves most, the slabs at both ends, agrees within .8 %, girders and deck within 3 %, piers
//! and arches do not: CalculiX makes bricks of beams, and sections that no knot holds do not stay
//! plane under a force in their middle. A cantilever of 2.3 m and 1.1 × 1.8 m, pressed by a force,
//! shortens there by 1.6, 2.4 and 2.9 times F L/E A as one, two and four B32. So this is a check of
//! geometry alone; `tests/whole_opensees.py` has the same frame of lines, where every member agrees
//! within .5 %.
//!
//! ```text
//! # bridge.glb: buildingSMART's infra-bridge.ifc in glTF, converted by IfcOpenShell
//! INTRADOS_BRIDGE=bridge.glb cargo test --release -p intrados-mechanics --lib frame::peer -- --ignored --nocapture
//! ```

use std::{collections::BTreeMap, fmt::Write as _, path::Path, process::Command};

use glam::DVec3;
use intrados_scene::{Scene, structure::Action};
use intrados_stage::Job;

use super::{
    draft::{Built, Draft, Elements},
    model::{Case, End, Model, System},
    section::Section,
    whole::{own_weight, whole},
};
use crate::{member::GRAVITY, model::Elastic};

/// Arms shorter than this are none, m.
const ARM: f64 = 1e-3;

/// A deck as it grows.
#[derive(Default)]
struct Deck {
    nodes: Vec<DVec3>,
    /// By node of the model: its number here.
    hubs: Vec<usize>,
    /// Places beside a node, by millimetre.
    beside: BTreeMap<(u32, [i64; 3]), usize>,
    beams: String,
    sections: String,
    elements: usize,
    loads: BTreeMap<usize, DVec3>,
}

impl Deck {
    fn node(&mut self, at: DVec3) -> usize {
        self.nodes.push(at);
        self.nodes.len()
    }

    /// The node of a fastening; a rigid arm to it where it is new.
    fn fastened(&mut self, model: &Model, end: &End) -> usize {
        let hub = self.hubs[end.node as usize];
        if end.arm.length() < ARM {
            return hub;
        }
        let key = (end.node, end.arm.to_array().map(|x| (1e3 * x).round() as i64));
        if let Some(&known) = self.beside.get(&key) {
            return known;
        }
        let from = model.nodes[end.node as usize];
        let node = self.node(from + end.arm);
        self.beside.insert(key, node);
        let across = end.arm.normalize().any_orthonormal_vector();
        // Slender, so that what CalculiX makes of where beams meet turns none inside out.
        let size = 0.25 * end.arm.length();
        self.beam([hub, node], [from, from + end.arm], [size; 2], across, "RIGID");
        node
    }

    fn beam(
        &mut self,
        ends: [usize; 2],
        places: [DVec3; 2],
        [high, wide]: [f64; 2],
        across: DVec3,
        material: &str,
    ) {
        let middle = self.node(0.5 * (places[0] + places[1]));
        self.elements += 1;
        let n = self.elements;
        // Writing to a string cannot fail.
        let _ = writeln!(
            self.beams,
            "*ELEMENT, TYPE=B32, ELSET=E{n}\n{n}, {}, {middle}, {}",
            ends[0], ends[1]
        );
        let _ = writeln!(
            self.sections,
            "*BEAM SECTION, ELSET=E{n}, MATERIAL={material}, SECTION=RECT\n{high:.9}, {wide:.9}\n{:.9}, {:.9}, {:.9}",
            across.x, across.y, across.z
        );
    }

    fn of(model: &Model, case: &Case, density: f64) -> Self {
        let mut deck = Self::default();
        for &at in &model.nodes {
            let hub = deck.node(at);
            deck.hubs.push(hub);
        }
        let mut heavy = String::from("*ELSET, ELSET=HEAVY\n");
        for (beam, ends) in &model.beams {
            let [a, b] = ends.map(|e| deck.fastened(model, &e));
            let size = beam.section.reach.map(|r| 2.0 * r);
            deck.beam([a, b], beam.ends, size, beam.across, "CONCRETE");
            let _ = writeln!(heavy, "{}", deck.elements);
        }
        for (k, (plate, ends)) in model.plates.iter().enumerate() {
            let nodes = ends.map(|e| deck.fastened(model, &e));
            deck.elements += 1;
            let n = deck.elements;
            let [a, b, c, d] = nodes;
            let _ = writeln!(deck.beams, "*ELEMENT, TYPE=S4, ELSET=E{n}\n{n}, {a}, {b}, {c}, {d}");
            let _ = writeln!(
                deck.sections,
                "*SHELL SECTION, ELSET=E{n}, MATERIAL=CONCRETE\n{:.9}",
                plate.thickness
            );
            let _ = writeln!(heavy, "{n}");
            let area = plate.area();
            for (_, pressure) in case.plates.iter().filter(|c| c.0 as usize == k) {
                // Its weight acts by itself.
                let more = *pressure + plate.thickness * density * GRAVITY * DVec3::Y;
                nodes.iter().for_each(|n| *deck.loads.entry(*n).or_default() += 0.25 * area * more);
            }
        }
        deck.sections += &heavy;
        deck
    }

    /// Which node a fastening has become.
    fn known(&self, end: &End) -> usize {
        let key = (end.node, end.arm.to_array().map(|x| (1e3 * x).round() as i64));
        self.beside.get(&key).copied().unwrap_or(self.hubs[end.node as usize])
    }

    /// How far all nodes of members move here, for other programs to be held against.
    fn tell(&self, draft: &Draft, built: &Built, x: &[f64], path: &Path) {
        let mut text = String::from("member,kind,node,x_m,y_m,z_m\n");
        for part in &draft.parts {
            let (id, kind) = (&part.assembly.id, part.assembly.kind);
            for end in &built.ends[part.first..part.first + part.points.len()] {
                let u = end.moved(&built.model, x)[0];
                let node = self.known(end);
                let _ = writeln!(text, "{id},{kind:?},{node},{:e},{:e},{:e}", u.x, u.y, u.z);
            }
        }
        std::fs::write(path, text).unwrap();
    }

    fn text(&self, model: &Model, concrete: &Elastic) -> String {
        let (young, poisson) = (concrete.modulus, 0.0);
        let mut text = String::from("*NODE, NSET=ALL\n");
        for (i, p) in self.nodes.iter().enumerate() {
            let _ = writeln!(text, "{}, {:.9}, {:.9}, {:.9}", i + 1, p.x, p.y, p.z);
        }
        text += &self.beams;
        for (name, e, density) in
            [("CONCRETE", young, concrete.density), ("RIGID", 1e6 * young, 1e-6)]
        {
            let _ = writeln!(
                text,
                "*MATERIAL, NAME={name}\n*ELASTIC\n{e:.6e}, {poisson}\n*DENSITY\n{density}"
            );
        }
        text += &self.sections;
        text += "*NSET, NSET=GROUND\n";
        let mut held: Vec<usize> = model.holds.iter().map(|h| self.hubs[h.0 as usize]).collect();
        held.dedup();
        held.iter().for_each(|n| {
            let _ = writeln!(text, "{n}");
        });
        text += "*BOUNDARY\nGROUND, 1, 6\n*STEP\n*STATIC\n";
        let _ = writeln!(text, "*DLOAD\nHEAVY, GRAV, {GRAVITY}, 0., -1., 0.");
        text += "*CLOAD\n";
        for (node, force) in &self.loads {
            for (i, f) in force.to_array().iter().enumerate().filter(|f| f.1.abs() > 1e-6) {
                let _ = writeln!(text, "{node}, {}, {f:.9e}", i + 1);
            }
        }
        text + "*NODE PRINT, NSET=ALL\nU\n*NODE PRINT, NSET=GROUND\nRF\n*END STEP\n"
    }
}

/// Vectors by node of a table of CalculiX, the first whose head has this word.
fn vectors(text: &str, word: &str) -> BTreeMap<usize, DVec3> {
    let rows = text.lines().skip_while(|l| !l.contains(word)).skip(1);
    let row = |line: &str| {
        let cells: Vec<&str> = line.split_whitespace().collect();
        let [node, x, y, z] = cells[..] else { return None };
        let number = |t: &str| t.parse::<f64>().ok();
        Some((node.parse().ok()?, DVec3::new(number(x)?, number(y)?, number(z)?)))
    };
    rows.skip_while(|l| l.trim().is_empty()).map_while(row).collect()
}

/// The frame as CalculiX knows it. Its beams are bricks of 20 nodes, one across: every section the
/// rectangle of its area and I_z, whose shear is even (no cubic warps it: all of the area) and which
/// warps by y z in torsion, J = 4 I_y I_z/(I_y + I_z). And no contraction across, which bricks that
/// are held at a foot would resist and a line does not know.
/// And every sheet has one thickness, since there nodes have it and not elements.
fn as_bricks(model: &mut Model, elements: &[Elements]) {
    for plates in elements.iter().map(|e| e.plates.clone()).filter(|plates| !plates.is_empty()) {
        let plates = &mut model.plates[plates];
        let mean = plates.iter().map(|p| p.0.thickness).sum::<f64>() / plates.len() as f64;
        plates.iter_mut().for_each(|p| p.0.thickness = mean);
    }
    for (beam, _) in &mut model.beams {
        let high = (12.0 * beam.section.second[1] / beam.section.area).sqrt();
        let section = Section::rectangle(high, beam.section.area / high);
        let [y, z] = section.second;
        let (shear, torsion) = ([section.area; 2], 4.0 * y * z / (y + z));
        beam.section = Section { shear, torsion, ..section };
        beam.moduli[1] = 0.5 * beam.moduli[0];
    }
    model.plates.iter_mut().for_each(|(plate, _)| plate.poisson = 0.0);
}

fn run(folder: &Path) -> String {
    let done = Command::new("ccx").arg("whole").current_dir(folder).output().unwrap();
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    let text = std::fs::read_to_string(folder.join("whole.dat")).unwrap_or_default();
    assert!(!text.is_empty(), "{}", said.lines().rev().take(30).collect::<Vec<_>>().join("\n"));
    text
}

#[test]
#[ignore = "wants CalculiX and the bridge as GLB in INTRADOS_BRIDGE"]
fn the_slabs_of_the_bridge_sag_as_in_calculix() {
    let path = std::env::var("INTRADOS_BRIDGE").unwrap();
    let scene = Scene::load(Path::new(&path), &Job::default()).unwrap();
    let job = Job::default();
    let draft = Draft::new(&scene, &job).unwrap();
    let mut built = draft.build(None);
    as_bricks(&mut built.model, &built.elements);
    let weight = own_weight();
    assert!(matches!(weight.action, Action::SelfWeight));
    let mut case = super::whole::case(&draft, &built, &weight, &mut Vec::new());
    // There a beam weighs what its section does, and no more.
    for (b, along) in &mut case.beams {
        let area = built.model.beams[*b as usize].0.section.area;
        along.force = -GRAVITY * draft.parts[0].matter.law.density * area * DVec3::Y;
    }
    // Plates likewise, and 5 kN/m² on the sheets that lie.
    case.plates.clear();
    for (k, (plate, _)) in built.model.plates.iter().enumerate() {
        let own = -GRAVITY * draft.parts[0].matter.law.density * plate.thickness * DVec3::Y;
        case.plates.push((k as u32, own));
        let [a, b, c, d] = plate.nodes;
        if (c - a).cross(d - b).normalize().y.abs() > 0.7 {
            case.plates.push((k as u32, -5e3 * DVec3::Y));
        }
    }
    let found = System::new(&built.model, &job).unwrap().solve(&case, &job).unwrap();
    println!("unbalanced {:.1e}, hanging {:?}", found.unbalanced, built.hanging);
    // The deck has both parts of the plates' load in one.
    let mut sums: BTreeMap<u32, DVec3> = BTreeMap::new();
    case.plates.iter().for_each(|(k, p)| *sums.entry(*k).or_default() += *p);
    let merged = Case { plates: sums.into_iter().collect(), ..case.clone() };
    let concrete = &draft.parts[0].matter.law;
    let deck = Deck::of(&built.model, &merged, concrete.density);
    let folder = tempfile::tempdir().unwrap();
    let text = deck.text(&built.model, concrete);
    std::fs::write(folder.path().join("whole.inp"), &text).unwrap();
    let keep = std::env::var_os("INTRADOS_KEEP").map(std::path::PathBuf::from);
    if let Some(keep) = &keep {
        std::fs::write(keep.join("whole.inp"), &text).unwrap();
    }
    let text = run(folder.path());
    if let Some(keep) = &keep {
        deck.tell(&draft, &built, &found.x, &keep.join("moved.csv"));
    }
    let (moved, pushed) = (vectors(&text, "displacements"), vectors(&text, "forces"));
    println!("{:28} {:>10} {:>10} {:>7}", "member", "ours mm", "ccx mm", "off %");
    let (mut worst, mut largest) = (0.0_f64, (0.0, 0.0));
    for (p, part) in draft.parts.iter().enumerate().filter(|(p, _)| !built.hanging.contains(p)) {
        let ends = &built.ends[part.first..part.first + part.points.len()];
        let most = ends.iter().map(|end| {
            let ours = end.moved(&built.model, &found.x)[0];
            let node = deck.known(end);
            (ours, moved.get(&node).copied().unwrap_or(DVec3::NAN))
        });
        let (ours, theirs) = most.max_by(|a, b| a.0.length().total_cmp(&b.0.length())).unwrap();
        let off = ours.distance(theirs) / ours.length();
        worst = worst.max(off);
        if ours.length() > largest.0 {
            largest = (ours.length(), off);
        }
        let name = format!("{p} {:?} {}", part.assembly.kind, &part.assembly.id[..8]);
        println!(
            "{name:28} {:10.5} {:10.5} {:7.3}",
            1e3 * ours.length(),
            1e3 * theirs.length(),
            100.0 * off
        );
    }
    for (node, [force, _]) in &found.reactions {
        let theirs = pushed.get(&deck.hubs[*node as usize]).copied().unwrap_or(DVec3::NAN);
        println!("ground {node}: ours {force:.0} ccx {theirs:.0}");
    }
    println!("largest difference {:.3} %", 100.0 * worst);
    assert!(found.unbalanced < 1e-9 && largest.1 < 0.01, "{largest:?}");
    let told = whole(&scene, true, &job).unwrap();
    for r in &told.redundancy {
        println!("without {}: stands {}, {:?} {:?}", r.without, r.stands, r.falls, r.largest_rise);
    }
    told.notes.iter().for_each(|note| println!("{note}"));
    if let Some(keep) = keep {
        let [bars, plates] = ["bars.vtu", "plates.vtu"].map(|name| keep.join(name));
        told.write_vtu(&bars, &plates, &scene.hash).unwrap();
        std::fs::write(keep.join("end_forces.csv"), told.csv()).unwrap();
    }
}
