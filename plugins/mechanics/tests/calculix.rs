//! The peer: CalculiX with SPOOLES on the same decks. Slow, so they are asked for by name:
//!
//! ```text
//! cargo test --release -p intrados-mechanics --test calculix -- --ignored --nocapture --test-threads 1
//! ```
//!
//! `CCX` names the program, else `ccx` is looked for (Debian: `apt-get install calculix-ccx`, 2.20);
//! without it the comparison fails. Costs are those of whole runs, from reading the deck to the written result, each in a
//! process of its own, one after the other: CPU-seconds of all threads, and the largest resident
//! memory. They are read from `/proc` and known on Linux only.

#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use intrados_mechanics::{
    deck::Case,
    model::{MarchSettings, System},
    read::{Units, abaqus},
    write::{Field, Grid},
};
use intrados_stage::Job;

/// What a run took.
#[derive(Debug, Clone, Copy, Default)]
struct Cost {
    wall: f64,
    cpu: f64,
    megabytes: f64,
}

/// Bricks along the three directions.
type Size = [usize; 3];

fn number([nx, ny, _]: Size, [i, j, k]: [usize; 3]) -> usize {
    1 + i + (nx + 1) * (j + (ny + 1) * k)
}

/// Nodes, bricks, material; E = 30000, ν = .2.
fn body(size: Size, place: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let [nx, ny, nz] = size;
    let mut text = String::from("*NODE, NSET=NALL\n");
    for (k, j, i) in all([nx + 1, ny + 1, nz + 1]) {
        let [x, y, z] = place([i as f64 / nx as f64, j as f64 / ny as f64, k as f64 / nz as f64]);
        writeln!(text, "{},{x:.9},{y:.9},{z:.9}", number(size, [i, j, k])).unwrap();
    }
    text += "*ELEMENT, TYPE=C3D8, ELSET=EALL\n";
    for (e, (k, j, i)) in all(size).enumerate() {
        write!(text, "{}", e + 1).unwrap();
        for (a, b, c) in
            [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        {
            write!(text, ",{}", number(size, [i + a, j + b, k + c])).unwrap();
        }
        text.push('\n');
    }
    text + "*MATERIAL,NAME=C\n*ELASTIC\n30000.0,0.2\n*SOLID SECTION,ELSET=EALL,MATERIAL=C\n*BOUNDARY\n"
}

/// (k, j, i), i fastest.
fn all([nx, ny, nz]: Size) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
}

const OUTPUT: &str = "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n";

/// A quarter of a thick tube, a = 1, b = 2, under inner pressure 1, in plane strain.
fn tube(size: Size) -> String {
    let [nx, ny, nz] = size;
    let mut text = body(size, |[r, t, z]| {
        let (sin, cos) = (t * std::f64::consts::FRAC_PI_2).sin_cos();
        [(1.0 + r) * cos, (1.0 + r) * sin, z]
    });
    for k in 0..=nz {
        for i in 0..=nx {
            writeln!(text, "{},2,2\n{},1,1", number(size, [i, 0, k]), number(size, [i, ny, k]))
                .unwrap();
        }
    }
    for j in 0..=ny {
        for i in 0..=nx {
            writeln!(text, "{},3,3\n{},3,3", number(size, [i, j, 0]), number(size, [i, j, nz]))
                .unwrap();
        }
    }
    text += "*STEP\n*STATIC,SOLVER=SPOOLES\n*DLOAD\n";
    for k in 0..nz {
        for j in 0..ny {
            writeln!(text, "{},P6,1.0", 1 + nx * (j + ny * k)).unwrap();
        }
    }
    text + OUTPUT
}

