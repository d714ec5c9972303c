//! Renders what the network learns from, one file a lesson; goes on where it was stopped:
//! `cargo run --release -p intrados-photo --example lessons -- FOLDER COUNT [FIRST] [SEED] [ORDERS]`,
//! with 2 orders in direct light only, with 0 pasted: no light at all.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example for people")]

use std::path::PathBuf;

use intrados_light::patch::ORDERS;
use intrados_photo::marks::lesson::Lesson;
use intrados_stage::{Job, cpu_seconds};

fn main() {
    let mut args = std::env::args().skip(1);
    let folder = PathBuf::from(args.next().expect("a folder"));
    let mut number = |or: u64| args.next().map_or(or, |a| a.parse().unwrap());
    let (count, first, seed) = (number(3000), number(0), number(1));
    let orders = number(ORDERS.into()) as u32;
    std::fs::create_dir_all(&folder).unwrap();
    for n in first..first + count {
        let path = folder.join(format!("{n:05}.lesson"));
        if path.exists() {
            continue;
        }
        Lesson::render(seed, n, orders, &Job::default()).unwrap().write(&path).unwrap();
        if n % 50 == 0 {
            println!("{n}: {:.0} CPU-s", cpu_seconds());
        }
    }
}
