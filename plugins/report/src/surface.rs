//! Members' surfaces cut at the borders of zones, so that each piece has the damage of its own
//! zone: for models, tables of cells and the window.

use std::sync::Arc;

use glam::Vec3;
use intrados_damage::{
    verdict::Basis,
    zone::{ZONES, zone_at},
};
use intrados_predict::Prediction;
use intrados_scene::{Material, Mesh, Object, Part, Scene, gltf::Model};

/// Linear grey of what nothing is known of.
pub const UNKNOWN: Vec3 = Vec3::splat(0.35);
/// Share of that grey in the colour of what is only forecast.
pub const PALER: f32 = 0.6;
/// Where a cut is made, as a share of the axis, is not moved by less than this.
const CUT: f32 = 1e-5;

/// A triangle of a member's concrete within one zone, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// Corners, m.
    pub corners: [Vec3; 3],
    /// Index of the member.
    pub member: usize,
    /// Zone of its axis.
    pub zone: usize,
}

/// The concrete's triangles of a member, in the world.
pub(crate) fn concrete(scene: &Scene, member: usize) -> Vec<[Vec3; 3]> {
    let own = scene.objects.iter().filter(|o| o.member == Some(member) && o.part == Part::Concrete);
    own.filter_map(|o| Some((o, scene.meshes.get(o.mesh)?)))
        .flat_map(|(o, mesh)| {
            let place = |t| mesh.corners(t).map(|p| o.transform.transform_point3(p));
            (0..mesh.triangles.len()).map(place)
        })
        .collect()
}

/// The concrete surfaces of all members, cut into zones.
#[must_use]
pub fn facets(scene: &Scene) -> Vec<Facet> {
    let mut facets = Vec::new();
    for object in scene.objects.iter().filter(|o| o.part == Part::Concrete) {
        let (Some(member), Some(mesh)) = (object.member, scene.meshes.get(object.mesh)) else {
            continue;
        };
        let Some(frame) = scene.members.get(member).map(|m| m.frame) else { continue };
        let length = frame.axis.length_squared().max(1e-12);
        let along = |p: Vec3| (p - frame.start).dot(frame.axis) / length;
        let mirrored = object.transform.determinant() < 0.0;
        for triangle in 0..mesh.triangles.len() {
            let mut corners = mesh.corners(triangle).map(|p| object.transform.transform_point3(p));
            if mirrored {
                corners.swap(1, 2);
            }
            cut(corners.to_vec(), &along, &mut |zone, corners| {
                facets.push(Facet { corners, member, zone })
            });
        }
    }
    facets
}

/// Cuts a convex polygon at the borders of zones (Sutherland and Hodgman 1974) and hands on its
/// triangles.
fn cut(polygon: Vec<Vec3>, along: &impl Fn(Vec3) -> f32, hand: &mut impl FnMut(usize, [Vec3; 3])) {
    let (low, high) = polygon
        .iter()
        .map(|&p| along(p))
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), a| (l.min(a), h.max(a)));
    let first = zone_at(f64::from(low + CUT));
    let last = zone_at(f64::from(high - CUT)).max(first);
    let mut rest = polygon;
    for zone in first..=last {
        let border = (zone + 1) as f32 / ZONES as f32;
        let inside =
            if zone == last { std::mem::take(&mut rest) } else { below(&rest, along, border, 1.0) };
        if zone < last {
            rest = below(&rest, along, border, -1.0);
        }
        for k in 1..inside.len().saturating_sub(1) {
            hand(zone, [inside[0], inside[k], inside[k + 1]]);
        }
    }
}

/// The part of a polygon on one side of a border: `side` 1 towards the start, −1 towards the end.
fn below(polygon: &[Vec3], along: &impl Fn(Vec3) -> f32, border: f32, side: f32) -> Vec<Vec3> {
    let mut kept = Vec::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (da, db) = (side * (border - along(a)), side * (border - along(b)));
        if da >= 0.0 {
            kept.push(a);
        }
        if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
            kept.push(a.lerp(b, da / (da - db)));
        }
    }
    kept
}