/// A cube clamped at x = 0 and pushed aside at x = 1.
fn cube(n: usize) -> String {
    let size = [n; 3];
    let mut text = body(size, |p| p);
    let mut load = String::from("*STEP\n*STATIC,SOLVER=SPOOLES\n*CLOAD\n");
    for k in 0..=n {
        for j in 0..=n {
            writeln!(text, "{},1,3", number(size, [0, j, k])).unwrap();
            let share = [j, k].map(|c| if c == 0 || c == n { 0.5 } else { 1.0 });
            writeln!(
                load,
                "{},3,{:e}",
                number(size, [n, j, k]),
                -share[0] * share[1] / (n * n) as f64
            )
            .unwrap();
        }
    }
    text + &load + OUTPUT
}

/// CalculiX: a comparison without its peer is no comparison.
fn ccx() -> PathBuf {
    let named = std::env::var_os("CCX").map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    named
        .or_else(|| std::env::split_paths(&path).map(|p| p.join("ccx")).find(|p| p.is_file()))
        .expect("CalculiX: `apt-get install calculix-ccx`, or name ccx by CCX")
}

/// Waits for a process and watches what it takes.
fn watch(mut child: Child) -> Cost {
    let (begin, mut cost) = (Instant::now(), Cost::default());
    let process = PathBuf::from(format!("/proc/{}", child.id()));
    loop {
        let done = child.try_wait().unwrap();
        if let Some((cpu, megabytes)) = used(&process) {
            (cost.cpu, cost.megabytes) = (cost.cpu.max(cpu), cost.megabytes.max(megabytes));
        }
        if let Some(status) = done {
            assert!(status.success(), "{status}");
            cost.wall = begin.elapsed().as_secs_f64();
            return cost;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// CPU-seconds so far (of threads that are gone too) and largest resident memory.
fn used(process: &Path) -> Option<(f64, f64)> {
    let stat = fs::read_to_string(process.join("stat")).ok()?;
    // After the name in brackets, which may hold anything: state is field 3, utime and stime 14 and
    // 15, in hundredths.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    let status = fs::read_to_string(process.join("status")).ok()?;
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some((ticks / 100.0, peak.split_whitespace().next()?.parse::<f64>().ok()? / 1024.0))
}

fn theirs(ccx: &Path, folder: &Path, job: &str) -> (Cost, Vec<[f64; 3]>) {
    let mut command = Command::new(ccx);
    command.arg(job).current_dir(folder).stdout(Stdio::null()).env("OMP_NUM_THREADS", "2");
    let cost = watch(command.spawn().unwrap());
    (cost, displacements(&fs::read_to_string(folder.join(format!("{job}.frd"))).unwrap()))
}

/// The block DISP of a result file: fixed columns, six digits.
fn displacements(frd: &str) -> Vec<[f64; 3]> {
    let block = frd.split(" -4  DISP").nth(1).unwrap();
    let rows =
        block.lines().skip_while(|l| !l.starts_with(" -1")).take_while(|l| l.starts_with(" -1"));
    rows.map(|l| [13, 25, 37].map(|c| l[c..c + 12].trim().parse().unwrap())).collect()
}

/// Runs [`solves_a_deck`] in a process of its own.
fn ours(deck: &Path) -> (Cost, Vec<[f64; 3]>) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--ignored", "--exact", "solves_a_deck", "--nocapture"])
        .env("INTRADOS_DECK", deck)
        .stdout(Stdio::null());
    let cost = watch(command.spawn().unwrap());
    let bytes = fs::read(deck.with_extension("u")).unwrap();
    let numbers: Vec<f64> =
        bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    (cost, numbers.as_chunks::<3>().0.to_vec())
}

/// The whole way of one deck: read, check, assemble, solve, write. Names its deck in
/// `INTRADOS_DECK`; without it there is nothing to do.
#[test]
#[ignore = "is run by the others, in a process of its own"]
fn solves_a_deck() {
    let Some(path) = std::env::var_os("INTRADOS_DECK").map(PathBuf::from) else { return };
    let begin = Instant::now();
    let said = |what: &str| eprintln!("  {what} at {:.2} s", begin.elapsed().as_secs_f64());
    let case = Case::new(abaqus::read(&path, Units::MetreNewton).unwrap()).unwrap();
    said("read");
    let settings = MarchSettings { tolerance: 1e-7, linear: 1e-9, ..MarchSettings::default() };
    let history = case
        .run(settings, &Job::default(), |_, _, step| {
            said(&format!(
                "{} Newton steps, {} iterations, residual {:.1e}",
                step.iterations, step.linear, step.residual
            ));
            Ok(())
        })
        .unwrap();
    let (structure, mesh) = (System::new(&case.model).unwrap(), &case.model.mesh);
    let mut stress = Vec::with_capacity(6 * mesh.hexes.len());
    for hex in 0..mesh.hexes.len() {
        let points = structure.points(hex, &history).unwrap();
        stress.extend((0..6).map(|c| points.iter().map(|p| p.stress[c]).sum::<f64>() / 8.0));
    }
    let displacement = Field { name: "displacement_m", components: 3, values: &history.x };
    let stress = Field { name: "stress_pa", components: 6, values: &stress };
    Grid::solids(mesh).write(&path.with_extension("vtu"), &[displacement], &[stress]).unwrap();
    said("written");
    fs::write(
        path.with_extension("u"),
        history.x.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>(),
    )
    .unwrap();
}

fn in_folder(deck: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deck.inp");
    fs::write(&path, deck).unwrap();
    (folder, path)
}

fn say(who: &str, dof: usize, cost: Cost) {
    eprintln!(
        "{who} {dof} dof: {:.1} s wall, {:.2} CPU-s, {:.0} MB",
        cost.wall, cost.cpu, cost.megabytes
    );
}

/// Largest difference over largest displacement, which CalculiX writes with six digits; and both
/// costs.
fn compare(ccx: &Path, size: Size) -> (f64, Cost, Cost) {
    let (folder, path) = in_folder(&tube(size));
    let (our_cost, our) = ours(&path);
    let (their_cost, their) = theirs(ccx, folder.path(), "deck");
    assert_eq!(our.len(), their.len());
    let largest = their.iter().flatten().fold(0.0, |m: f64, u| m.max(u.abs()));
    let off = our
        .iter()
        .flatten()
        .zip(their.iter().flatten())
        .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
        / largest;
    say("intrados", 3 * our.len(), our_cost);
    say("ccx     ", 3 * our.len(), their_cost);
    eprintln!(
        "u_r(a): {:.9e} and {:.5e}; largest difference {off:.1e} of the largest displacement",
        our[0][0], their[0][0]
    );
    (off, our_cost, their_cost)
}

#[test]
#[ignore = "needs CalculiX (apt: calculix-ccx), which runs for a minute"]
fn answers_as_calculix_to_six_digits() {
    let ccx = ccx();
    for size in [[20, 40, 11], [28, 56, 21]] {
        let (off, ..) = compare(&ccx, size);
        // Half a unit of the sixth digit, at most 5e-6 of the number.
        assert!(off < 5e-6, "{off}");
    }
}

#[test]
#[ignore = "needs CalculiX (apt: calculix-ccx), which runs for some minutes"]
fn costs_an_eighth_of_the_time_and_a_quarter_of_the_memory_at_199_260_unknowns() {
    let ccx = ccx();
    let (off, our, their) = compare(&ccx, [40, 80, 19]);
    assert!(off < 5e-6, "{off}");
    eprintln!("CPU 1/{:.1}, memory 1/{:.1}", their.cpu / our.cpu, their.megabytes / our.megabytes);
    if our.cpu > 0.0 {
        assert!(8.0 * our.cpu <= their.cpu && 4.0 * our.megabytes <= their.megabytes);
    }
}

#[test]
#[ignore = "takes a minute and 4 GB"]
fn a_million_unknowns_take_a_minute_and_four_gigabytes() {
    let (_folder, path) = in_folder(&cube(69));
    let (cost, u) = ours(&path);
    say("intrados", 3 * u.len(), cost);
    assert!(cost.cpu <= 60.0 && cost.megabytes <= 4096.0);
}
