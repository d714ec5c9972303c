//! What lenses, sensors and files do to a rendered picture before the network sees it.

use std::f32::consts::PI;

use glam::Vec3;
use intrados_light::luminance;
use intrados_raster::Grid;
use intrados_stage::{
    Job,
    random::{Draw, Key},
};

/// A picture as some camera would have kept it; its values are roots of light, as in files.
pub(super) fn taken(light: &Grid<Vec3>, key: Key) -> Grid<Vec3> {
    let mut draw = Draw::new(key);
    let mut roots = light.map(|l| l.max(Vec3::ZERO).map(f32::sqrt));
    expose(&mut roots, &mut draw);
    colour(&mut roots, &mut draw);
    // Most are sharp, some a little soft; some were enlarged by whoever kept them.
    match draw.count(0, 9) {
        0..=3 => {}
        4..=7 => roots = blurred(&roots, draw.between(0.35, 1.3)),
        _ => roots = blurred(&roots, draw.log_between(1.3, 4.0)),
    }
    if draw.chance(0.5) {
        haze(&mut roots, draw.log_between(0.05, 1.5) as f32);
    }
    if draw.chance(0.6) {
        let strength = draw.log_between(0.01, 0.25) as f32;
        texture(&mut roots, key.split(1, 0), draw.log_between(0.5, 4.0), strength);
    }
    if draw.chance(0.5) {
        let rarity = draw.between(1.2, 3.0) as f32;
        specks(
            &mut roots,
            key.split(4, 0),
            draw.log_between(0.7, 3.0),
            [rarity, draw.unit() as f32],
        );
    }
    if draw.chance(0.25) {
        let soft = blurred(&roots, draw.between(0.7, 1.5));
        let more = draw.between(0.3, 1.2) as f32;
        let sharper = roots.data.iter_mut().zip(&soft.data);
        sharper.for_each(|(r, s)| *r = (*r + more * (*r - *s)).max(Vec3::ZERO));
    }
    let grain = draw.log_between(0.002, 0.03) as f32;
    let size = if draw.chance(0.5) { draw.between(0.4, 0.9) } else { 0.0 };
    noise(&mut roots, key.split(2, 0), size, grain);
    if draw.chance(0.4) {
        compress(&mut roots, draw.log_between(0.006, 0.05) as f32);
    }
    roots
}

/// Contrast, the fall of light toward one side and toward the corners, and what burns out.
fn expose(roots: &mut Grid<Vec3>, draw: &mut Draw) {
    let power = if draw.chance(0.6) { draw.log_between(0.6, 1.5) as f32 } else { 1.0 };
    let fall = if draw.chance(0.5) { draw.between(0.0, 0.5) as f32 } else { 0.0 };
    let (sin, cos) = (2.0 * PI * draw.unit() as f32).sin_cos();
    let corners = if draw.chance(0.3) { draw.between(0.0, 0.35) as f32 } else { 0.0 };
    let brightest = draw.between(1.05, 2.5) as f32;
    let (w, h) = (roots.width, roots.height);
    for (i, root) in roots.data.iter_mut().enumerate() {
        let x = (i % w) as f32 / w as f32 * 2.0 - 1.0;
        let y = (i / w) as f32 / h as f32 * 2.0 - 1.0;
        let factor = 1.0 + 0.5 * fall * (cos * x + sin * y) - 0.5 * corners * (x * x + y * y);
        *root = (root.map(|r| r.powf(power)) * factor).min(Vec3::splat(brightest));
    }
}

/// Stray light, dust in cracks: contrast falls while its scatter, which comes later, does not.
fn haze(roots: &mut Grid<Vec3>, share: f32) {
    let mean = roots.data.iter().sum::<Vec3>() / roots.data.len() as f32;
    roots.data.iter_mut().for_each(|root| *root = (*root + share * mean) / (1.0 + share));
}

/// The light's colour, and that some cameras see none.
fn colour(roots: &mut Grid<Vec3>, draw: &mut Draw) {
    let tint = Vec3::from(std::array::from_fn(|_| draw.log_between(0.88, 1.14) as f32));
    let kept = if draw.chance(0.3) { 0.0 } else { draw.between(0.4, 1.3) as f32 };
    for root in &mut roots.data {
        let grey = Vec3::splat(luminance(*root));
        *root = ((grey + kept * (*root - grey)) * tint).max(Vec3::ZERO);
    }
}

fn blurred(roots: &Grid<Vec3>, sigma: f64) -> Grid<Vec3> {
    let job = Job::default();
    let [r, g, b] = [Vec3::X, Vec3::Y, Vec3::Z]
        .map(|channel| roots.map(|root| root.dot(channel)).blurred(sigma, &job));
    let data = r.data.iter().zip(&g.data).zip(&b.data);
    Grid {
        width: roots.width,
        height: roots.height,
        data: data.map(|((&r, &g), &b)| Vec3::new(r, g, b)).collect(),
    }
}