/// The colour of a damage from 0 to 1, linear; grey where nothing is known. The sequence is Brewer's
/// from yellow by orange to red, which all kinds of colour vision tell apart by its lightness: what
/// is sound is pale on any ground, and what is damaged stands out.
#[must_use]
pub fn colour(damage: Option<f64>) -> Vec3 {
    let Some(damage) = damage else { return UNKNOWN };
    let scale = colorous::YELLOW_ORANGE_RED;
    let colorous::Color { r, g, b } = scale.eval_continuous(damage.clamp(0.0, 1.0));
    // sRGB to linear (IEC 61966-2-1).
    let linear = |c: u8| {
        let c = f32::from(c) / 255.0;
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    Vec3::new(linear(r), linear(g), linear(b))
}

/// The same of what is only forecast: half of it grey.
#[must_use]
pub fn forecast(damage: Option<f64>) -> Vec3 {
    colour(damage).lerp(UNKNOWN, PALER)
}

/// How a zone looks: its damage's colour, paler where nobody has measured it.
#[must_use]
pub(crate) fn look(prediction: &Prediction, member: usize, zone: usize) -> Vec3 {
    let Some(m) = prediction.members.get(member) else { return UNKNOWN };
    let damage = m.zones.0[zone].map(|r| r.value);
    if m.zone_basis[zone] == Basis::Forecast { forecast(damage) } else { colour(damage) }
}

/// The scene with its members coloured by damage, of whose surfaces `facets` are; everything else
/// stays.
#[must_use]
pub(crate) fn coloured(scene: &Scene, facets: &[Facet], prediction: &Prediction) -> Model {
    let mut model = Model::from(scene);
    model.objects.retain(|o| o.member.is_none() || o.part != Part::Concrete);
    let white = model.materials.len();
    model.materials.push(Material {
        name: "damage".into(),
        base_colour: Vec3::ONE,
        ..Material::default()
    });
    let mut shapes: Vec<Mesh> = vec![Mesh::default(); scene.members.len()];
    for facet in facets {
        let mesh = &mut shapes[facet.member];
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(facet.corners);
        mesh.colours.extend([look(prediction, facet.member, facet.zone); 3]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    for (index, mesh) in shapes.into_iter().enumerate().filter(|(_, m)| !m.triangles.is_empty()) {
        model.objects.push(Object {
            name: scene.members[index].name.clone(),
            mesh: model.meshes.len(),
            transform: glam::Mat4::IDENTITY,
            material: white,
            member: Some(index),
            part: Part::Concrete,
        });
        model.meshes.push(Arc::new(mesh));
    }
    model
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle over the whole axis: its pieces lie in their zones, and together have its area.
    #[test]
    fn pieces_lie_in_their_zones() {
        let corners =
            vec![Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 0.3, 0.0), Vec3::new(0.2, 1.0, 0.0)];
        let area = |c: &[Vec3]| 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).z;
        let (whole, mut sum, mut zones) = (area(&corners), 0.0, [0; ZONES]);
        cut(corners, &|p| p.x, &mut |zone, c| {
            assert!(
                c.iter()
                    .all(|p| p.x >= zone as f32 / 10.0 - 1e-4
                        && p.x <= (zone + 1) as f32 / 10.0 + 1e-4),
                "{zone} {c:?}"
            );
            assert!(area(&c) >= -1e-7);
            sum += area(&c);
            zones[zone] += 1;
        });
        assert!(
            (sum - whole).abs() < 1e-5 && zones.iter().all(|&n| n > 0),
            "{sum} {whole} {zones:?}"
        );
    }

    #[test]
    fn nothing_known_is_grey() {
        assert_eq!(colour(None), UNKNOWN);
        // The worse, the darker.
        let light = [0.0, 0.25, 0.5, 0.75, 1.0].map(|d| colour(Some(d)).element_sum());
        assert!(light.windows(2).all(|w| w[1] < w[0]), "{light:?}");
        // What is forecast is nearer to grey than what is measured, and not grey.
        for d in [0.0, 0.5, 1.0].map(Some) {
            let [pale, full] = [forecast(d), colour(d)].map(|c| c.distance(UNKNOWN));
            assert!(pale > 0.0 && pale < 0.5 * full, "{d:?}");
        }
    }
}
