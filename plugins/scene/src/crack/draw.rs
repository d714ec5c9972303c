//! A scene with its damage to be seen: slots where cracks are, craters where cover is missing.

use std::sync::Arc;

use glam::{DVec3, Mat3, Mat4, Vec3};
use intrados_stage::random::Key;

use super::{
    CrackSurface, Spalled, SurfaceDamage,
    carve::{Carved, Group, carve},
    course::{Rib, piece_length, ribs, stations},
    zone::{Bowl, Zone},
};
use crate::{
    Finish, FinishKind, Hit, Material, Mesh, Object, Part, Ray, Scene, Surface as Brdf, Tracer,
    tracer::Scratch,
};

/// Within this distance of the member's surface damage is moved onto it, m.
const NEAR: f32 = 0.05;
/// Damage goes through this share of a member at most.
const THROUGH: f64 = 0.45;
/// One chip of a lip on so many metres of crack, where it is wide enough.
const CHIP_EVERY: f64 = 0.12;
/// So many spalls show their steel; of more it would not be seen.
const MOST_BARED: usize = 1000;
/// Cracks narrower than this have no chips, m.
const CHIPPED: f64 = 2.5e-4;

impl Scene {
    /// The scene with damage to be seen: cracks as slots as wide as they are times `widening`, with
    /// walls and a floor; missing cover as craters of broken concrete, with the steel that lies in
    /// them, rusty. Its hash says that it is another scene. Members that the scene has not are left
    /// out, and damage that is not on its member's surface.
    #[must_use]
    pub fn marked(&self, damage: &[SurfaceDamage], widening: f32) -> Self {
        let mut scene = self.clone();
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.hash.as_bytes());
        hasher.update(&widening.to_le_bytes());
        for damage in damage.iter().filter(|d| !d.is_empty()) {
            let Some(member) = scene.members.iter().position(|m| m.id == damage.member) else {
                continue;
            };
            for mesh in mark(&mut scene, member, damage, widening) {
                mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|x| {
                    hasher.update(&x.to_le_bytes());
                });
            }
        }
        scene.hash = hasher.finalize().to_hex().to_string();
        scene
    }
}

/// Draws the damage of one member; gives back the meshes that came to the scene.
fn mark(scene: &mut Scene, member: usize, damage: &SurfaceDamage, widening: f32) -> Vec<Arc<Mesh>> {
    let (concrete, meshes) = concrete(scene, member);
    let Some(&first) = concrete.first() else { return Vec::new() };
    let surface = Surface::of(&meshes);
    let (zones, groups) = zones(&surface, damage, widening, member as u64);
    let Carved { faces, slots, bowls } = carve(&meshes, &zones, &groups, damage.spalls.len());
    let mut came = Vec::new();
    for (&o, face) in concrete.iter().zip(faces) {
        let Some(face) = face else { continue };
        came.push(Arc::new(face));
        scene.objects[o].mesh = scene.meshes.len();
        scene.objects[o].transform = Mat4::IDENTITY;
        scene.meshes.push(Arc::clone(&came[came.len() - 1]));
    }
    let inner = inner_material(&scene.materials[scene.objects[first].material]);
    let mut put = |mesh: Mesh, material: Material, name: String| {
        if mesh.triangles.is_empty() {
            return;
        }
        came.push(Arc::new(mesh));
        scene.objects.push(Object {
            name,
            mesh: scene.meshes.len(),
            transform: Mat4::IDENTITY,
            material: scene.materials.len(),
            member: Some(member),
            part: Part::Concrete,
        });
        scene.meshes.push(Arc::clone(&came[came.len() - 1]));
        scene.materials.push(material);
    };
    put(slots, inner.clone(), format!("cracks of {}", damage.member));
    for (number, bowl) in bowls.into_iter().enumerate() {
        let key = Key::new(member as u64, number as u64);
        let finish = Some(Arc::new(Finish::new(FinishKind::Broken, key, 0.2)));
        let broken = Material { name: "broken concrete".into(), finish, ..inner.clone() };
        put(bowl, broken, format!("missing cover of {}", damage.member));
    }
    let steel = bared(scene, member, &damage.spalls);
    if !steel.triangles.is_empty() {
        came.push(Arc::new(steel));
        scene.objects.push(Object {
            name: format!("bared steel of {}", damage.member),
            mesh: scene.meshes.len(),
            transform: Mat4::IDENTITY,
            material: scene.materials.len(),
            member: Some(member),
            part: Part::Concrete,
        });
        scene.meshes.push(Arc::clone(&came[came.len() - 1]));
        scene.materials.push(rust());
    }
    came
}

