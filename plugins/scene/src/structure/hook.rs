//! Hooks at the ends of bars, as they lie: a bend of 90° and a straight piece behind it (EN
//! 1992-1-1, 8.3 and 8.4.1). How they hold, [`BarEnd`] says.

use std::f32::consts::FRAC_PI_2;

use glam::Vec3;

use super::BarEnd;

/// Chords of a bend.
const CHORDS: usize = 4;
/// Bars up to so thick (m) are bent about a mandrel of so many diameters, thicker ones about one of
/// so many (table 8.1N).
const THIN: f32 = 0.016;
const MANDRELS: [f32; 2] = [4.0, 7.0];
/// The straight piece behind a bend, diameters.
const BEHIND: f32 = 5.0;

/// A line with its hooked ends bent `inward`, as far as that is long, m.
pub(crate) fn bent(line: &[Vec3], ends: [BarEnd; 2], inward: Vec3, diameter: f32) -> Vec<Vec3> {
    let mut points = line.to_vec();
    for end in [ends[1], ends[0]] {
        if end == BarEnd::Hooked {
            hook(&mut points, inward, diameter);
        }
        points.reverse();
    }
    points
}

/// Bends the last end. It reaches no farther along the bar than before, so that its cover is the
/// same; where there is no room, it stays straight.
fn hook(points: &mut Vec<Vec3>, inward: Vec3, diameter: f32) {
    let [.., before, end] = points[..] else { return };
    let along = (end - before).normalize_or_zero();
    let inward = inward - inward.dot(along) * along;
    let (room, across) = (inward.length(), inward.normalize_or_zero());
    let mandrel = MANDRELS[usize::from(diameter > THIN + 1e-4)];
    let radius = (0.5 * (mandrel + 1.0) * diameter).min(room);
    let deep = (radius + BEHIND * diameter).min(room);
    if room < diameter || before.distance(end) <= radius + 0.5 * diameter {
        return;
    }
    let corner = end - 0.5 * diameter * along;
    let centre = corner - radius * along + radius * across;
    points.pop();
    points.extend((0..=CHORDS).map(|k| {
        let (sin, cos) = (FRAC_PI_2 * k as f32 / CHORDS as f32).sin_cos();
        centre + radius * (sin * along - cos * across)
    }));
    if deep > radius {
        points.push(corner + deep * across);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: [Vec3; 2] = [Vec3::ZERO, Vec3::new(0.0, 0.0, 3.0)];

    /// 4 φ and 7 φ across, 5 φ behind, and as far along as the straight bar.
    #[test]
    fn a_hook_is_bent_about_its_mandrel_and_goes_on_behind() {
        for (diameter, radius) in [(0.016, 2.5 * 0.016), (0.02, 4.0 * 0.02)] {
            let found = bent(&LINE, [BarEnd::Straight, BarEnd::Hooked], Vec3::X, diameter);
            let [first, bend @ .., end] = &found[..] else { panic!("{found:?}") };
            assert_eq!(*first, LINE[0]);
            let centre = Vec3::new(radius, 0.0, 3.0 - 0.5 * diameter - radius);
            assert!(bend.iter().all(|p| (p.distance(centre) - radius).abs() < 1e-6), "{found:?}");
            let behind = *end - bend[bend.len() - 1];
            assert!((behind - 5.0 * diameter * Vec3::X).length() < 1e-6, "{found:?}");
            let top = found.iter().map(|p| p.z).fold(0.0, f32::max);
            assert!((top + 0.5 * diameter - 3.0).abs() < 1e-6, "{found:?}");
        }
    }

    #[test]
    fn both_ends_are_bent_alike_and_straight_ones_not_at_all() {
        let ends = [BarEnd::Hooked; 2];
        let found = bent(&LINE, ends, Vec3::X, 0.012);
        let turned: Vec<Vec3> =
            found.iter().rev().map(|p| Vec3::new(p.x, p.y, 3.0 - p.z)).collect();
        assert!(found.len() > 10);
        assert!(found.iter().zip(&turned).all(|(a, b)| a.distance(*b) < 1e-6), "{found:?}");
        assert_eq!(bent(&LINE, [BarEnd::Anchored, BarEnd::Straight], Vec3::X, 0.012), LINE);
    }

    #[test]
    fn a_hook_is_as_deep_as_there_is_room_and_none_where_there_is_none() {
        let ends = [BarEnd::Anchored, BarEnd::Hooked];
        let deep = bent(&LINE, ends, 0.1 * Vec3::X, 0.02);
        assert!((deep[deep.len() - 1].x - 0.1).abs() < 1e-6, "{deep:?}");
        let flat = bent(&LINE, ends, 0.03 * Vec3::X, 0.02);
        let far = flat.iter().map(|p| p.x).fold(0.0, f32::max);
        assert!((far - 0.03).abs() < 1e-6, "{flat:?}");
        for (line, inward) in [(LINE, Vec3::ZERO), (LINE, 0.01 * Vec3::X), (LINE, Vec3::Z)] {
            assert_eq!(bent(&line, ends, inward, 0.02), line);
        }
        let short = [Vec3::ZERO, 0.05 * Vec3::Z];
        assert_eq!(bent(&short, ends, Vec3::X, 0.02), short);
    }
}
