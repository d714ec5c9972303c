//! Bodies with known line integrals, for tests.

use crate::volume::{Beam, Grid, Orbit, Sinogram, Volume};

/// An ellipse-shaped cylinder: middle, half axes, attenuation.
pub(crate) struct Body {
    pub(crate) at: [f64; 3],
    pub(crate) half: [f64; 3],
    pub(crate) mu: f64,
}

/// A mortar core with holes and a grain, in metres; ellipsoids, so that line integrals are known.
pub(crate) fn core() -> Vec<Body> {
    vec![
        Body { at: [0.0; 3], half: [0.04, 0.036, 0.03], mu: 30.0 },
        Body { at: [0.012, 0.008, 0.002], half: [0.006, 0.009, 0.007], mu: -30.0 },
        Body { at: [-0.015, -0.005, -0.004], half: [0.010, 0.004, 0.008], mu: 15.0 },
        Body { at: [-0.002, 0.022, 0.003], half: [0.004, 0.004, 0.01], mu: -20.0 },
    ]
}

/// Length of the line from `from` along the unit vector `to` within an ellipsoid; `flat` leaves z
/// out of its shape.
fn chord(body: &Body, from: [f64; 3], to: [f64; 3], flat: bool) -> f64 {
    let dims = if flat { 2 } else { 3 };
    let [mut a, mut b, mut c] = [0.0, 0.0, -1.0];
    for k in 0..dims {
        let (p, d) = ((from[k] - body.at[k]) / body.half[k], to[k] / body.half[k]);
        a += d * d;
        b += p * d;
        c += p * p;
    }
    2.0 * (b * b - a * c).max(0.0).sqrt() / a
}

/// Exact line integrals, each a mean over 3 × 3 places on the pixel (3 along u alone if `flat`).
pub(crate) fn scan(orbit: &Orbit, bodies: &[Body], flat: bool) -> Sinogram {
    let mut sinogram = Sinogram::zeros(orbit.clone());
    for (i, out) in sinogram.data.iter_mut().enumerate() {
        let (bin, row, view) =
            (i % orbit.bins(), i / orbit.bins() % orbit.rows(), i / orbit.bins() / orbit.rows());
        let (sin, cos) = orbit.angles[view].sin_cos();
        let mut sum = 0.0;
        for k in 0..9 {
            let u =
                (bin as f64 + (k % 3) as f64 / 3.0 - 1.0 / 3.0 - orbit.centre[0]) * orbit.pixel[0];
            let v = (row as f64 + if flat { 0.0 } else { (k / 3) as f64 / 3.0 - 1.0 / 3.0 }
                - orbit.centre[1])
                * orbit.pixel[1];
            let (from, to) = match orbit.beam {
                Beam::Parallel => ([u * cos, u * sin, v], [-sin, cos, 0.0]),
                Beam::Fan { source_axis: s, axis_detector: d, curved } => {
                    let (across, along) = if curved { (u / (s + d)).sin_cos() } else { (u, s + d) };
                    (
                        [s * sin, -s * cos, v],
                        [across * cos - along * sin, across * sin + along * cos, 0.0],
                    )
                }
                Beam::Cone { source_axis: s, axis_detector: d } => (
                    [s * sin, -s * cos, 0.0],
                    [u * cos - (s + d) * sin, u * sin + (s + d) * cos, v],
                ),
            };
            let length = to.iter().map(|t| t * t).sum::<f64>().sqrt();
            let to = to.map(|t| t / length);
            sum += bodies.iter().map(|b| b.mu * chord(b, from, to, flat)).sum::<f64>();
        }
        *out = (sum / 9.0) as f32;
    }
    sinogram
}

/// The bodies on a grid, each voxel a mean over 4³ places (4² if `flat`).
pub(crate) fn truth(grid: &Grid, bodies: &[Body], flat: bool) -> Volume {
    let mut volume = Volume::zeros(*grid);
    for (i, out) in volume.data.iter_mut().enumerate() {
        let ijk = [i % grid.size[0], i / grid.size[0] % grid.size[1], i / grid.slice_len()];
        let dims = if flat { 2 } else { 3 };
        let n = 4_usize.pow(dims as u32);
        let mut sum = 0.0;
        for s in 0..n {
            let at: [f64; 3] = std::array::from_fn(|k| {
                grid.at(k, ijk[k]) + ((s >> (2 * k) & 3) as f64 / 4.0 - 0.375) * grid.voxel[k]
            });
            let inside = |b: &&Body| {
                (0..dims).map(|k| ((at[k] - b.at[k]) / b.half[k]).powi(2)).sum::<f64>() < 1.0
            };
            sum += bodies.iter().filter(inside).map(|b| b.mu).sum::<f64>();
        }
        *out = (sum / n as f64) as f32;
    }
    volume
}
