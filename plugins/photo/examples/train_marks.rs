//! Trains the network that reads damage on the lessons of a folder (see the example `lessons`):
//! `cargo run --release -p intrados-photo --example train_marks -- RECIPE.ron LESSONS OUT.f32`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example for people")]

use std::path::PathBuf;

use intrados_photo::marks::{Network, lesson::Lesson, train::Recipe};
use intrados_stage::{Job, cpu_seconds};

fn main() {
    let mut args = std::env::args().skip(1).map(PathBuf::from);
    let [recipe, lessons, out] = std::array::from_fn(|_| args.next().expect("three paths"));
    let recipe: Recipe = ron::from_str(&std::fs::read_to_string(recipe).unwrap()).unwrap();
    let lesson = |n: usize| {
        let bytes = std::fs::read(lessons.join(format!("{n:05}.lesson"))).unwrap();
        Lesson::from_bytes(&bytes).expect("a whole lesson")
    };
    let (mut sum, begin) = (0.0, cpu_seconds());
    let tell = |step: usize, loss: f32, network: &Network| {
        sum += loss;
        if (step + 1).is_multiple_of(50) {
            println!("{}: {:.4}, {:.0} CPU-s", step + 1, sum / 50.0, cpu_seconds() - begin);
            sum = 0.0;
        }
        if (step + 1).is_multiple_of(500) {
            let beside = out.with_extension(format!("{}.f32", step + 1));
            std::fs::write(beside, network.to_bytes()).unwrap();
        }
    };
    let network = Network::trained(&recipe, lesson, &Job::default(), tell).unwrap();
    std::fs::write(&out, network.to_bytes()).unwrap();
}