/// A member's objects of concrete, and their meshes in the world's frame.
pub(super) fn concrete(scene: &Scene, member: usize) -> (Vec<usize>, Vec<Mesh>) {
    let is_its = |o: &Object| o.member == Some(member) && o.part == Part::Concrete;
    (0..scene.objects.len())
        .filter(|&o| is_its(&scene.objects[o]))
        .map(|o| (o, placed(&scene.meshes[scene.objects[o].mesh], &scene.objects[o].transform)))
        .unzip()
}

/// What a crack bares: the concrete itself, without what formwork and weather left outside.
fn inner_material(face: &Material) -> Material {
    Material {
        name: "crack".into(),
        assumed: false,
        surface: Brdf::Lambert,
        base_colour: face.base_colour * face.finish.as_ref().map_or(Vec3::ONE, |f| f.tint()),
        ..Material::default()
    }
}

fn rust() -> Material {
    Material {
        name: "rusted steel".into(),
        assumed: false,
        surface: Brdf::Lambert,
        base_colour: Vec3::new(0.13, 0.055, 0.025),
        ..Material::default()
    }
}

/// A mesh in the world's frame.
fn placed(mesh: &Mesh, transform: &Mat4) -> Mesh {
    let mut out = mesh.clone();
    let linear = Mat3::from_mat4(*transform);
    out.positions.iter_mut().for_each(|p| *p = transform.transform_point3(*p));
    let normals = linear.inverse().transpose();
    out.normals.iter_mut().for_each(|n| *n = (normals * *n).normalize_or(*n));
    let hand = linear.determinant().signum();
    for t in &mut out.tangents {
        *t = (linear * t.truncate()).normalize_or(t.truncate()).extend(t.w * hand);
    }
    if hand < 0.0 {
        out.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    out
}

/// The concrete of a member, to put things on.
pub(super) struct Surface {
    triangles: Vec<[Vec3; 3]>,
    tracer: Tracer,
}

/// Rays into the member start so far below its surface, m.
const SKIN: f32 = 1e-4;

impl Surface {
    pub(super) fn of(meshes: &[Mesh]) -> Self {
        let corners =
            |mesh: &Mesh| (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect::<Vec<_>>();
        let triangles: Vec<[Vec3; 3]> = meshes.iter().flat_map(corners).collect();
        Self { tracer: Tracer::build(&triangles), triangles }
    }

    fn hits(&self, rays: &[Ray]) -> Vec<Hit> {
        let mut hits = vec![Hit::MISS; rays.len()];
        self.tracer.closest(rays, &mut hits, &mut Scratch::default());
        hits
    }

    fn distances(&self, rays: &[Ray]) -> Vec<f32> {
        self.hits(rays).into_iter().map(|hit| hit.t).collect()
    }

    /// What a ray along a unit direction meets, and the normal there.
    pub(super) fn meet(&self, from: Vec3, way: Vec3) -> Option<(Vec3, Vec3)> {
        let hit = self.hits(&[Ray::new(from, way, f32::INFINITY)])[0];
        let [a, b, c] = *self.triangles.get(hit.triangle as usize)?;
        Some((from + hit.t * way, (b - a).cross(c - a).try_normalize()?))
    }

    /// How far it is to the other side from a place on the surface, m; infinite where there is none.
    pub(super) fn thickness(&self, at: Vec3, outward: Vec3) -> f32 {
        self.through(&[(at, outward)])[0]
    }

    /// The points moved onto the surface along their normals; where none is near they stay.
    fn put(&self, points: &[(Vec3, Vec3)]) -> Vec<Vec3> {
        let ray = |&(p, outward): &(Vec3, Vec3)| Ray::new(p + NEAR * outward, -outward, 2.0 * NEAR);
        let found = self.distances(&points.iter().map(ray).collect::<Vec<_>>());
        let moved = |(&(p, outward), t): (&(Vec3, Vec3), f32)| {
            if t.is_finite() { p + outward * (NEAR - t) } else { p }
        };
        points.iter().zip(found).map(moved).collect()
    }

    /// How far it is to the other side, from places on the surface, m.
    fn through(&self, points: &[(Vec3, Vec3)]) -> Vec<f32> {
        let ray = |&(p, outward): &(Vec3, Vec3)| Ray::new(p - SKIN * outward, -outward, 100.0);
        self.distances(&points.iter().map(ray).collect::<Vec<_>>())
    }
}

/// What to carve: the pieces of all cracks, then missing cover.
fn zones(
    surface: &Surface,
    damage: &SurfaceDamage,
    widening: f32,
    member: u64,
) -> (Vec<Zone>, Vec<Group>) {
    let (mut zones, mut groups, mut bowls) = (Vec::new(), Vec::new(), Vec::new());
    let piece = piece_length(&damage.cracks);
    for (number, crack) in damage.cracks.iter().enumerate() {
        let key = Key::new(member, number as u64);
        let ribs = laid(surface, crack, piece, widening, key);
        let points = beside(&ribs, piece);
        bowls.extend(chips(&ribs, key));
        let begin = zones.len();
        zones.extend(ribs.windows(2).map(|pair| Zone::Slot([pair[0], pair[1]])));
        groups.push(Group { zones: begin..zones.len(), points, ..Group::default() });
    }
    bowls.extend(damage.spalls.iter().enumerate().map(|(i, s)| crater(surface, s, i)));
    for bowl in bowls {
        let zone = Zone::Bowl(bowl);
        let outward = zone.outward();
        let points = zone.inner().into_iter().map(|(p, apart)| (p, apart, outward)).collect();
        groups.push(Group { zones: zones.len()..zones.len() + 1, points, ..Group::default() });
        zones.push(zone);
    }
    for group in &mut groups {
        let bounds = zones[group.zones.clone()].iter().map(Zone::bounds);
        let all = bounds.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
        group.bounds = all.unwrap_or([DVec3::INFINITY, DVec3::NEG_INFINITY]);
    }
    (zones, groups)
}

/// A crack's ribs, on the surface and no deeper than its member bears.
fn laid(surface: &Surface, crack: &CrackSurface, piece: f64, widening: f32, key: Key) -> Vec<Rib> {
    let mut line = stations(crack, piece, widening, key);
    let places = |line: &[super::course::Station]| -> Vec<(Vec3, Vec3)> {
        line.iter().map(|s| (s.at, s.outward)).collect()
    };
    let on = surface.put(&places(&line));
    for (station, at) in line.iter_mut().zip(on) {
        station.at = at;
    }
    let through = surface.through(&places(&line));
    let mut ribs = ribs(&line, crack.depth, key);
    for (rib, through) in ribs.iter_mut().zip(through) {
        rib.depth = rib.depth.min(THROUGH * f64::from(through));
    }
    ribs
}

/// Points about a crack, in rows ever wider apart: without them the face would become slivers from
/// the crack to the corners of the member.
fn beside(ribs: &[Rib], piece: f64) -> Vec<(DVec3, f64, DVec3)> {
    const FARTHEST: f64 = 1.0;
    let mut points = Vec::new();
    let mut apart = 2.5 * piece;
    let mut every = 2;
    while apart < FARTHEST && every / 2 < ribs.len() {
        for i in (0..ribs.len()).step_by(every) {
            let (before, after) = (&ribs[i.saturating_sub(1)], &ribs[(i + 1).min(ribs.len() - 1)]);
            let way = (after.at - before.at).normalize_or_zero();
            let across = way.cross(ribs[i].outward);
            for side in [-1.0, 1.0] {
                points.push((ribs[i].at + side * apart * across, 0.6 * apart, ribs[i].outward));
            }
            for (end, out) in [(0, -1.0), (ribs.len() - 1, 1.0)] {
                if i == end {
                    points.push((ribs[i].at + out * apart * way, 0.6 * apart, ribs[i].outward));
                }
            }
        }
        (apart, every) = (2.0 * apart, 2 * every);
    }
    points
}

/// Lips that have chipped off.
fn chips(ribs: &[Rib], key: Key) -> Vec<Bowl> {
    let mut chips = Vec::new();
    for (i, pair) in ribs.windows(2).enumerate() {
        let number = i as u32;
        let width = pair[0].lips[0].distance(pair[0].lips[1]);
        let share = (pair[0].at.distance(pair[1].at) / CHIP_EVERY) as f32;
        if width < CHIPPED || key.unit(100 + 4 * number) > share {
            continue;
        }
        let size = 0.8e-3 + width * f64::from(0.4 + 0.8 * key.unit(101 + 4 * number));
        let lip = usize::from(key.unit(102 + 4 * number) > 0.5);
        chips.push(Bowl {
            centre: pair[0].lips[lip],
            outward: pair[0].outward,
            radius: size,
            depth: 0.3 * size,
            spall: None,
            key: key.split(3, number),
        });
    }
    chips
}

fn crater(surface: &Surface, spall: &Spalled, number: usize) -> Bowl {
    let place = [(spall.centre, spall.outward)];
    let centre = surface.put(&place)[0];
    let through = surface.through(&[(centre, spall.outward)])[0];
    let bits = |x: f32| u64::from(x.to_bits());
    let key = Key::new(bits(spall.centre.x) << 32 | bits(spall.centre.y), bits(spall.centre.z));
    Bowl {
        centre: centre.as_dvec3(),
        outward: spall.outward.as_dvec3().normalize(),
        radius: f64::from(spall.radius),
        depth: f64::from(spall.depth).min(THROUGH * f64::from(through)),
        spall: Some(number),
        key,
    }
}

/// The steel of a member that lies where cover is missing.
fn bared(scene: &Scene, member: usize, spalls: &[Spalled]) -> Mesh {
    let mut mesh = Mesh::default();
    if spalls.is_empty() {
        return mesh;
    }
    let is_near = |p: Vec3| {
        spalls.iter().take(MOST_BARED).any(|s| {
            let from = p - s.centre;
            let below = -from.dot(s.outward);
            let aside = (from + below * s.outward).length();
            aside < 1.15 * s.radius && (-NEAR..1.3 * s.depth).contains(&below)
        })
    };
    let is_steel = |o: &&Object| {
        o.member == Some(member) && matches!(o.part, Part::Bar | Part::Stirrup | Part::Tendon)
    };
    for object in scene.objects.iter().filter(is_steel) {
        let of = &scene.meshes[object.mesh];
        for t in 0..of.triangles.len() {
            let [a, b, c] = of.corners(t).map(|p| object.transform.transform_point3(p));
            // Long triangles of a bar pass a spall that none of their corners is near.
            let steps = 1 + (a.distance(b).max(b.distance(c)).max(c.distance(a)) / 0.02) as u32;
            let along = |p: Vec3, q: Vec3| {
                (0..=steps.min(2000)).any(|k| is_near(p.lerp(q, k as f32 / steps as f32)))
            };
            if along(a, b) || along(b, c) || along(c, a) {
                let first = mesh.positions.len() as u32;
                mesh.positions.extend([a, b, c]);
                mesh.triangles.push([first, first + 1, first + 2]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use intrados_stage::Job;

    use super::{super::course::PIECE, *};
    use crate::Mouth;

    fn at(p: Vec3, outward: Vec3, width: f32) -> Mouth {
        Mouth { at: p, outward, width }
    }

    fn crack(mouth: Vec<Mouth>, depth: f32) -> CrackSurface {
        CrackSurface { mouth, normal: Vec3::Y, depth }
    }

    fn column() -> Scene {
        Scene::load_bundled("column", &Job::default()).unwrap()
    }

    fn marked(scene: &Scene, cracks: Vec<CrackSurface>, spalls: Vec<Spalled>) -> Scene {
        let member = scene.members[0].id.clone();
        scene.marked(&[SurfaceDamage { member, cracks, spalls }], 1.0)
    }

    /// All concrete of the first member, as light sees it.
    fn concrete(scene: &Scene) -> Vec<[Vec3; 3]> {
        let is_concrete = |o: &&Object| o.member == Some(0) && o.part == Part::Concrete;
        let corners = |o: &Object| {
            let mesh = &scene.meshes[o.mesh];
            (0..mesh.triangles.len())
                .map(|t| mesh.corners(t).map(|p| o.transform.transform_point3(p)))
                .collect::<Vec<_>>()
        };
        scene.objects.iter().filter(is_concrete).flat_map(corners).collect()
    }

    fn volume(triangles: &[[Vec3; 3]]) -> f64 {
        let six = |t: &[Vec3; 3]| {
            let [a, b, c] = t.map(Vec3::as_dvec3);
            a.dot(b.cross(c))
        };
        triangles.iter().map(six).sum::<f64>() / 6.0
    }

    /// How many directed edges have no partner the other way round, lengths above a tenth of a
    /// millimetre.
    fn open_edges(triangles: &[[Vec3; 3]]) -> usize {
        let mut edges = std::collections::HashMap::<[[u32; 3]; 2], i32>::new();
        let bits = |p: Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
        for t in triangles {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                let (i, j) = (bits(a), bits(b));
                if i < j {
                    *edges.entry([i, j]).or_default() += 1;
                } else {
                    *edges.entry([j, i]).or_default() -= 1;
                }
            }
        }
        edges.values().filter(|&&n| n != 0).count()
    }

    /// The front of the column, its height and its borders.
    fn front(scene: &Scene) -> (f32, Vec3, Vec3) {
        let [low, high] = scene.members[0].bounds;
        (high.z, low, high)
    }

    /// The surface stays closed, and what it encloses shrinks by the slot: mean width × length ×
    /// depth.
    #[test]
    fn a_slot_is_closed_and_takes_away_its_own_volume() {
        let scene = column();
        let before = concrete(&scene);
        assert_eq!(open_edges(&before), 0);
        let (z, low, high) = front(&scene);
        let x = |t: f32| low.x + t * (high.x - low.x);
        for width in [1e-4, 1e-3, 1e-2] {
            let mouth = vec![
                at(Vec3::new(x(0.2), 1.4, z + 0.002), Vec3::Z, width),
                at(Vec3::new(x(0.8), 1.6, z + 0.002), Vec3::Z, width),
            ];
            let length = f64::from(mouth[0].at.distance(mouth[1].at));
            let scene = marked(&scene, vec![crack(mouth, 0.02)], Vec::new());
            let after = concrete(&scene);
            assert_eq!(open_edges(&after), 0, "width {width}");
            let gone = volume(&before) - volume(&after);
            let expected = length * f64::from(width) * 0.02;
            assert!((0.7..1.4).contains(&(gone / expected)), "{gone} of {expected}");
        }
    }

    /// Faces and mouths together are as large as the face was, to a millionth: here by the floors of
    /// slots, which have the area of their mouths where the face is flat.
    #[test]
    fn the_face_loses_its_mouths_and_nothing_else() {
        let scene = column();
        let (z, low, high) = front(&scene);
        let x = |t: f32| low.x + t * (high.x - low.x);
        let line = |a: [f32; 2], b: [f32; 2]| {
            let point = |[t, y]: [f32; 2]| at(Vec3::new(x(t), y, z), Vec3::Z, 3e-3);
            crack(vec![point(a), point(b)], 0.01)
        };
        // Two that cross, one beside them.
        let cracks = vec![
            line([0.1, 1.0], [0.9, 1.5]),
            line([0.1, 1.5], [0.9, 1.0]),
            line([0.3, 2.0], [0.7, 2.0]),
        ];
        let after = marked(&scene, cracks, Vec::new());
        let flat = |triangles: &[[Vec3; 3]]| {
            // What faces forward, wherever it lies in depth.
            let area = |t: &[Vec3; 3]| {
                let [a, b, c] = t.map(Vec3::as_dvec3);
                0.5 * (b - a).cross(c - a).z.max(0.0)
            };
            triangles.iter().map(area).sum::<f64>()
        };
        let (old, new) = (flat(&concrete(&scene)), flat(&concrete(&after)));
        assert!((new / old - 1.0).abs() < 1e-6, "{old} {new}");
        assert_eq!(open_edges(&concrete(&after)), 0);
    }

    #[test]
    fn a_ray_down_a_slot_meets_its_floor_at_its_depth() {
        let scene = column();
        let (z, low, high) = front(&scene);
        let x = 0.5 * (low.x + high.x);
        let mouth = vec![
            at(Vec3::new(x - 0.1, 1.5, z), Vec3::Z, 2e-3),
            at(Vec3::new(x + 0.1, 1.5, z), Vec3::Z, 2e-3),
        ];
        let crack = crack(mouth, 0.04);
        let triangles = concrete(&marked(&scene, vec![crack.clone()], Vec::new()));
        let tracer = Tracer::build(&triangles);
        let ribs = {
            let line = stations(&crack, PIECE, 1.0, Key::new(0, 0));
            ribs(&line, crack.depth, Key::new(0, 0))
        };
        let mut deep = 0;
        for rib in &ribs[5..ribs.len() - 5] {
            let middle = (0.5 * (rib.lips[0] + rib.lips[1])).as_vec3();
            let ray = Ray::new(middle.with_z(z + 0.5), -Vec3::Z, 10.0);
            let mut hit = [Hit::MISS];
            tracer.closest(&[ray], &mut hit, &mut Scratch::default());
            let depth = f64::from(hit[0].t - 0.5);
            assert!((depth - rib.depth).abs() < 1e-4, "{depth} {}", rib.depth);
            deep += usize::from(depth > 0.039);
        }
        assert!(deep > ribs.len() / 2);
    }

    #[test]
    fn damage_beyond_a_face_at_its_edge_and_off_the_member_leaves_it_closed() {
        let scene = column();
        let (z, low, high) = front(&scene);
        let across = |from: f32, to: f32, y: f32| {
            crack(
                vec![
                    at(Vec3::new(from, y, z), Vec3::Z, 2e-3),
                    at(Vec3::new(to, y, z), Vec3::Z, 2e-3),
                ],
                0.03,
            )
        };
        // Runs out over an arris, ends on it, turns round it, lies in the air.
        let over = across(low.x + 0.1, high.x + 0.2, 1.0);
        let upon = across(low.x + 0.1, high.x, 1.4);
        let round = crack(
            vec![
                at(Vec3::new(high.x - 0.1, 1.8, z), Vec3::Z, 2e-3),
                at(Vec3::new(high.x, 1.8, z), (Vec3::Z + Vec3::X).normalize(), 2e-3),
                at(Vec3::new(high.x, 1.8, z - 0.1), Vec3::X, 2e-3),
            ],
            0.03,
        );
        let air = across(high.x + 1.0, high.x + 1.5, 1.0);
        let after = marked(&scene, vec![air.clone()], Vec::new());
        assert_eq!(concrete(&after).len(), concrete(&scene).len());
        for (name, one) in [("over", over), ("upon", upon), ("round", round)] {
            let after = concrete(&marked(&scene, vec![one], Vec::new()));
            assert!(after.len() > concrete(&scene).len(), "{name}");
            assert_eq!(open_edges(&after), 0, "{name}");
        }
    }

    #[test]
    fn missing_cover_is_a_closed_crater_with_its_steel_in_it() {
        let scene = column();
        let (z, low, high) = front(&scene);
        let centre = Vec3::new(0.5 * (low.x + high.x), 1.2, z);
        let spall = Spalled { centre, outward: Vec3::Z, radius: 0.12, depth: 0.07 };
        let after = marked(&scene, Vec::new(), vec![spall]);
        let named = |name: &str| after.objects.iter().any(|o| o.name.starts_with(name));
        assert!(named("missing cover") && named("bared steel"));
        let is_steel = |o: &&Object| o.name.starts_with("bared");
        let steel = after.objects.iter().find(is_steel).unwrap().mesh;
        let mut shell = concrete(&after);
        let bars = &after.meshes[steel];
        shell.truncate(shell.len() - bars.triangles.len());
        assert_eq!(open_edges(&shell), 0);
        let gone = volume(&concrete(&scene)) - volume(&shell);
        let disc = std::f64::consts::PI * 0.12 * 0.12 * 0.07;
        assert!((0.2..0.9).contains(&(gone / disc)), "{gone} of {disc}");
    }
}
