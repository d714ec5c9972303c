//! Cracks that dust, sand and lime have filled, and whose lips are worn: as dark as rendered they
//! are only where they are fresh and clean.

use glam::{IVec2, Vec2, Vec3};
use intrados_raster::Grid;
use intrados_stage::{Job, random::Draw};

/// The picture with its cracks taken out, by the texture of places beside them, and put back softer
/// and fainter. `open` is the share of each pixel that is crack.
pub(super) fn softened(light: &Grid<Vec3>, open: &Grid<f32>, draw: &mut Draw) -> Grid<Vec3> {
    let job = Job::default();
    let (width, height) = (light.width as i32, light.height as i32);
    let turn = draw.between(0.0, std::f64::consts::TAU) as f32;
    let aside = (Vec2::from_angle(turn) * draw.between(9.0, 26.0) as f32).round().as_ivec2();
    let softness = draw.log_between(0.4, 4.0);
    let left = draw.log_between(0.2, 1.3) as f32;
    // What fills cracks is as often brown as grey.
    let tint = Vec3::new(1.0, 1.0, 1.0) - Vec3::new(0.3, 0.1, 0.0) * draw.between(-0.5, 1.0) as f32;
    let near = open.blurred(1.0, &job).map(|o| (2.5 * o).min(1.0));
    let place = |at: IVec2| {
        let inside = at.x >= 0 && at.y >= 0 && at.x < width && at.y < height;
        inside.then(|| (at.y * width + at.x) as usize)
    };
    let beside = |i: usize| {
        let at = IVec2::new(i as i32 % width, i as i32 / width);
        let whole = |j: &usize| near.data[*j] < 0.05;
        [1, -1, 2, -2].iter().find_map(|k| place(at + k * aside).filter(whole))
    };
    let mut filled = light.clone();
    let mut dark = open.map(|_| 0.0_f32);
    for i in (0..light.data.len()).filter(|&i| near.data[i] > 0.02) {
        let Some(j) = beside(i) else { continue };
        let (own, other) = (light.data[i], light.data[j]);
        let share = own.element_sum() / other.element_sum().max(1e-6);
        dark.data[i] = near.data[i] * (1.0 - share).clamp(0.0, 1.0);
        filled.data[i] = own.lerp(other, near.data[i]);
    }
    let dark = dark.blurred(softness, &job);
    for (light, dark) in filled.data.iter_mut().zip(&dark.data) {
        *light *= (Vec3::ONE - tint * (left * dark)).max(Vec3::splat(0.04));
    }
    filled
}

#[cfg(test)]
mod tests {
    use intrados_stage::random::Key;

    use super::*;

    /// A black line on grey stays where it is, is never darker than it was, and is fainter mostly;
    /// what is no crack keeps its light.
    #[test]
    fn cracks_stay_and_fade() {
        let line = |i: usize| (30..33).contains(&(i % 64));
        let open = Grid {
            width: 64,
            height: 64,
            data: (0..64 * 64).map(|i| f32::from(u8::from(line(i)))).collect(),
        };
        let light = open.map(|o| Vec3::splat(0.5 - 0.45 * o));
        let mut fainter = 0;
        for seed in 0..40 {
            let soft = softened(&light, &open, &mut Draw::new(Key::new(seed, 0)));
            let [on, off] = [32 * 64 + 31, 32 * 64 + 5].map(|i| soft.data[i].element_sum() / 3.0);
            assert!(on < off && on > 0.0, "seed {seed}: {on} {off}");
            assert!((off - 0.5).abs() < 0.01, "seed {seed}: {off}");
            fainter += usize::from(on > 0.2);
        }
        assert!((10..40).contains(&fainter), "{fainter}");
    }
}
