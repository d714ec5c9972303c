//! What of a member's planted truth is to be seen from outside: mouths of cracks, missing cover.

use glam::Vec3;

use super::{CrackSurface, Mouth, Spalled, SurfaceDamage, draw::Surface, draw::concrete};
use crate::{Damage, Member, MemberKind, Scene};

/// A mouth is told so often around its member, degrees.
const STEP: f32 = 3.0;

impl Scene {
    /// The planted cracks and spalls of all members as [`Scene::marked`] draws them. Honeycombs,
    /// voids, corrosion and softening do not show.
    #[must_use]
    pub fn planted(&self) -> Vec<SurfaceDamage> {
        (0..self.members.len())
            .map(|m| planted(self, m))
            .filter(|damage| !damage.is_empty())
            .collect()
    }
}

fn planted(scene: &Scene, index: usize) -> SurfaceDamage {
    let member = &scene.members[index];
    let mut seen = SurfaceDamage { member: member.id.clone(), ..SurfaceDamage::default() };
    if !member.truth.iter().any(|d| matches!(d, Damage::Crack { .. } | Damage::Spall { .. })) {
        return seen;
    }
    let surface = Surface::of(&concrete(scene, index).1);
    for damage in &member.truth {
        match *damage {
            Damage::Crack { along, width_mm, depth, angle_deg } => {
                let crack = mouth(&surface, member, along, angle_deg, depth, 1e-3 * width_mm);
                seen.cracks.extend(crack);
            }
            Damage::Spall { along, angle_deg, diameter_m, depth_m } => {
                let place = face(&surface, member, along, angle_deg);
                seen.spalls.extend(place.map(|(centre, outward)| Spalled {
                    centre,
                    outward,
                    radius: 0.5 * diameter_m,
                    depth: depth_m,
                }));
            }
            Damage::Voids { .. }
            | Damage::Honeycomb { .. }
            | Damage::Corrosion { .. }
            | Damage::Softened { .. } => {}
        }
    }
    seen
}

/// Where a member is seen at a place of its axis and an angle about it: a point of its surface and
/// the normal there. Linings are seen from inside.
fn face(surface: &Surface, member: &Member, along: f32, angle_deg: f32) -> Option<(Vec3, Vec3)> {
    let (from, out) = (member.frame.point(along), member.frame.radial(angle_deg));
    let far = (member.bounds[1] - member.bounds[0]).length();
    match member.kind {
        MemberKind::Lining | MemberKind::Segment => surface.meet(from, out),
        _ => surface.meet(from + far * out, -out),
    }
}

/// The mouth of a crack across the member's axis: as far around it as the crack's depth reaches
/// from the side where it begins.
fn mouth(
    surface: &Surface,
    member: &Member,
    along: f32,
    angle_deg: f32,
    depth: f32,
    width: f32,
) -> Option<CrackSurface> {
    let (begin, outward) = face(surface, member, along, angle_deg)?;
    let through = surface.thickness(begin, outward).min(1e3);
    let depth = depth * through;
    if depth <= 0.0 || width <= 0.0 {
        return None;
    }
    let to = |sign: f32| {
        (1..=(178.0 / STEP) as u32)
            .map(move |k| face(surface, member, along, angle_deg + sign * STEP * k as f32))
            .take_while(|place| place.is_some_and(|(p, _)| (begin - p).dot(outward) < depth))
            .flatten()
    };
    let before: Vec<(Vec3, Vec3)> = to(-1.0).collect();
    let line = before.into_iter().rev().chain([(begin, outward)]).chain(to(1.0));
    // Widest where it begins, closed where it ends.
    let mouth: Vec<Mouth> = line
        .map(|(at, outward_there)| {
            let left = 1.0 - ((begin - at).dot(outward) / depth).clamp(0.0, 0.95);
            Mouth { at, outward: outward_there, width: width * left }
        })
        .collect();
    let normal = member.frame.axis.normalize_or(Vec3::Y);
    (mouth.len() >= 2).then_some(CrackSurface { mouth, normal, depth })
}

#[cfg(test)]
mod tests {
    use intrados_stage::Job;

    use super::*;

    #[test]
    fn planted_cracks_and_spalls_lie_on_their_members() {
        let scene = Scene::load_bundled("column", &Job::default()).unwrap();
        let planted = scene.planted();
        let told = |d: &Damage| matches!(d, Damage::Crack { .. } | Damage::Spall { .. });
        let count: usize =
            scene.members.iter().map(|m| m.truth.iter().filter(|d| told(d)).count()).sum();
        let found: usize = planted.iter().map(|d| d.cracks.len() + d.spalls.len()).sum();
        assert!(count > 0 && found == count, "{found} of {count}");
        for damage in &planted {
            let member = scene.members.iter().find(|m| m.id == damage.member).unwrap();
            let [low, high] = member.bounds;
            for crack in &damage.cracks {
                assert!(crack.mouth.len() > 5);
                let on = |p: Vec3| p.cmpge(low - 1e-4).all() && p.cmple(high + 1e-4).all();
                assert!(crack.mouth.iter().all(|m| on(m.at) && m.width > 0.0));
            }
        }
        let marked = scene.marked(&planted, 1.0);
        assert!(marked.triangle_count() > scene.triangle_count());
    }
}
