//! What mechanics tells of a member's surface, in a specimen.

use glam::Vec3;
use intrados_scene::SurfaceDamage;

use super::{
    member::{Place, ROUGHNESS},
    recipe::{Crack, Recipe, Spall},
};

/// Most cracks of one specimen; the widest count.
const MOST: usize = 64;

impl Recipe {
    /// Adds the cracks and the missing cover that come near the specimen. A crack goes through its
    /// mouth's point nearest to the middle of the specimen, flat but for its roughness, and as wide
    /// as it is at most within the specimen's height.
    pub fn tell(&mut self, damage: &SurfaceDamage, place: &Place) {
        let reach = self.outline.reach() + 0.03;
        let end = 0.5 * self.height + 0.03;
        let near = |p: Vec3| {
            let p = place.local(p);
            p.z.abs() < end && p.truncate().length() < 2.0 * reach
        };
        for crack in &damage.cracks {
            let normal = place.turned(crack.normal.as_dvec3()).normalize_or_zero();
            let points = crack.mouth.iter().filter(|m| near(m.at));
            let width = f64::from(points.clone().map(|m| m.width).fold(0.0, f32::max));
            let distance = |at: Vec3| place.local(at).length();
            let Some(middle) = points.min_by(|a, b| distance(a.at).total_cmp(&distance(b.at)))
            else {
                continue;
            };
            let inward = -place.turned(middle.outward.as_dvec3());
            // In its plane.
            let inward = (inward - inward.dot(normal) * normal).normalize_or_zero();
            let (mouth, depth) = (place.local(middle.at), f64::from(crack.depth));
            if inward.length() > 0.5
                && normal.length() > 0.5
                && depth > 0.0
                && width > 0.0
                && mouth.dot(normal).abs() < reach.max(end)
            {
                self.cracks.push(Crack {
                    mouth,
                    normal,
                    inward,
                    depth,
                    width,
                    round: true,
                    roughness: ROUGHNESS,
                });
            }
        }
        self.cracks.sort_by(|a, b| b.width.total_cmp(&a.width));
        self.cracks.truncate(MOST);
        for spall in damage.spalls.iter().filter(|s| near(s.centre)) {
            let (centre, outward) = (
                place.local(spall.centre),
                place.turned(spall.outward.as_dvec3()).normalize_or_zero(),
            );
            self.spalls.push(Spall {
                centre,
                outward,
                radius: f64::from(spall.radius),
                depth: f64::from(spall.depth),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use intrados_scene::{CrackSurface, Mouth, Scene};
    use intrados_stage::Job;

    use super::*;
    use crate::specimen::concrete::{Subject, of_member};

    #[test]
    fn a_crack_of_mechanics_is_where_it_was() {
        let scene = Scene::load_bundled("column", &Job::default()).unwrap();
        let member = Subject::of(&scene, "C1").unwrap();
        let (mut recipe, place) = of_member(member, 0.5, 0.6, 0.2, 2e-3, 1).unwrap();
        let (before, frame) = (recipe.cracks.len(), scene.members[0].frame);
        // Across the front, 20 mm above the scan plane; and one far away.
        let crack = |lift: f32| {
            let at =
                |x: f32| frame.point(0.5) + 0.2 * frame.zero + lift * Vec3::Y + x * frame.ninety();
            let mouth = |x: f32| Mouth { at: at(x), outward: frame.zero, width: 4e-4 };
            CrackSurface {
                mouth: [-0.2, 0.0, 0.2].map(mouth).to_vec(),
                normal: Vec3::Y,
                depth: 0.12,
            }
        };
        let damage = SurfaceDamage {
            member: "C1".into(),
            cracks: vec![crack(0.02), crack(1.0)],
            spalls: Vec::new(),
        };
        recipe.tell(&damage, &place);
        assert_eq!(recipe.cracks.len(), before + 1);
        let told = recipe.cracks[0];
        assert!(
            (told.mouth.z - 0.02).abs() < 1e-5
                && told.mouth.truncate().distance(glam::DVec2::new(0.2, 0.0)) < 1e-5,
            "{told:?}"
        );
        assert!((told.normal.z.abs() - 1.0).abs() < 1e-6 && (told.inward.x + 1.0).abs() < 1e-6);
        assert!((told.width - 4e-4).abs() < 1e-9 && (told.depth - 0.12).abs() < 1e-6);
        assert!(recipe.check().is_ok());
    }
}
