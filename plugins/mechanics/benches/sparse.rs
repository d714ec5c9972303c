//! Linear solvers: `cargo bench -p intrados-mechanics --bench sparse`.
//!
//! First a table of CPU-seconds and peak memory, each case in a process of its own: the thick
//! cylinder of the peer decks (CalculiX SPOOLES at 199 260 unknowns: 82 CPU-s, 3.5 GB) and a cube
//! of a million. `-- CASE METHOD` runs one line. Then divan's wall-clock figures.
#![allow(clippy::print_stdout, reason = "a bench reports")]

use std::process::Command;

use divan::Bencher;
use intrados_mechanics::sparse::*;
use intrados_stage::{Job, cpu_seconds};

#[allow(dead_code, reason = "tests and benches take different parts")]
mod brick;
use brick::Bricks;

/// Name, method, and whether it runs without being asked for.
const CASES: [(&str, Method); 8] = [
    ("cylinder31k", Method::Direct),
    ("cylinder31k", Method::Multigrid),
    ("cylinder109k", Method::Multigrid),
    ("cylinder199k", Method::Jacobi),
    ("cylinder199k", Method::Multigrid),
    ("cylinder199k", Method::Direct),
    ("lining", Method::Multigrid),
    ("cube1m", Method::Multigrid),
];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    if let [case, method] = &arguments[..] {
        match CASES.iter().find(|(name, m)| name == case && format!("{m:?}") == *method) {
            Some((name, method)) => run(name, *method),
            None => println!("no such case: {CASES:?}"),
        }
        return;
    }
    println!(
        "case               unknowns  method     assembly    setup    solve   CPU-s in all    iterations   peak MB   largest u"
    );
    for (name, method) in CASES {
        let exe = std::env::current_exe().expect("it runs");
        let output = Command::new(exe)
            .args([name, &format!("{method:?}")])
            .output()
            .expect("it can run again");
        print!(
            "{}{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
    }
    divan::main();
}

/// The system of a case.
fn case(name: &str) -> (BlockMatrix<3>, Vec<f64>, Constraints<3>) {
    match name {
        "cylinder31k" => cylinder([20, 40, 11]),
        "cylinder109k" => cylinder([28, 56, 21]),
        "cylinder199k" => cylinder([40, 80, 19]),
        "lining" => brick::lining(120),
        _ => cube(69),
    }
}

/// Assembles and solves in this process.
fn run(name: &str, method: Method) {
    let job = Job::default();
    let (matrix, rhs, constraints) = case(name);
    let assembled = cpu_seconds();
    let mut solver = Solver::new(&matrix, &constraints, method, &job).expect("it is held");
    let set_up = cpu_seconds();
    let solution = solver.solve(&matrix, &rhs, &constraints, 1e-8, &job).expect("it is definite");
    let end = cpu_seconds();
    println!(
        "{name:<16} {:>10}  {:<9} {assembled:>9.2} {:>8.2} {:>8.2} {end:>14.2} {:>13} {:>9} {:>11.5e}",
        matrix.unknowns(),
        format!("{method:?}"),
        set_up - assembled,
        end - set_up,
        solution.iterations,
        peak_megabytes(),
        solution.x.iter().fold(0.0, |m: f64, v| m.max(v.abs())),
    );
}

fn peak_megabytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()).and_then(|n| n.parse::<u64>().ok()).unwrap_or(0)
        / 1000
}

/// Plane strain, a pressure of 1 inside, E = 30 000 (as the peer decks).
fn cylinder(size: [usize; 3]) -> (BlockMatrix<3>, Vec<f64>, Constraints<3>) {
    brick::thick_cylinder(size)
}

/// A unit cube on its face, pushed on the opposite one.
fn cube(n: usize) -> (BlockMatrix<3>, Vec<f64>, Constraints<3>) {
    brick::pushed_cube(n, |_| 3e10)
}

#[divan::bench(args = [(Method::Direct, 8), (Method::Multigrid, 8), (Method::Multigrid, 24)])]
fn solve_cube(bencher: Bencher, (method, n): (Method, usize)) {
    let (matrix, rhs, constraints) = cube(n);
    bencher.bench_local(|| solve(&matrix, &rhs, &constraints, method, 1e-8, &Job::default()));
}

#[divan::bench]
fn multiply(bencher: Bencher) {
    let (matrix, rhs, _) = cube(24);
    let mut y = rhs.clone();
    bencher.bench_local(|| matrix.multiply(&rhs, &mut y));
}

#[divan::bench]
fn assemble(bencher: Bencher) {
    let bricks = Bricks::cube(24);
    bencher.bench_local(|| bricks.stiffness(|_| 1.0));
}
