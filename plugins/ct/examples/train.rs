//! Trains the network that detection uses, on simulated slices only:
//! `cargo run --release -p intrados-ct --example train [RECIPE.ron] [OUT.f32]`.

#![allow(clippy::print_stderr, reason = "a program for the command line")]

use std::{error::Error, time::Instant};

use intrados_ct::network::{Network, train::Recipe};
use intrados_stage::Job;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let recipe_path = args.next().unwrap_or_else(|| "assets/ct/recipe.ron".into());
    let out = args.next().unwrap_or_else(|| "assets/ct/unet.f32".into());
    let recipe: Recipe = ron::from_str(&std::fs::read_to_string(recipe_path)?)?;
    let (begin, mut mean) = (Instant::now(), 0.0);
    let network = Network::trained(&recipe, &Job::default(), |step, loss, network| {
        mean += loss / 50.0;
        if step % 50 == 49 {
            eprintln!(
                "step {} of {}: loss {mean:.4}, {:.0} s",
                step + 1,
                recipe.steps,
                begin.elapsed().as_secs_f64()
            );
            mean = 0.0;
        }
        if step % 250 == 249
            && let Err(error) = std::fs::write(&out, network.to_bytes())
        {
            eprintln!("{out}: {error}");
        }
    })?;
    std::fs::write(&out, network.to_bytes())?;
    Ok(())
}
