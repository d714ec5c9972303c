//! The furnace (theory §7, "energy"): a closed box whose walls all glow with L_e and reflect ρ has
//! the radiance L = L_e/(1 − ρ) everywhere and in every direction, and the part of order n of its
//! Neumann series (eq. 2.22) is L_e ρⁿ. Whoever loses or makes energy shows it here.

use std::{f64::consts::PI, ops::Range, sync::Arc};

use glam::{Mat4, Vec3};
use intrados_scene::{Camera, Material, Mesh, Meter, Object, Part, Scene, Surface};
use intrados_transport::{
    BATCH, Moments, Side, Tally, TransportProblem, Value, WalkRule, Workspace, run,
};
use rayon::prelude::*;

use crate::{LightProblem, LitScene, Rgb, Sensor};

/// A closed box of Lambert walls, 2 m × 1 m × 1.5 m, with or without something in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Furnace {
    /// ρ, below 1.
    pub albedo: f32,
    /// L_e, W·m⁻²·sr⁻¹.
    pub emission: f32,
    /// A box of .5 m × .4 m × .4 m that hangs in the middle, of a surface with this base colour. If
    /// it neither loses nor makes energy, it cannot be seen.
    pub inside: Option<(Surface, f32)>,
}

impl Furnace {
    /// The scene, with the camera and the meters of [`Furnace::sensors`].
    #[must_use]
    pub fn scene(&self) -> Scene {
        let mut scene = Scene { name: "furnace".into(), ..Scene::default() };
        let walls = Material {
            name: "glowing wall".into(),
            assumed: false,
            base_colour: Vec3::splat(self.albedo),
            emission: Vec3::splat(self.emission),
            ..Material::default()
        };
        add_box(&mut scene, walls, Vec3::ZERO, Vec3::new(2.0, 1.0, 1.5), true);
        if let Some((surface, base)) = &self.inside {
            let hung = Material {
                name: "hung".into(),
                assumed: false,
                surface: surface.clone(),
                base_colour: Vec3::splat(*base),
                ..Material::default()
            };
            add_box(&mut scene, hung, Vec3::new(0.75, 0.3, 0.55), Vec3::new(0.5, 0.4, 0.4), false);
        }
        scene.cameras.push(Camera {
            name: "eye".into(),
            position: Vec3::new(0.3, 0.6, 0.4),
            target: Vec3::new(1.0, 0.5, 0.75),
            up: Vec3::Y,
            fov_deg: 80.0,
            width: 16,
            height: 16,
            exposure: 0.0,
            lens: None,
        });
        let meter = |name: &str, corner, u, v| Meter { name: name.into(), corner, u, v, on: None };
        scene.meters = vec![
            meter("on the floor", Vec3::new(0.9, 0.0, 0.6), Vec3::Z * 0.3, Vec3::X * 0.4),
            meter("in the air", Vec3::new(1.6, 0.2, 0.3), Vec3::Y * 0.5, Vec3::new(0.2, 0.0, 0.5)),
        ];
        scene
    }

    /// The camera, and the meters on the floor and in the air.
    #[must_use]
    pub fn sensors(&self) -> Vec<Sensor> {
        let scene = self.scene();
        scene
            .cameras
            .into_iter()
            .map(Sensor::Camera)
            .chain(scene.meters.into_iter().map(Sensor::Meter))
            .collect()
    }

    /// L = L_e/(1 − ρ), W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn radiance(&self) -> f64 {
        f64::from(self.emission) / (1.0 - f64::from(self.albedo))
    }

    /// The part of order `order`: L_e ρⁿ.
    #[must_use]
    pub fn order(&self, order: u32) -> f64 {
        f64::from(self.emission) * f64::from(self.albedo).powi(order as i32)
    }

    /// What a sensor reads where the radiance is `radiance` all around: itself, or π times it.
    #[must_use]
    pub fn reading(sensor: &Sensor, radiance: f64) -> f64 {
        match sensor {
            Sensor::Camera(_) => radiance,
            Sensor::Meter(_) => PI * radiance,
        }
    }
}

/// A box from `corner` with the edges `size`; its front is inside or outside.
fn add_box(scene: &mut Scene, material: Material, corner: Vec3, size: Vec3, front_inside: bool) {
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    let faces = [
        (corner, z, x),
        (corner + y, x, z),
        (corner, y, z),
        (corner + x, z, y),
        (corner, x, y),
        (corner + z, y, x),
    ];
    let mut mesh = Mesh::default();
    for (p, u, v) in faces {
        let (u, v) = if front_inside { (u, v) } else { (v, u) };
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([p, p + u, p + u + v, p + v]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    scene.objects.push(Object {
        name: material.name.clone(),
        mesh: scene.meshes.len(),
        transform: Mat4::IDENTITY,
        material: scene.materials.len(),
        member: None,
        part: Part::Scenery,
    });
    scene.meshes.push(Arc::new(mesh));
    scene.materials.push(material);
}

/// The scores of walks by order of the Neumann series.
#[derive(Debug, Clone, PartialEq)]
pub struct ByOrder {
    /// All orders together.
    pub all: Moments,
    /// Orders 0, 1, … each by itself.
    pub orders: Vec<Moments>,
}

/// Reads one sensor by walks `walks` from one side, the orders below `orders` apart.
#[must_use]
pub fn by_order(
    lit: &LitScene,
    sensor: &Sensor,
    side: Side,
    rule: &WalkRule,
    seed: u64,
    walks: Range<u64>,
    orders: usize,
) -> ByOrder {
    let sensors = std::slice::from_ref(sensor);
    let problem = LightProblem::new(lit, sensors);
    // A primal walk belongs to one pixel, a dual one may reach any of them.
    let share = if side == Side::Primal { 1.0 } else { 1.0 / problem.bins() as f64 };
    let starts: Vec<u64> = walks.clone().step_by(BATCH as usize).collect();
    let parts: Vec<Sums> = starts
        .into_par_iter()
        .map_init(Workspace::default, |work, first| {
            let batch = first..(first + BATCH).min(walks.end);
            let n = (batch.end - batch.start) as usize;
            let mut sums = Sums { share, all: vec![0.0; n], orders: vec![vec![0.0; n]; orders] };
            run(&problem, side, rule, seed, batch, work, &mut sums);
            sums
        })
        .collect();
    let mut found = ByOrder { all: Moments::default(), orders: vec![Moments::default(); orders] };
    for part in parts {
        part.all.iter().for_each(|&x| found.all.add(x));
        for (moments, scores) in found.orders.iter_mut().zip(&part.orders) {
            scores.iter().for_each(|&x| moments.add(x));
        }
    }
    found
}

struct Sums {
    share: f64,
    all: Vec<f64>,
    orders: Vec<Vec<f64>>,
}

impl Tally<Rgb> for Sums {
    fn score(&mut self, walk: u32, _: u32, order: u32, value: Rgb) {
        let x = value.reading() * self.share;
        self.all[walk as usize] += x;
        if let Some(scores) = self.orders.get_mut(order as usize) {
            scores[walk as usize] += x;
        }
    }
}
