//! Whether a model that says neither its unit nor which way is up was read as it was meant: by the
//! shapes of what its names say. A column that lies, a slab that stands, a beam of 400 m.

use glam::DVec3;

use super::{
    Told,
    build::Built,
    kind::By,
    shape::{Box3, boxed},
    source::Source,
};
use crate::{MemberKind, file::shorten};

/// A member of metres is rarely longer, m.
const LONG: f64 = 50.0;
/// One that is flat may be, where it is so thick, m.
const PLATE: [f64; 2] = [0.05, 1.5];
const LONG_PLATE: f64 = 500.0;
/// Columns and beams are rarely so wide, m.
const THICK: f64 = 8.0;
/// A structure whose longest member is shorter is a model of one, m.
const SHORT: f64 = 0.5;
/// No structure's longest column or beam is shorter, m.
const TINY: f64 = 0.1;
/// So many times longer than the next measure is slender or flat.
const SLENDER: f64 = 2.0;
/// Looks along an axis of the world, by its cosine.
const ALONG: f64 = 0.7;
/// Units of length, m, with what `--unit` calls them.
const UNITS: [(&str, f64); 4] = [("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("ft", 0.3048)];
/// Sizes that people give are multiples of this, m, and these of that share of it by chance alone.
const ROUND: f64 = 0.005;
const CHANCE: f64 = 0.05;
/// Sizes that must speak, and members that are looked at.
const SIZES: usize = 3;
const MOST: usize = 1000;

/// A body by the measures of its box, the least first.
struct Body<'a> {
    name: &'a str,
    kind: MemberKind,
    /// Whether its kind was told by its name, not by how it lies.
    is_named: bool,
    size: [f64; 3],
    unit: [DVec3; 3],
}

impl<'a> Body<'a> {
    fn new(name: &'a str, kind: MemberKind, by: Option<By>, solid: &Box3) -> Self {
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| solid.size[*a].total_cmp(&solid.size[*b]));
        let is_named = by.is_some_and(|by| by != By::Shape);
        let (size, unit) = (order.map(|i| solid.size[i]), order.map(|i| solid.unit[i]));
        Self { name, kind, is_named, size, unit }
    }

    fn is_slender(&self) -> bool {
        self.size[2] > SLENDER * self.size[1]
    }

    fn is_flat(&self) -> bool {
        self.size[1] > SLENDER * self.size[0]
    }

    /// Whether it speaks for y or for z as what is up, and how it lies if that is z.
    fn up(&self) -> Option<(bool, &'static str)> {
        let [y, z] = [DVec3::Y, DVec3::Z].map(|axis| {
            let along = |i: usize| self.unit[i].dot(axis).abs() > ALONG;
            [along(0), along(2)]
        });
        let (of_y, of_z, how) = match self.kind {
            MemberKind::Column if self.is_slender() => (y[1], z[1], "lies along z"),
            MemberKind::Slab | MemberKind::Footing if self.is_flat() => (y[0], z[0], "stands"),
            MemberKind::Wall if self.is_flat() => (z[0], y[0], "lies flat"),
            MemberKind::Beam if self.is_slender() => (z[1], y[1], "stands upright"),
            _ => return None,
        };
        (of_y != of_z).then_some((of_z, how))
    }
}

/// One line for the unit and one for the direction, where they are doubted.
pub(super) fn doubts(source: &Source, built: &Built, told: &Told) -> Vec<String> {
    let solids: Vec<Box3> = built.surfaces.iter().take(MOST).filter_map(boxed).collect();
    let members: Vec<Body> = (built.found.iter().zip(&solids))
        .map(|(found, solid)| Body::new(&found.name, found.kind, Some(found.by), solid))
        .collect();
    let mut doubts = Vec::new();
    if source.format.starts_with("IFC") {
        doubts.extend(of_ifc(&members));
        return doubts;
    }
    if told.up.is_none() {
        doubts.extend(match members.is_empty() {
            true => unnamed_up(source),
            false => up(&members),
        });
    }
    if told.metres.is_none() {
        doubts.extend(unit(&source.format, &members));
    }
    doubts
}

/// Whether most of what names say speaks for z.
fn up(members: &[Body]) -> Option<String> {
    let votes: Vec<(&Body, (bool, &str))> =
        members.iter().filter(|m| m.is_named).filter_map(|m| Some((m, m.up()?))).collect();
    let against: Vec<_> = votes.iter().filter(|(_, (is_z, _))| *is_z).collect();
    let (first, (_, how)) = against.first()?;
    (2 * against.len() > votes.len()).then(|| {
        format!(
            "\"{}\" {how}, as {} of {} members do against their names: is z up in the file? Say --up z, or --up y if it is right",
            shorten(first.name),
            against.len(),
            votes.len()
        )
    })
}

