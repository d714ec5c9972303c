use intrados_stage::Job;
use intrados_xray::{recon::*, volume::*};
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = s.rsplit(')').next().unwrap().split_whitespace().collect();
    (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
}
fn raw(p: &str) -> Vec<f32> {
    std::fs::read(p).unwrap().chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}
fn main() {
    for (n, na) in [(512usize, 720usize), (1024, 1440)] {
        let orbit = Orbit::circle(Beam::Parallel, na, std::f64::consts::PI, [1, n], [1.0; 2]);
        let sino = Sinogram { orbit, data: raw(&format!("/tmp/recon/sino_{n}.raw")) };
        let truth = raw(&format!("/tmp/recon/phantom_{n}.raw"));
        let grid = Grid::centred([n, n, 1], [1.0; 3]);
        for w in [Window::Ramp, Window::SheppLogan, Window::Ramp] {
            let (c, t) = (cpu(), std::time::Instant::now());
            let v = fbp(&sino, &grid, w, &Job::default()).unwrap();
            let (c, t) = (cpu() - c, t.elapsed().as_secs_f64());
            let flip: Vec<f32> = (0..n).rev().flat_map(|y| v.data[y * n..(y + 1) * n].to_vec()).collect();
            println!(
                "{n} {w:?} cpu {c:.2} wall {t:.3} nrmse {:.4} flipped {:.4}",
                nrmse(&v.data, &truth, &grid, 0.88),
                nrmse(&flip, &truth, &grid, 0.88)
            );
        }
    }
}
