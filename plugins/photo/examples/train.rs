//! Trains the network that reads damage on the lessons of a folder (see the example `lessons`):
//! `cargo run --release -p intrados-photo --example train -- RECIPE.ron LESSONS OUT.f32`; with
//! `WEIGHTS.f32 STAGES` after it, it goes on after so many stages.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example for people")]

use std::path::PathBuf;

use intrados_photo::marks::{Reader, lesson::Lesson, train::Recipe};
use intrados_stage::{Job, cpu_seconds};

fn main() {
    let mut args = std::env::args().skip(1).map(PathBuf::from);
    let [recipe, lessons, out] = std::array::from_fn(|_| args.next().expect("three paths"));
    let recipe: Recipe = ron::from_str(&std::fs::read_to_string(recipe).unwrap()).unwrap();
    let lesson = |n: usize| {
        let path = lessons.join(format!("{n:05}.lesson"));
        // It may still be rendered.
        while !path.exists() {
            std::thread::sleep(std::time::Duration::from_secs(1));
        }
        Lesson::from_bytes(&std::fs::read(path).unwrap()).expect("a whole lesson")
    };
    let done = args.next().map(|weights| {
        let stages = args.next().and_then(|n| n.to_str()?.parse().ok()).expect("so many stages");
        let bytes = std::fs::read(weights).unwrap();
        (stages, Reader::from_bytes(&recipe.levels, &bytes).expect("weights of these levels"))
    });
    let (mut sum, begin) = (0.0, cpu_seconds());
    let tell = |step: usize, loss: f32, reader: &Reader, over: bool| {
        sum += loss;
        if (step + 1) % 50 == 0 {
            println!("{}: {:.4}, {:.0} CPU-s", step + 1, sum / 50.0, cpu_seconds() - begin);
            sum = 0.0;
        }
        if over || (step + 1) % 500 == 0 {
            let beside = out.with_extension(format!("{}.f32", step + 1));
            std::fs::write(beside, reader.to_bytes()).unwrap();
        }
    };
    let reader = Reader::trained(&recipe, done, lesson, &Job::default(), tell).unwrap();
    std::fs::write(&out, reader.to_bytes()).unwrap();
}
