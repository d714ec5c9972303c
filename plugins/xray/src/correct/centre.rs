//! Where the axis of rotation falls on the detector. The result goes into
//! [`Orbit::centre`](crate::volume::Orbit), which every method here heeds: nothing is resampled.

use crate::{
    recon::ReconError,
    volume::{Beam, Orbit, Sinogram},
};

/// From a full turn of any beam, whole specimen or not: each ray is measured again from the other
/// side, and the axis is where both agree best. Looks within `reach` bins around the present
/// [`Orbit::centre`]. `row` should be that of the plane of the source.
///
/// # Errors
/// The orbit has no views.
pub fn axis_by_mirror(sinogram: &Sinogram, row: usize, reach: f64) -> Result<f64, ReconError> {
    let orbit = &sinogram.orbit;
    if orbit.is_empty() || row >= orbit.rows() {
        return Err(ReconError::Bad("there are no views that could tell the axis".to_owned()));
    }
    let lines = sinogram.row(row);
    let cost = |centre: f64| mismatch(orbit, &lines, centre);
    // A coarse look by half bins, then golden sections around the best.
    let steps = (2.0 * reach).ceil().clamp(1.0, 1e4) as i32;
    let coarse = (-steps..=steps).map(|i| orbit.centre[0] + 0.5 * f64::from(i));
    let best = coarse.min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(orbit.centre[0]);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (best - 0.5, best + 0.5);
    while high - low > 1e-3 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if cost(a) < cost(b) { high = b } else { low = a }
    }
    Ok(0.5 * (low + high))
}

/// Mean squared difference of rays and their mirrors, if the axis were at `centre`.
fn mismatch(orbit: &Orbit, lines: &[f32], centre: f64) -> f64 {
    let bins = orbit.bins();
    let views = orbit.views();
    let (start, turn) = (orbit.angles[0], std::f64::consts::TAU);
    let pitch = match orbit.beam {
        Beam::Parallel => 0.0,
        Beam::Fan { source_axis, axis_detector, .. }
        | Beam::Cone { source_axis, axis_detector } => {
            orbit.pixel[0] / (source_axis + axis_detector)
        }
    };
    let curved = matches!(orbit.beam, Beam::Fan { curved: true, .. });
    let at = |view: usize, place: f64| {
        let i = place.floor();
        (i >= 0.0 && i + 1.0 < bins as f64).then(|| {
            let k = view * bins + i as usize;
            f64::from(lines[k]) + (place - i) * f64::from(lines[k + 1] - lines[k])
        })
    };
    let (mut sum, mut n) = (0.0, 0_usize);
    for (view, &angle) in orbit.angles.iter().enumerate() {
        for bin in 0..bins {
            let offset = bin as f64 - centre;
            let gamma = if curved { offset * pitch } else { (offset * pitch).atan() };
            // Views are taken as evenly spaced over the turn.
            let other = (angle + std::f64::consts::PI - 2.0 * gamma - start).rem_euclid(turn)
                / turn
                * views as f64;
            let (first, share) = (other.floor(), other - other.floor());
            let [a, b] = [first as usize % views, (first as usize + 1) % views];
            if let (Some(p), Some(q)) = (at(a, centre - offset), at(b, centre - offset)) {
                sum += (f64::from(lines[view * bins + bin]) - (p + share * (q - p))).powi(2);
                n += 1;
            }
        }
    }
    sum / n.max(1) as f64
}
