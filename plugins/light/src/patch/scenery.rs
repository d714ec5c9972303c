//! What a patch shows, drawn at random: the face, its damage, what stands before it, the light, the
//! camera. The face is z = 0, looked at from +z, y is up.

use std::{f32::consts::PI, sync::Arc};

use glam::{Mat4, Vec2, Vec3, vec2};
use intrados_scene::{
    Camera, CrackSurface, Finish, FinishKind, Frame, Lamp, LampKind, Material, Member, MemberKind,
    Mesh, Object, Part, Scene, Spalled, SurfaceDamage,
};
use intrados_stage::random::{Draw, Key};

use super::course::{Pieces, Seed, break_up, grow};

/// A patch before it is seen.
pub(super) struct Drawn {
    pub(super) scene: Scene,
    pub(super) camera: Camera,
    /// m on the face a pixel.
    pub(super) pixel: f32,
    /// Cracks by their middle lines and widths, m.
    pub(super) courses: Vec<Vec<(Vec3, f32)>>,
}

struct Builder {
    draw: Draw,
    key: Key,
    /// Side of what the picture shows, m.
    side: f32,
    scene: Scene,
}

/// The patch of `key`, `size` pixels along a side.
pub(super) fn draw(key: Key, size: u32) -> Drawn {
    let mut draw = Draw::new(key);
    let side = draw.log_between(0.1, 1.2) as f32;
    let pixel = side / size as f32;
    let mut builder = Builder { draw, key, side, scene: Scene::default() };
    let camera = builder.camera(size);
    builder.face(pixel);
    let cracks = builder.cracks(pixel);
    let spalls = builder.spalls();
    builder.before();
    builder.light();
    let courses =
        cracks.iter().map(|crack| crack.mouth.iter().map(|m| (m.at, m.width)).collect()).collect();
    let damage = SurfaceDamage { member: "face".into(), cracks, spalls };
    let mut scene = builder.scene;
    scene.cameras.push(camera.clone());
    if !damage.is_empty() {
        scene = scene.marked(&[damage], 1.0);
    }
    Drawn { scene, camera, pixel, courses }
}

impl Builder {
    fn between(&mut self, low: f32, high: f32) -> f32 {
        self.draw.between(f64::from(low), f64::from(high)) as f32
    }

    fn log(&mut self, low: f32, high: f32) -> f32 {
        self.draw.log_between(f64::from(low), f64::from(high)) as f32
    }

    fn somewhere(&mut self, reach: f32) -> Vec2 {
        let half = 0.5 * reach * self.side;
        vec2(self.between(-half, half), self.between(-half, half))
    }

    fn put(&mut self, name: &str, mesh: Mesh, material: Material, part: Part) {
        let member = (part != Part::Scenery).then_some(0);
        self.scene.objects.push(Object {
            name: name.into(),
            mesh: self.scene.meshes.len(),
            transform: Mat4::IDENTITY,
            material: self.scene.materials.len(),
            member,
            part,
        });
        self.scene.meshes.push(Arc::new(mesh));
        self.scene.materials.push(material);
    }

