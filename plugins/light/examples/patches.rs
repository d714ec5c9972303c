//! Contact sheet of made-up patches, radiance above and labels below, and what they cost:
//! `cargo run --release -p intrados-light --example patches -- OUT.png [FIRST] [SAMPLES] [SIZE]`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example for people")]

use glam::Vec3;
use intrados_light::{
    Patch,
    patch::ORDERS,
    tone::{Curve, Tone},
};
use intrados_stage::{Job, cpu_seconds, random::Key};

const COLUMNS: usize = 6;
const ROWS: usize = 3;

fn main() {
    let mut args = std::env::args().skip(1);
    let out = args.next().expect("a path for the picture");
    let mut number = |or: u64| args.next().map_or(or, |a| a.parse().unwrap());
    let (first, samples, size) = (number(0), number(16), number(256) as usize);
    let (width, height) = (COLUMNS * size, 2 * ROWS * size);
    let mut sheet = vec![0_u8; 3 * width * height];
    let tone = Tone { exposure: -0.4, curve: Curve::Identity };
    let begin = cpu_seconds();
    for n in 0..COLUMNS * ROWS {
        let key = Key::new(first + n as u64, 0);
        let before = cpu_seconds();
        let patch = Patch::render(key, size as u32, samples, ORDERS, &Job::default()).unwrap();
        let widths: Vec<f32> = patch
            .courses
            .iter()
            .map(|c| c.iter().map(|p| p.width).fold(0.0, f32::max) * 1e3)
            .collect();
        println!(
            "{}: {:.2} CPU-s, {:.2} mm a pixel, cracks {widths:.2?} mm",
            first + n as u64,
            cpu_seconds() - before,
            1e3 * patch.pixel
        );
        let (left, top) = (n % COLUMNS * size, n / COLUMNS * 2 * size);
        for i in 0..size * size {
            let (x, y) = (left + i % size, top + i / size);
            let label = &patch.labels[i];
            let told = Vec3::new(
                label.crack.max(label.rust),
                label.spall.max(0.6 * label.rust),
                label.efflorescence,
            );
            for (y, pixel) in [
                (y, tone.encode(patch.radiance[i])),
                (y + size, (told * 255.0).to_array().map(|v| v as u8)),
            ] {
                let at = 3 * (y * width + x);
                sheet[at..at + 3].copy_from_slice(&pixel);
            }
        }
    }
    println!("{:.2} CPU-s a patch", (cpu_seconds() - begin) / (COLUMNS * ROWS) as f64);
    let file = std::fs::File::create(out).unwrap();
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&sheet).unwrap();
}