/// The same of a model without names: all that is slender lies along z.
fn unnamed_up(source: &Source) -> Option<String> {
    let of_model = source.elements.iter().filter(|e| e.surface.triangles.len() < 10_000);
    let solids: Vec<(&str, Box3)> =
        of_model.take(MOST).filter_map(|e| Some((e.name.as_str(), boxed(&e.surface)?))).collect();
    let mut slender = solids
        .iter()
        .map(|(name, solid)| Body::new(name, MemberKind::Column, None, solid))
        .filter(Body::is_slender)
        .peekable();
    let first = slender.peek()?.name;
    let all_along_z = slender.all(|body| body.unit[2].dot(DVec3::Z).abs() > ALONG);
    all_along_z.then(|| {
        format!(
            "all that is slender lies along z (\"{}\"): is z up in the file? Say --up z, or --up y if it is right",
            shorten(first)
        )
    })
}

/// IFC says its unit, and which way is up; whether numbers are in that unit nobody says.
fn of_ifc(members: &[Body]) -> Option<String> {
    let bars = |m: &&Body| matches!(m.kind, MemberKind::Column | MemberKind::Beam);
    let all: Vec<&Body> = members.iter().filter(bars).collect();
    let longest = all.iter().max_by(|a, b| a.size[2].total_cmp(&b.size[2]))?;
    let widest = all.iter().max_by(|a, b| a.size[1].total_cmp(&b.size[1]))?;
    let (odd, size) = if longest.size[2] < TINY {
        (longest, format!("{:.3} m long", longest.size[2]))
    } else if widest.size[1] > THICK {
        (widest, format!("{:.3} m wide", widest.size[1]))
    } else {
        return None;
    };
    Some(format!(
        "\"{}\" is {size} in the file's own unit of length: are its numbers in another? Export the model again if so",
        shorten(odd.name)
    ))
}

/// Whether members have sizes that members have in metres.
fn unit(format: &str, members: &[Body]) -> Option<String> {
    let solid = |m: &&Body| {
        use MemberKind::{Bar, Lining, Pipe, Segment, Tendon};
        !matches!(m.kind, Bar | Lining | Pipe | Segment | Tendon)
    };
    let is_plate = |m: &Body| {
        matches!(m.kind, MemberKind::Slab | MemberKind::Wall)
            && m.is_flat()
            && (PLATE[0]..=PLATE[1]).contains(&m.size[0])
    };
    let limit = |m: &Body| if is_plate(m) { LONG_PLATE } else { LONG };
    let all: Vec<&Body> = members.iter().filter(solid).collect();
    let longest = all.iter().max_by(|a, b| a.size[2].total_cmp(&b.size[2]))?;
    let says = if format == "glTF" { "glTF is in metres" } else { "OBJ says no unit" };
    let size = |m: &Body| format!("\"{}\" is {:.2} m long", shorten(m.name), m.size[2]);
    let long = all.iter().filter(|m| m.size[2] >= limit(m));
    if let Some(long) = long.max_by(|a, b| a.size[2].total_cmp(&b.size[2])) {
        let likely: Vec<String> = UNITS
            .iter()
            .filter(|(_, u)| {
                (SHORT..LONG).contains(&(longest.size[2] * u))
                    && (0.08..3.0).contains(&(long.size[0] * u))
            })
            .map(|(name, u)| format!("{name} ({:.2} m)", long.size[2] * u))
            .collect();
        let likely = if likely.is_empty() { "another unit".into() } else { likely.join(" or ") };
        return Some(format!(
            "{}: is the file in {likely}? {says}: say --unit, or --unit m if it is right",
            size(long)
        ));
    }
    let is_thick =
        |m: &&&Body| matches!(m.kind, MemberKind::Column | MemberKind::Beam) && m.size[1] > THICK;
    if let Some(thick) = all.iter().find(is_thick) {
        return Some(format!(
            "\"{}\" is {:.1} m wide: is the file in another unit? {says}: say --unit, or --unit m if it is right",
            shorten(thick.name),
            thick.size[1]
        ));
    }
    if longest.size[2] < SHORT {
        return Some(format!(
            "{}, and no member is longer: was the model scaled down? {says}: say --unit, or --unit m if it is right",
            size(longest)
        ));
    }
    is_in_feet(&all).then(|| {
        format!(
            "{}: sizes are round in feet ({:.3} m) and not in metres: is the file in feet? {says}: say --unit ft, or --unit m if it is right",
            size(longest),
            longest.size[2] * 0.3048
        )
    })
}