    fn camera(&mut self, size: u32) -> Camera {
        let fov = self.between(18.0, 55.0);
        let distance = 0.5 * self.side / (0.5 * fov.to_radians()).tan();
        let tilt = 0.6 * self.draw.unit().powi(2) as f32;
        let turn = self.between(0.0, 2.0 * PI);
        let way = Vec3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos());
        let roll =
            if self.draw.chance(0.3) { self.between(-PI, PI) } else { self.between(-0.1, 0.1) };
        Camera {
            name: "patch".into(),
            position: distance * way,
            target: Vec3::ZERO,
            up: Vec3::new(roll.sin(), roll.cos(), 0.0),
            fov_deg: fov,
            width: size,
            height: size,
            lens: None,
            exposure: 0.0,
        }
    }

    /// A piece of wall or paving, with what formwork, weather and people left on it.
    fn face(&mut self, pixel: f32) {
        let kinds = [
            FinishKind::Board,
            FinishKind::Board,
            FinishKind::Panel,
            FinishKind::Panel,
            FinishKind::Plaster,
            FinishKind::Asphalt,
            FinishKind::Brushed,
            FinishKind::Asphalt,
            FinishKind::Plaster,
            FinishKind::Shotcrete,
            FinishKind::Broken,
        ];
        let kind = kinds[self.draw.count(0, kinds.len() - 1)];
        let worn = self.between(0.0, 1.0);
        let (rust, salt) = (self.draw.chance(0.2), self.draw.chance(0.2));
        let mut finish = Finish::new(kind, self.key.split(1, 0), worn).stained(rust, salt);
        if self.draw.chance(0.8) {
            finish = finish.lined(pixel);
        }
        let material = Material {
            name: "face".into(),
            assumed: false,
            base_colour: Vec3::splat(self.between(0.25, 0.55)),
            finish: Some(Arc::new(finish)),
            ..Material::default()
        };
        let half = 2.5 * self.side;
        // An eighth of all faces end within the picture.
        let right = if self.draw.chance(0.12) { self.between(0.1, 0.45) * self.side } else { half };
        let mesh = quad([
            Vec3::new(-half, -half, 0.0),
            Vec3::new(right, -half, 0.0),
            Vec3::new(right, half, 0.0),
            Vec3::new(-half, half, 0.0),
        ]);
        let bounds = [Vec3::new(-half, -half, -0.3), Vec3::new(right, half, 0.0)];
        self.scene.members.push(Member {
            id: "face".into(),
            name: String::new(),
            kind: MemberKind::Wall,
            concrete: "C30/37".into(),
            concrete_assumed: true,
            exposure: None,
            frame: Frame::of_box(MemberKind::Wall, bounds),
            bounds,
            volume: 0.0,
            slices: Vec::new(),
            truth: Vec::new(),
        });
        self.put("face", mesh, material, Part::Concrete);
        if right < half {
            let grey = Vec3::splat(self.between(0.05, 0.6));
            let back = -self.log(0.1, 3.0);
            let far = 4.0 * half;
            let mesh = quad([
                Vec3::new(-far, -far, back),
                Vec3::new(far, -far, back),
                Vec3::new(far, far, back),
                Vec3::new(-far, far, back),
            ]);
            self.put("behind", mesh, plain(grey), Part::Scenery);
            let side = quad([
                Vec3::new(right, -half, 0.0),
                Vec3::new(right, -half, back),
                Vec3::new(right, half, back),
                Vec3::new(right, half, 0.0),
            ]);
            self.put("flank", side, plain(Vec3::splat(0.4)), Part::Scenery);
        }
    }

    /// None to three cracks, from a quarter of a pixel to a dozen wide, or a face in pieces.
    fn cracks(&mut self, pixel: f32) -> Vec<CrackSurface> {
        if self.draw.chance(0.06) {
            let width = self.log(0.4, 3.5) * pixel;
            let pieces = Pieces {
                step: (2.0 * pixel).min(4e-3),
                at: self.somewhere(1.0),
                way: self.between(0.0, 2.0 * PI),
                size: self.log(0.22, 0.6) * self.side,
                reach: self.draw.count(1, 4) as i32,
                width: width.clamp(5e-5, 15e-3),
            };
            return break_up(pieces, self.key.split(3, 0));
        }
        let number = [0, 0, 1, 1, 1, 1, 2, 2, 2, 3][self.draw.count(0, 9)];
        let mut cracks = Vec::new();
        for n in 0..number {
            let wide = self.draw.chance(0.3);
            let pixels = if wide { self.log(2.5, 16.0) } else { self.log(0.35, 4.0) };
            let (way, length) = (self.between(0.0, 2.0 * PI), self.log(0.4, 2.5) * self.side);
            let seed = Seed {
                step: (2.0 * pixel).min(4e-3),
                // Most of it passes through the picture, wherever it begins.
                at: self.somewhere(0.8) - 0.5 * length * Vec2::from_angle(way),
                way,
                length,
                width: (pixels * pixel).clamp(5e-5, 20e-3),
                depth: self.log(2.0, 30.0),
                unrest: self.log(0.5, 2.5) / self.side.sqrt(),
                forks: if self.draw.chance(0.4) { self.log(0.5, 4.0) / self.side } else { 0.0 },
                free: self.draw.chance(0.6),
            };
            cracks.extend(grow(seed, self.key.split(2, n)));
        }
        cracks
    }

    fn spalls(&mut self) -> Vec<Spalled> {
        let number = [0, 0, 0, 0, 0, 0, 0, 1, 1, 2][self.draw.count(0, 9)];
        let spalls: Vec<Spalled> = (0..number)
            .map(|_| {
                let radius = self.log(0.04, 0.28) * self.side.min(0.8);
                Spalled {
                    centre: self.somewhere(0.9).extend(0.0),
                    outward: Vec3::Z,
                    radius,
                    depth: (radius * self.between(0.15, 0.5)).min(0.06),
                }
            })
            .collect();
        let deepest = spalls.iter().map(|s| s.depth).fold(0.0, f32::max);
        if deepest > 8e-3 && self.draw.chance(0.7) {
            let mesh = self.bars(deepest);
            self.put("bars", mesh, plain(Vec3::splat(0.1)), Part::Bar);
        }
        spalls
    }

    /// A mesh of bars just above the floors of missing cover.
    fn bars(&mut self, depth: f32) -> Mesh {
        let radius = self.between(4e-3, 10e-3);
        let spacing = self.between(0.08, 0.2);
        let below = 0.55 * depth + radius;
        let half = 0.8 * self.side;
        let mut mesh = Mesh::default();
        for (way, across, deeper) in [(Vec3::Y, Vec3::X, 0.0), (Vec3::X, Vec3::Y, 2.0 * radius)] {
            let first = self.between(0.0, spacing) - half;
            for k in 0..((2.0 * half / spacing) as u32).min(24) {
                let at = (first + k as f32 * spacing) * across - (below + deeper) * Vec3::Z;
                ribbed(&mut mesh, [at - half * way, at + half * way], radius);
            }
        }
        mesh
    }

    /// What stands before the face and throws shadows on it: cables, rails, poles outside of the
    /// picture.
    fn before(&mut self) {
        if self.draw.chance(0.15) {
            let (radius, off) = (self.log(1e-3, 8e-3), self.log(2e-3, 0.1));
            let (at, turn) = (self.somewhere(0.7), self.between(0.0, PI));
            let sag = self.between(-0.15, 0.15) * self.side;
            let way = vec2(turn.cos(), turn.sin());
            let mut mesh = Mesh::default();
            let point = |s: f32| {
                let along = at + way * s * 1.5 * self.side + way.perp() * sag * (1.0 - s * s);
                along.extend(radius + off)
            };
            for k in -12..12 {
                let ends = [k, k + 1].map(|k| point(k as f32 / 12.0));
                tube(&mut mesh, ends, radius);
            }
            let grey = Vec3::splat(self.log(0.02, 0.7));
            self.put("cable", mesh, plain(grey), Part::Scenery);
        }
        if self.draw.chance(0.1) {
            let (radius, off) = (self.log(0.01, 0.06), self.log(0.05, 0.6));
            let (at, turn) = (self.somewhere(0.8), self.between(-0.2, 0.2));
            let way = Vec3::new(turn.cos(), turn.sin(), 0.0) * 3.0 * self.side;
            let mut mesh = Mesh::default();
            let middle = at.extend(off + radius);
            tube(&mut mesh, [middle - way, middle + way], radius);
            let grey = Vec3::splat(self.log(0.1, 0.7));
            self.put("rail", mesh, plain(grey), Part::Scenery);
        }
    }

    /// Sun and sky, an overcast sky, or lamps; often along the face. And what throws shadows.
    fn light(&mut self) {
        let ground = self.between(0.05, 0.4);
        let far = 40.0;
        let level = -self.log(1.0, 4.0) - self.side;
        let mesh = quad([
            Vec3::new(-far, level, 0.01),
            Vec3::new(-far, level, far),
            Vec3::new(far, level, far),
            Vec3::new(far, level, 0.01),
        ]);
        self.put("ground", mesh, plain(Vec3::splat(ground)), Part::Scenery);
        let glancing = self.draw.chance(0.5);
        let height = if glancing { self.between(0.06, 0.4) } else { self.between(0.4, 1.4) };
        let turn = self.between(-0.3, PI + 0.3);
        let from = Vec3::new(height.cos() * turn.cos(), height.cos() * turn.sin(), height.sin());
        let sky = Vec3::new(0.94, 0.98, 1.06);
        let warm = Vec3::new(1.03, 1.0, 0.95);
        match self.draw.count(0, 9) {
            0..=3 => {
                let strength = self.log(2.0, 12.0);
                self.lamp(LampKind::Directional { direction: -from, irradiance: warm * strength });
                self.lamp(LampKind::Environment { radiance: sky, image: None });
                if self.draw.chance(0.35) {
                    self.shadow(from);
                }
            }
            4..=6 => self.lamp(LampKind::Environment { radiance: Vec3::ONE, image: None }),
            _ => {
                let distance = self.log(0.7, 4.0) * self.side.max(0.4);
                let strength = 12.0 * distance * distance;
                self.lamp(LampKind::Point {
                    position: from * distance,
                    intensity: warm * strength,
                });
                let rest = self.log(0.05, 0.8);
                self.lamp(LampKind::Environment { radiance: sky * rest, image: None });
            }
        }
    }

    fn lamp(&mut self, kind: LampKind) {
        self.scene.lamps.push(Lamp { name: "lamp".into(), kind });
    }

    /// A pole or a wire toward the sun, beyond the picture: only its shadow is seen.
    fn shadow(&mut self, from: Vec3) {
        let at = self.somewhere(0.8).extend(0.0);
        let away = self.log(0.4, 3.0) * (1.0 + self.side);
        let radius = self.log(2e-3, 0.05);
        let turn = self.between(0.0, PI);
        let across = from.any_orthonormal_pair();
        let way = across.0 * turn.cos() + across.1 * turn.sin();
        let mut mesh = Mesh::default();
        let middle = at + away * from;
        tube(&mut mesh, [middle - 4.0 * away * way, middle + 4.0 * away * way], radius);
        self.put("pole", mesh, plain(Vec3::splat(0.3)), Part::Scenery);
    }
}

