//! A column of the bundled scene from .3, 1, 3 and 10 m, below with its planted damage:
//! `cargo run --release -p intrados-light --example faces -- OUT.png [SAMPLES] [KIND] [MEMBER]`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example for people")]

use std::sync::Arc;

use intrados_light::{
    LitScene, Render, RenderSettings, Sides, View,
    tone::{Curve, Tone},
};
use intrados_scene::{Camera, Finish, FinishKind, Scene};
use intrados_stage::{Job, cpu_seconds, random::Key};

const SIZE: u32 = 360;

fn main() {
    let mut args = std::env::args().skip(1);
    let out = args.next().expect("a path for the picture");
    let samples: u64 = args.next().map_or(64, |a| a.parse().unwrap());
    let kind = args.next().map_or(0, |a| a.parse().unwrap());
    let wanted = args.next().unwrap_or_else(|| "C4".into());
    let mut scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let planted = scene.planted();
    let member = scene.members.iter().position(|m| m.id == wanted).unwrap();
    let finish = Finish::new(FinishKind::ALL[kind], Key::new(7, 0), 0.6);
    for object in scene.objects.iter().filter(|o| o.member.is_some()) {
        scene.materials[object.material].finish = Some(Arc::new(finish.clone()));
    }
    let damage = planted.iter().find(|d| d.member == wanted);
    let (target, outward) = damage
        .and_then(|d| {
            let crack = d.cracks.first().map(|c| c.mouth[c.mouth.len() / 2]);
            let spall = d.spalls.first().map(|s| (s.centre, s.outward));
            spall.or(crack.map(|m| (m.at, m.outward)))
        })
        .unwrap_or((scene.members[member].frame.point(0.5), glam::Vec3::Z));
    let mut sheet = vec![0_u8; (3 * 4 * SIZE * 2 * SIZE) as usize];
    for (column, distance) in [0.3, 1.0, 3.0, 10.0].into_iter().enumerate() {
        let aside = outward.any_orthonormal_vector();
        let camera = Camera {
            name: "eye".into(),
            position: target + distance * (outward + 0.25 * aside).normalize(),
            target,
            up: glam::Vec3::Y,
            fov_deg: 40.0,
            width: SIZE,
            height: SIZE,
            lens: None,
            exposure: 0.0,
        };
        for (row, scene) in [scene.clone(), scene.marked(&planted, 1.0)].into_iter().enumerate() {
            let begin = cpu_seconds();
            let scene = Scene { cameras: vec![camera.clone()], ..scene };
            let lit = Arc::new(LitScene::build(Arc::new(scene), &Job::default()).unwrap());
            let settings = RenderSettings {
                sides: Sides::Primal,
                samples: Some(samples),
                orders: false,
                ..RenderSettings::default()
            };
            let mut render = Render::new(lit, &camera, &settings);
            while render.advance(16) {}
            let picture = render.image(View::Primal, None).mean;
            let mut bright: Vec<f32> = picture.iter().map(|c| c.element_sum() / 3.0).collect();
            bright.sort_by(f32::total_cmp);
            let exposure = -(bright[bright.len() * 9 / 10] / 0.75).log2();
            let tone = Tone { exposure, curve: Curve::Identity };
            for (i, &c) in picture.iter().enumerate() {
                let (x, y) = (
                    column * SIZE as usize + i % SIZE as usize,
                    row * SIZE as usize + i / SIZE as usize,
                );
                let at = 3 * (y * 4 * SIZE as usize + x);
                sheet[at..at + 3].copy_from_slice(&tone.encode(c));
            }
            println!("{distance} m, damage {row}: {:.1} CPU-s", cpu_seconds() - begin);
        }
    }
    let file = std::fs::File::create(out).unwrap();
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), 4 * SIZE, 2 * SIZE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&sheet).unwrap();
}
