//! Reads the cracks of every picture of a folder into masks `X.png`; beside them how probable
//! cracks are, `X.chance.png`, and the picture with its marks, `X.marks.png`:
//! `cargo run --release -p intrados-photo --example marks -- FOLDER OUT [CRACKS.f32 [AREAS.f32]]`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example for people")]

use std::path::PathBuf;

use image::{GrayImage, Luma, Rgb, RgbImage};
use intrados_photo::{
    Photograph,
    marks::{Mark, Network, Reader},
    picture::srgb,
};
use intrados_raster::Grid;
use intrados_stage::{Job, cpu_seconds};

fn main() {
    let mut args = std::env::args().skip(1).map(PathBuf::from);
    let [folder, out] = std::array::from_fn(|_| args.next().expect("two folders"));
    let mut reader = Reader::builtin().expect("weights").clone();
    let network = |path: PathBuf| {
        Network::from_bytes(&[16, 32, 48, 64], &std::fs::read(path).unwrap()).expect("weights")
    };
    if let Some(path) = args.next() {
        reader.cracks = network(path);
    }
    if let Some(path) = args.next() {
        reader.areas = network(path);
    }
    std::fs::create_dir_all(&out).unwrap();
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|f| !f.to_string_lossy().contains(".mask."));
    files.sort();
    let (mut pixels, begin) = (0, cpu_seconds());
    for file in &files {
        let Ok(photograph) = Photograph::open(file) else { continue };
        let [width, height] = photograph.size.map(|s| s as usize);
        let light = (0..width * height)
            .map(|i| photograph.light((i % width) as u32, (i / width) as u32).unwrap_or_default());
        let light = Grid { width, height, data: light.collect() };
        let known = light.map(|_| true);
        let marks = reader.marks(&light, &known, &Job::default()).unwrap();
        pixels += width * height;
        let size = photograph.size;
        let at = |x: u32, y: u32| y as usize * width + x as usize;
        let cracks = marks.cracks();
        let others = Mark::ALL.map(|mark| marks.areas(mark));
        let mask = GrayImage::from_fn(size[0], size[1], |x, y| {
            Luma([if cracks.data[at(x, y)] { 255 } else { 0 }])
        });
        let chance = GrayImage::from_fn(size[0], size[1], |x, y| {
            Luma([(marks.of(Mark::Crack).data[at(x, y)] * 255.0).round() as u8])
        });
        let picture = RgbImage::from_fn(size[0], size[1], |x, y| {
            let seen = light.data[at(x, y)].to_array().map(srgb);
            let colours = [[255, 0, 0], [0, 255, 0], [0, 255, 255], [255, 140, 0], [90, 90, 255]];
            let found = (0..colours.len()).find(|&m| others[m].data[at(x, y)]);
            Rgb(found.map_or(seen, |m| match m {
                0 => colours[0],
                _ => std::array::from_fn(|k| seen[k] / 2 + colours[m][k] / 2),
            }))
        });
        let name = file.file_stem().unwrap().to_string_lossy();
        mask.save(out.join(format!("{name}.png"))).unwrap();
        chance.save(out.join(format!("{name}.chance.png"))).unwrap();
        picture.save(out.join(format!("{name}.marks.png"))).unwrap();
    }
    let spent = cpu_seconds() - begin;
    println!("{} pictures, {:.2} CPU-s a megapixel", files.len(), spent / pixels as f64 * 1e6);
}
