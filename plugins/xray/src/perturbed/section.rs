//! A member's section as solids, and what is planted in it as faults.

use glam::DVec3;

use super::Fault;
use crate::{
    physics::{Library, Matter, Model, PhysicsError},
    specimen::{
        Shape, Solid, Specimen, Substance,
        concrete::{Crack, GrowError, Outline, RUST, Recipe, STEEL},
    },
};

/// Label of steel; concrete is 0.
const BAR: u8 = 1;
/// Concrete, kg/m³.
const CONCRETE: f64 = 2300.0;
/// Most pieces of steel, of 64 solids.
const PIECES: usize = 62;

/// What a fault is, for people.
#[derive(Debug, Clone, PartialEq)]
pub enum Planted {
    /// A crack so wide, m.
    Crack(f64),
    /// A pore so wide, m.
    Pore(f64),
    /// A bar of a radius (m) that has lost a share of its section.
    Loss(f64, f64),
}

/// Concrete without grains, its bars and stirrups straight from point to point, and the recipe's
/// cracks, a pore of the median size of every stretch of air on the axis, and what bars have lost,
/// as faults of the sound section.
///
/// # Errors
/// Too much steel, or damaged tables.
pub fn section(recipe: &Recipe) -> Result<(Specimen, Vec<(Planted, Fault)>), GrowError> {
    let told = |e: PhysicsError| GrowError::Bad(e.to_string());
    let library = Library::builtin().map_err(told)?;
    let matter = |name| Matter::new(&library, name, Model::Bound).map_err(told);
    let (concrete, steel, mortar) = (matter("concrete")?, matter("steel")?, matter("mortar")?);
    let mut solids = vec![Solid { shape: outline(recipe), label: 0 }];
    let mut faults = Vec::new();
    for bar in &recipe.bars {
        for [base, top] in
            bar.line.windows(2).filter_map(|w| within([w[0], w[1]], 0.5 * recipe.height))
        {
            let shape = Shape::Cylinder { base, top, radius: bar.radius };
            solids.push(Solid { shape, label: BAR });
            if bar.loss > 0.0 {
                // Of rust a share is iron, the rest is like mortar.
                let becomes = vec![
                    (steel.clone(), RUST.0 * RUST.1),
                    (mortar.clone(), RUST.0 * (1.0 - RUST.1)),
                ];
                faults.push((
                    Planted::Loss(bar.radius, bar.loss),
                    Fault { shape, of: Some(BAR), share: bar.loss, becomes },
                ));
            }
        }
    }
    if solids.len() > 1 + PIECES {
        return Err(GrowError::Bad(format!(
            "{} pieces of steel where {PIECES} can be; scan less of the axis",
            solids.len() - 1
        )));
    }
    faults.extend(
        recipe.cracks.iter().map(|crack| (Planted::Crack(crack.width), opening(crack, recipe))),
    );
    for air in &recipe.air {
        let half = DVec3::splat(0.5 * air.median * (std::f64::consts::PI / 6.0).cbrt());
        let middle =
            DVec3::Z * (0.5 * (air.from + air.to)).clamp(-0.2 * recipe.height, 0.2 * recipe.height);
        faults.push((
            Planted::Pore(air.median),
            Fault::void(Shape::Box([middle - half, middle + half])),
        ));
    }
    let substances = vec![
        Substance { material: 0, density: CONCRETE },
        Substance { material: 1, density: STEEL },
    ];
    let specimen = Specimen::solids(vec![concrete, steel], substances, solids)
        .map_err(|e| GrowError::Bad(e.to_string()))?;
    Ok((specimen, faults))
}

/// The part of a line between two heights.
fn within([a, b]: [DVec3; 2], half: f64) -> Option<[DVec3; 2]> {
    let at = |z: f64| ((z - a.z) / (b.z - a.z)).clamp(0.0, 1.0);
    let (from, to) = if (b.z - a.z).abs() > 1e-9 {
        (at(-half).min(at(half)), at(-half).max(at(half)))
    } else {
        (0.0, 1.0)
    };
    let [p, q] = [a + from * (b - a), a + to * (b - a)];
    ((q - p).length() > 1e-6 && p.z.abs() <= half * 1.000_001).then_some([p, q])
}

fn outline(recipe: &Recipe) -> Shape {
    let high = 0.5 * recipe.height;
    match recipe.outline {
        Outline::Round(radius) => {
            Shape::Cylinder { base: DVec3::Z * -high, top: DVec3::Z * high, radius }
        }
        Outline::Rectangle([x, y]) => {
            Shape::Box([DVec3::new(-x, -y, -high), DVec3::new(x, y, high)])
        }
    }
}

/// A crack as the band that it wanders in, roughness to both sides of its mean plane, of which it
/// is a share: no ray runs straight along a real one. A flat box where its plane lies along the
/// axes, else a flat cylinder as wide as the crack is deep.
fn opening(crack: &Crack, recipe: &Recipe) -> Fault {
    let middle = crack.mouth + 0.5 * crack.depth * crack.inward;
    let (along, half) = (crack.normal, 0.5 * crack.width + crack.roughness);
    let shape = if along.abs().max_element() > 0.999 && crack.inward.abs().max_element() > 0.999 {
        let across = along.cross(crack.inward).abs() * recipe.outline.reach();
        let reach = along.abs() * half + crack.inward.abs() * 0.5 * crack.depth + across;
        Shape::Box([middle - reach, middle + reach])
    } else {
        Shape::Cylinder {
            base: middle - half * along,
            top: middle + half * along,
            radius: 0.5 * crack.depth,
        }
    };
    Fault { share: 0.5 * crack.width / half, ..Fault::void(shape) }
}