/// Whether sizes are round once they are taken for feet, or are whole inches as parts of a foot,
/// and are not as metres.
fn is_in_feet(members: &[&Body]) -> bool {
    let mut sizes: Vec<f64> = members.iter().flat_map(|m| m.size).filter(|s| *s > ROUND).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.dedup_by(|a, b| (*a - *b).abs() < 1e-3);
    let all = |step: f64, scale: f64| {
        let off = |s: &f64| (s * scale / step - (s * scale / step).round()).abs();
        sizes.iter().filter(|s| off(s) < CHANCE).count()
    };
    let in_metres = all(ROUND, 1.0);
    let in_feet = all(ROUND, 0.3048).max(all(1.0 / 12.0, 1.0));
    in_feet == sizes.len()
        && 2 * in_metres < sizes.len()
        && sizes.len() - in_metres >= SIZES.min(sizes.len())
        && sizes.len() >= 2
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(name: &str, kind: MemberKind, size: [f64; 3]) -> Body<'_> {
        let unit = [DVec3::X, DVec3::Y, DVec3::Z];
        Body::new(name, kind, Some(By::Name), &Box3 { centre: DVec3::ZERO, unit, size })
    }

    /// Which way is up, by one member: x, y, z.
    #[test]
    fn what_lies_against_its_name_is_doubted() {
        use MemberKind::{Beam, Column, Footing, Slab, Wall};
        for (kind, size, is_doubted) in [
            (Column, [0.4, 4.0, 0.4], false),
            (Column, [0.4, 0.4, 4.0], true),
            (Column, [4.0, 0.4, 0.4], false),
            (Slab, [6.0, 0.2, 5.0], false),
            (Slab, [6.0, 5.0, 0.2], true),
            (Footing, [2.0, 2.0, 0.6], true),
            (Wall, [4.0, 3.0, 0.3], false),
            (Wall, [4.0, 0.3, 3.0], true),
            (Beam, [8.0, 0.6, 0.3], false),
            (Beam, [0.3, 8.0, 0.6], true),
        ] {
            assert_eq!(up(&[body("it", kind, size)]).is_some(), is_doubted, "{kind:?} {size:?}");
        }
        let sound = || body("C2", Column, [0.4, 4.0, 0.4]);
        assert_eq!(up(&[body("C1", Column, [0.4, 0.4, 4.0]), sound(), sound()]), None);
    }

    /// The same frame in six units: metres alone are believed.
    #[test]
    fn sizes_tell_the_unit() {
        for (name, metres) in [("m", 1.0)].into_iter().chain(UNITS) {
            let size = |s: [f64; 3]| s.map(|s| (s / metres * 1e4).round() / 1e4);
            let members = [
                body("C1", MemberKind::Column, size([0.4, 4.0, 0.4])),
                body("B1", MemberKind::Beam, size([8.0, 0.6, 0.4])),
            ];
            let all: Vec<Body> = members.into_iter().collect();
            let said = unit("OBJ", &all);
            match name {
                "m" => assert_eq!(said, None),
                _ => assert!(said.as_ref().is_some_and(|s| s.contains(name)), "{name}: {said:?}"),
            }
        }
    }

    #[test]
    fn decks_and_tunnels_may_be_long_and_slabs_of_inches_are_not() {
        let one = |kind, size| unit("OBJ", &[body("it", kind, size)]);
        assert_eq!(one(MemberKind::Slab, [12.0, 0.3, 140.0]), None);
        assert_eq!(one(MemberKind::Lining, [6.0, 6.0, 900.0]), None);
        assert!(one(MemberKind::Slab, [240.0, 8.0, 240.0]).is_some());
        assert!(one(MemberKind::Beam, [0.5, 1.2, 51.0]).is_some());
        assert_eq!(one(MemberKind::Beam, [0.5, 1.2, 49.0]), None);
        assert!(one(MemberKind::Column, [0.004, 0.04, 0.004]).is_some());
        // Eight inches thick, sixteen feet four inches long.
        assert!(
            one(MemberKind::Slab, [16.3333, 0.6667, 20.8333]).is_some_and(|s| s.contains("ft"))
        );
    }
}
