use std::sync::Arc;
use intrados_light::*;
use intrados_scene::Scene;
use intrados_stage::*;
use intrados_transport::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let job = Job::new("x");
    let scene = Scene::load_bundled(&args[1], &job).unwrap();
    let seed: u64 = args.get(2).map_or(1, |s| s.parse().unwrap());
    let rounds: u32 = args.get(3).map_or(5, |s| s.parse().unwrap());
    let lit = LitScene::build(Arc::new(scene), &job).unwrap();
    let sensors = [Sensor::Camera(lit.scene.cameras[0].clone())];
    let guide = learn(&lit, &sensors, Rule::default(), seed, Schedule { first: 32768, rounds }, &job).unwrap();
    let show = |r: &Round| {
        let s = &r.scores;
        let rv = s.walks() as f64 * (s.std_error() / s.mean()).powi(2);
        println!("{:?} n {} I {:.5e} ±{:.2}% relVar {:.3} ev/walk {:.2} us/walk {:.2} build {:.2} cells {} FOM {:.3e} tail {:.2} max {:.1e}", r.side, s.walks(), s.mean(), 100.0*s.std_error()/s.mean(), rv, r.events as f64 / s.walks() as f64, 1e6*r.cpu_seconds[0]/s.walks() as f64, r.cpu_seconds[1], r.cells, s.walks() as f64/ (rv * r.cpu_seconds[0]), s.tail_index(), s.converged().largest_share*s.walks() as f64);
    };
    guide.rounds.iter().for_each(show);
    println!("train {:.2} CPU-s, {} bytes", guide.cpu_seconds, guide.bytes());
    println!("{:?}", guide.sizes());
    for c in guide.explain(&lit).iter().take(14) { println!("   {:?} {:24} relVar {:8.3} mean {:.3} largest {:8.1} steps {:.3}", c.side, c.surface, c.rel_var, c.mean, c.largest, c.steps); }
    for side in Side::BOTH { let r = guide.walk(&lit, &sensors, Rule::default(), side, seed, 1 << 20); show(&r); }
}
