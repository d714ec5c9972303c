use glam::{Mat4, Vec3};
use intrados_light::*;
use intrados_scene::*;
use intrados_stage::Job;
use intrados_transport::*;
use std::sync::Arc;
fn quad(s: &mut Scene, c: [f32; 3], u: [f32; 3], v: [f32; 3], albedo: Vec3, emission: Vec3) {
    let (c, u, v) = (Vec3::from(c), Vec3::from(u), Vec3::from(v));
    s.meshes.push(Arc::new(Mesh {
        positions: vec![c, c + u, c + u + v, c + v],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    }));
    let m = Material {
        base_colour: albedo,
        emission,
        surface: if emission == Vec3::ZERO { Surface::Lambert } else { Surface::Black },
        ..Default::default()
    };
    s.materials.push(m);
    s.objects.push(Object {
        name: "q".into(),
        mesh: s.meshes.len() - 1,
        transform: Mat4::IDENTITY,
        material: s.materials.len() - 1,
        member: None,
        part: Part::Scenery,
    });
}
fn main() {
    let mut s = Scene::default();
    let a = Vec3::splat(0.7);
    let (x0, y0, z0, x1, y1, z1) = (-1.0, 0.0, -1.0, 1.0, 2.0, 1.0);
    let (x, y, z) = (x1 - x0, y1 - y0, z1 - z0);
    let o = Vec3::ZERO;
    quad(&mut s, [x0, y0, z0], [0., 0., z], [x, 0., 0.], a, o);
    quad(&mut s, [x0, y1, z0], [x, 0., 0.], [0., 0., z], a, o);
    quad(&mut s, [x0, y0, z0], [0., y, 0.], [0., 0., z], a, o);
    quad(&mut s, [x1, y0, z0], [0., 0., z], [0., y, 0.], a, o);
    quad(&mut s, [x0, y0, z0], [x, 0., 0.], [0., y, 0.], a, o);
    quad(&mut s, [x0, y0, z1], [0., y, 0.], [x, 0., 0.], a, o);
    quad(&mut s, [-0.25, 1.99, -0.25], [0.5, 0., 0.], [0., 0., 0.5], o, Vec3::splat(10.));
    let n: u32 = std::env::args().nth(1).map_or(32, |x| x.parse().unwrap());
    let depth: u32 = std::env::args().nth(2).map_or(u32::MAX, |x| x.parse().unwrap());
    let cam = Camera {
        name: "c".into(),
        position: Vec3::new(0.8, 1.2, -0.8),
        target: Vec3::new(-0.9, 0.6, 0.6),
        up: Vec3::Y,
        fov_deg: 60.,
        width: n,
        height: n,
        exposure: 0.,
    };
    let lit = Arc::new(LitScene::build(Arc::new(s), &Job::new("x")).unwrap());
    let meter = Meter { name: "floor".into(), corner: Vec3::new(-0.2, 0.0, -0.2), u: Vec3::new(0., 0., 0.4), v: Vec3::new(0.4, 0., 0.) };
    let rule = Rule { max_order: depth, roulette: if depth < 100 { Roulette::Weight } else { Roulette::Event }, ..Rule::default() };
    let est = match std::env::args().nth(3).as_deref() {
        Some("c") => Estimator::Collision,
        Some("l") => Estimator::LastEvent,
        Some("a") => Estimator::Analog,
        _ => Estimator::NextEvent,
    };
    let rule = Rule { estimator: est, ..rule };
    let mut m = Measurement::new(lit, vec![Sensor::Camera(cam), Sensor::Meter(meter)], Sides::Both, rule, 1, Shard::default(), None);
    for _ in 0..8 {
        m.advance_all(32);
    }
    for r in m.readings() {
        println!("{} z {:?}", r.name, r.duality_z);
        for (n, s) in [("primal", r.primal.unwrap()), ("dual", r.dual.unwrap())] {
            println!(
                "  {n} {:.6} +- {:.6} relvar {:.3} cpu {:.2} Msamples/cpu-s {:.2} fom {:.2e} conv {} {}",
                s.mean,
                s.std_error,
                s.rel_var_per_walk,
                s.cpu_seconds,
                s.walks as f64 / s.cpu_seconds / 1e6,
                s.figure_of_merit,
                s.converged,
                s.complaint
            );
        }
        println!("  comb {:.6} +- {:.6}", r.combined.mean, r.combined.std_error);
    }
}