/// White noise of unit variance whose grains are about `sigma` pixels.
fn grains(width: usize, height: usize, key: Key, sigma: f64) -> Grid<f32> {
    let data = (0..width * height).map(|i| key.normal(2 * i as u32) as f32).collect();
    let white = Grid { width, height, data };
    if sigma < 0.3 {
        return white;
    }
    let soft = white.blurred(sigma, &Job::default());
    let square = soft.data.iter().map(|v| v * v).sum::<f32>() / soft.data.len() as f32;
    soft.map(|v| v / square.sqrt().max(1e-6))
}

/// Sand and dirt finer than what was rendered: a factor.
fn texture(roots: &mut Grid<Vec3>, key: Key, size: f64, strength: f32) {
    let grains = grains(roots.width, roots.height, key, size);
    let values = roots.data.iter_mut().zip(&grains.data);
    values.for_each(|(root, g)| *root *= (1.0 + strength * g).max(0.1));
}

/// Dark spots and pits: where soft noise exceeds so many of its deviations.
fn specks(roots: &mut Grid<Vec3>, key: Key, size: f64, [rarity, strength]: [f32; 2]) {
    let grains = grains(roots.width, roots.height, key, size);
    let values = roots.data.iter_mut().zip(&grains.data);
    values.for_each(|(root, g)| {
        *root *= 1.0 - 0.7 * strength * ((g - rarity) / 0.5).clamp(0.0, 1.0);
    });
}

/// The sensor's noise, half of it alike in all colours.
fn noise(roots: &mut Grid<Vec3>, key: Key, size: f64, strength: f32) {
    let [all, r, g, b] =
        [0, 1, 2, 3].map(|n| grains(roots.width, roots.height, key.split(3, n), size));
    for (i, root) in roots.data.iter_mut().enumerate() {
        let own = Vec3::new(r.data[i], g.data[i], b.data[i]);
        *root = (*root + strength * (0.8 * all.data[i] + 0.6 * own)).max(Vec3::ZERO);
    }
}

/// Side of a block of a compressed file.
const BLOCK: usize = 8;

/// As files of lossy compression do: waves of 8 × 8 blocks of grey in steps, coarser where finer.
fn compress(roots: &mut Grid<Vec3>, step: f32) {
    let wave: [[f32; BLOCK]; BLOCK] = std::array::from_fn(|k| {
        let size = if k == 0 { (1.0 / BLOCK as f32).sqrt() } else { (2.0 / BLOCK as f32).sqrt() };
        std::array::from_fn(|x| size * (PI * (x as f32 + 0.5) * k as f32 / BLOCK as f32).cos())
    });
    let turned: [[f32; BLOCK]; BLOCK] =
        std::array::from_fn(|x| std::array::from_fn(|k| wave[k][x]));
    for y in (0..roots.height / BLOCK).map(|y| y * BLOCK) {
        for x in (0..roots.width / BLOCK).map(|x| x * BLOCK) {
            let at = |i: usize, j: usize| (y + j) * roots.width + x + i;
            let block: [[f32; BLOCK]; BLOCK] =
                std::array::from_fn(|j| std::array::from_fn(|i| luminance(roots.data[at(i, j)])));
            let mut waves = product(&product(&wave, &block), &turned);
            for (j, row) in waves.iter_mut().enumerate() {
                for (i, v) in row.iter_mut().enumerate() {
                    let step = step * (1.0 + 0.7 * (i + j) as f32);
                    *v = (*v / step).round() * step;
                }
            }
            let kept = product(&product(&turned, &waves), &wave);
            for (j, i) in (0..BLOCK).flat_map(|j| (0..BLOCK).map(move |i| (j, i))) {
                let root = &mut roots.data[at(i, j)];
                *root = (*root + Vec3::splat(kept[j][i] - block[j][i])).max(Vec3::ZERO);
            }
        }
    }
}

fn product(a: &[[f32; BLOCK]; BLOCK], b: &[[f32; BLOCK]; BLOCK]) -> [[f32; BLOCK]; BLOCK] {
    std::array::from_fn(|j| std::array::from_fn(|i| (0..BLOCK).map(|k| a[j][k] * b[k][i]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy() -> Grid<Vec3> {
        let data = (0..64 * 48).map(|i| Vec3::splat(0.5 + 0.2 * (i as f32 * 0.37).sin()));
        Grid { width: 64, height: 48, data: data.collect() }
    }

    /// Waves in tiny steps are the picture; in coarse ones they differ by less than the steps'
    /// sum.
    #[test]
    fn compressing_rounds_waves() {
        for (step, most) in [(1e-5, 1e-4), (0.02, 0.6)] {
            let (mut roots, before) = (wavy(), wavy());
            compress(&mut roots, step);
            let off = roots.data.iter().zip(&before.data).map(|(a, b)| (*a - *b).abs().x);
            let off = off.fold(0.0, f32::max);
            assert!(off < most && off > 1e-3 * most, "{step}: {off}");
        }
    }

    #[test]
    fn cameras_differ_and_repeat() {
        for seed in 0..30 {
            let (a, b) = (taken(&wavy(), Key::new(seed, 0)), taken(&wavy(), Key::new(seed, 0)));
            assert_eq!(a, b);
            assert!(a.data.iter().all(|r| r.is_finite() && r.min_element() >= 0.0));
            assert_ne!(a, taken(&wavy(), Key::new(seed, 1)));
        }
    }
}