fn plain(colour: Vec3) -> Material {
    Material { name: "plain".into(), assumed: false, base_colour: colour, ..Material::default() }
}

fn quad(corners: [Vec3; 4]) -> Mesh {
    Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
}

/// A ring of points about an axis; returns the index of the first.
fn ring(mesh: &mut Mesh, at: Vec3, [u, v]: [Vec3; 2], radius: f32) -> u32 {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend((0..SIDES).map(|k| {
        let (sin, cos) = (2.0 * PI * k as f32 / SIDES as f32).sin_cos();
        at + radius * (cos * u + sin * v)
    }));
    first
}

const SIDES: u32 = 10;

fn join(mesh: &mut Mesh, from: u32, to: u32) {
    for k in 0..SIDES {
        let next = (k + 1) % SIDES;
        mesh.triangles.push([from + k, from + next, to + next]);
        mesh.triangles.push([from + k, to + next, to + k]);
    }
}

fn tube(mesh: &mut Mesh, [a, b]: [Vec3; 2], radius: f32) {
    let (u, v) = (b - a).normalize_or(Vec3::Y).any_orthonormal_pair();
    let (from, to) = (ring(mesh, a, [u, v], radius), ring(mesh, b, [u, v], radius));
    join(mesh, from, to);
}

/// A bar with ribs across.
fn ribbed(mesh: &mut Mesh, [a, b]: [Vec3; 2], radius: f32) {
    const PITCH: f32 = 7e-3;
    let (u, v) = (b - a).normalize_or(Vec3::Y).any_orthonormal_pair();
    let rings = ((a.distance(b) / PITCH * 2.0) as u32).clamp(2, 800);
    let mut last = None;
    for k in 0..=rings {
        let wide = if k % 2 == 0 { 1.0 } else { 1.12 };
        let here = ring(mesh, a.lerp(b, k as f32 / rings as f32), [u, v], radius * wide);
        if let Some(last) = last {
            join(mesh, last, here);
        }
        last = Some(here);
    }
}
