//! What counts once: a whole and its parts that both have bodies, and members that lie twice at one
//! place.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use glam::DVec3;

use super::{
    kind::{By, Verdict},
    ring::Piece,
    source::Surface,
};

/// Members whose boxes, volumes and centres differ by no more are one, m.
const SAME: f64 = 5e-3;
/// And by no more of their volume.
const SAME_SHARE: f64 = 0.01;
/// Share of two boxes' union in both beyond which one may be the other, drawn again.
const MOST: f64 = 0.8;
/// A body that fills so much of its box is one, and lies in another if so much of it does.
const MOST_OF_PART: f64 = 0.9;
/// Members that are compared, each with each.
const COMPARED: usize = 4000;
/// So far a part may stand out of its whole, m.
const OUT: f64 = 0.02;
/// Points of a part that are looked for in its whole.
const SAMPLES: usize = 12;

/// Takes out what would be counted twice, and says so.
pub(super) fn once(mut pieces: Vec<Piece>, notes: &mut Vec<String>) -> Vec<Piece> {
    let mut gone = parts(&pieces, notes);
    gone.extend(copies(&pieces, &gone, notes));
    let mut index = 0;
    pieces.retain(|_| {
        index += 1;
        !gone.contains(&(index - 1))
    });
    pieces
}

fn is_member(piece: &Piece) -> bool {
    matches!(piece.verdict, Verdict::Member(..)) && !piece.element.surface.is_empty()
}

/// What stands for its parts rather than being made of them: assemblies and parts in space.
fn stands_for_parts(class: &str) -> bool {
    class == "IfcElementAssembly" || class.ends_with("Part") && class != "IfcBuildingElementPart"
}

/// The parts of wholes that have bodies, and assemblies whose parts have: by the index of what does
/// not count.
fn parts(pieces: &[Piece], notes: &mut Vec<String>) -> BTreeSet<usize> {
    let known: HashMap<&str, usize> = (pieces.iter().enumerate())
        .filter(|(_, p)| is_member(p))
        .map(|(i, p)| (p.element.id.as_str(), i))
        .collect();
    let mut of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (i, piece) in pieces.iter().enumerate().filter(|(_, p)| is_member(p)) {
        let named = piece.element.above.iter().filter(|a| !a.id.is_empty());
        let above = named.filter_map(|a| known.get(a.id.as_str()));
        above.filter(|w| **w != i).for_each(|w| of.entry(*w).or_default().push(i));
    }
    let (mut gone, mut wholes, mut assemblies) = (BTreeSet::new(), Vec::new(), Vec::new());
    for (whole, members) in of {
        let surface = &pieces[whole].element.surface;
        let inside: Vec<usize> =
            members.into_iter().filter(|i| lies_in(&pieces[*i].element.surface, surface)).collect();
        let volume: f64 = inside.iter().map(|i| pieces[*i].element.surface.volume()).sum();
        if inside.is_empty() || gone.contains(&whole) {
            continue;
        }
        let name = format!("\"{}\"", crate::file::shorten(&pieces[whole].element.name));
        if stands_for_parts(&pieces[whole].element.class) && volume > 0.5 * surface.volume() {
            gone.insert(whole);
            assemblies.push(name);
        } else {
            wholes.push(format!("{name} of {}", inside.len()));
            gone.extend(inside);
        }
    }
    if !wholes.is_empty() {
        notes.push(format!(
            "wholes and their parts have bodies at one place: the wholes count, their parts do not ({})",
            listed(&wholes)
        ));
    }
    if !assemblies.is_empty() {
        notes.push(format!(
            "assemblies and their parts have bodies at one place: the parts count, the assemblies do not ({})",
            listed(&assemblies)
        ));
    }
    gone
}

/// Whether most of a part lies in a whole.
fn lies_in(part: &Surface, whole: &Surface) -> bool {
    let ([low, high], [l, h]) = (part.bounds(), whole.bounds());
    if !((low + OUT).cmpge(l).all() && (high - OUT).cmple(h).all()) {
        return false;
    }
    let middle = centre(part);
    let step = (part.triangles.len() / SAMPLES).max(1);
    let points: Vec<DVec3> = (part.faces().step_by(step).take(SAMPLES))
        .map(|[a, b, c]| ((a + b + c) / 3.0).lerp(middle, 0.1))
        .collect();
    2 * points.iter().filter(|p| whole.holds(**p)).count() >= points.len()
}

/// Centre of a surface's area.
fn centre(surface: &Surface) -> DVec3 {
    let (sum, area) = surface.faces().fold((DVec3::ZERO, 0.0), |(sum, area), [a, b, c]| {
        let own = 0.5 * (b - a).cross(c - a).length();
        (sum + own * (a + b + c) / 3.0, area + own)
    });
    if area > 0.0 { sum / area } else { DVec3::ZERO }
}

/// A member's box, volume and centre.
struct Place {
    index: usize,
    bounds: [DVec3; 2],
    volume: f64,
    centre: DVec3,
}

/// Members that lie where another lies, by index; the better known one stays. Of what nearly does,
/// a doubt is said.
fn copies(pieces: &[Piece], gone: &BTreeSet<usize>, notes: &mut Vec<String>) -> Vec<usize> {
    let place = |(index, piece): (usize, &Piece)| {
        let surface = &piece.element.surface;
        let (bounds, volume) = (surface.bounds(), surface.volume());
        Place { index, bounds, volume, centre: centre(surface) }
    };
    let mut places: Vec<Place> = (pieces.iter().enumerate())
        .filter(|(i, p)| is_member(p) && !gone.contains(i) && p.element.objects.is_empty())
        .map(place)
        .collect();
    // Those whose kind is best known come first, and stay.
    let by = |p: &Place| match pieces[p.index].verdict {
        Verdict::Member(_, by) => by,
        _ => By::Shape,
    };
    places.sort_by_key(|p| (by(p), p.index));
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    let (mut twice, mut lost, mut near) = (Vec::new(), HashSet::new(), Vec::new());
    for (k, place) in places.iter().enumerate() {
        let cell = place.centre.floor().to_array().map(|x| x as i64);
        let others = neighbours(cell).filter_map(|c| cells.get(&c)).flatten().map(|&i| &places[i]);
        let mut like = None;
        let mut is_copy = false;
        for other in others {
            is_copy = is_same(place, other);
            if is_copy || (like.is_none() && shared(place, other) > MOST) {
                like = Some(other.index);
            }
            if is_copy {
                break;
            }
        }
        let names = |other: usize| {
            let name = |i: usize| crate::file::shorten(&pieces[i].element.name);
            format!("\"{}\" and \"{}\"", name(other), name(place.index))
        };
        match like {
            Some(other) if is_copy => {
                lost.insert(place.index);
                twice.push(names(other));
                continue;
            }
            Some(other) => near.push(names(other)),
            None => {}
        }
        cells.entry(cell).or_default().push(k);
    }
    notes.extend(within(pieces, &places, &lost));
    if !twice.is_empty() {
        let what = match twice.len() {
            1 => "a member lies twice at one place and counts once".to_owned(),
            n => format!("{n} members lie twice at one place and count once"),
        };
        notes.push(format!("{what} ({})", listed(&twice)));
    }
    if !near.is_empty() {
        notes.push(format!(
            "members lie nearly at one place: is it one, drawn twice? both count ({}); take one out of the model if it is",
            listed(&near)
        ));
    }
    lost.into_iter().collect()
}

/// Members most of which lies in another, which both fill their boxes: a column over all storeys beside
/// its storeys, a core beside what it is the core of. Of more than [`COMPARED`] nobody looks.
fn within(pieces: &[Piece], places: &[Place], lost: &HashSet<usize>) -> Option<String> {
    let places: Vec<&Place> = places.iter().filter(|p| !lost.contains(&p.index)).collect();
    if places.len() > COMPARED {
        return None;
    }
    let name = |p: &Place| crate::file::shorten(&pieces[p.index].element.name);
    let mut found: Vec<(f64, String)> = Vec::new();
    for (k, one) in places.iter().enumerate() {
        for other in &places[..k] {
            let [small, large] =
                if one.volume < other.volume { [one, other] } else { [other, one] };
            if shared(one, other) <= MOST && inside(small, large) > MOST_OF_PART {
                let pair = format!("\"{}\" in \"{}\"", name(small), name(large));
                found.push((small.volume, pair));
            }
        }
    }
    let volume: f64 = found.iter().map(|f| f.0).sum();
    let pairs: Vec<String> = found.into_iter().map(|f| f.1).collect();
    (!pairs.is_empty()).then(|| {
        format!(
            "members lie within others ({}): are {volume:.2} m³ counted twice? Both count; take one out of the model if they are",
            listed(&pairs)
        )
    })
}

/// Share of the smaller box that lies in the larger, where both bodies fill most of theirs.
fn inside(small: &Place, large: &Place) -> f64 {
    let [own, other] = [box_volume(small.bounds), box_volume(large.bounds)];
    if small.volume < MOST_OF_PART * own || large.volume < MOST_OF_PART * other {
        return 0.0;
    }
    box_volume(common(small, large)) / own.max(1e-12)
}

fn box_volume([low, high]: [DVec3; 2]) -> f64 {
    (high - low).max(DVec3::ZERO).element_product()
}

/// The box that lies in both boxes.
fn common(a: &Place, b: &Place) -> [DVec3; 2] {
    [a.bounds[0].max(b.bounds[0]), a.bounds[1].min(b.bounds[1])]
}

fn neighbours(cell: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |k| {
        let step = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
        std::array::from_fn(|i| cell[i].saturating_add(step[i]))
    })
}

fn is_same(a: &Place, b: &Place) -> bool {
    a.centre.distance(b.centre) < SAME
        && (0..2).all(|i| a.bounds[i].distance(b.bounds[i]) < SAME)
        && (a.volume - b.volume).abs() <= SAME_SHARE * a.volume.max(b.volume)
}

/// Share of the union of two boxes that lies in both, where both fill most of theirs.
fn shared(a: &Place, b: &Place) -> f64 {
    let both = box_volume(common(a, b));
    let [first, second] = [box_volume(a.bounds), box_volume(b.bounds)];
    if a.volume < 0.5 * first || b.volume < 0.5 * second {
        return 0.0;
    }
    both / (first + second - both).max(1e-12)
}

/// The first three, and how many more.
pub(super) fn listed(names: &[String]) -> String {
    let more = match names.len() {
        0..=3 => String::new(),
        n => format!(" and {} more", n - 3),
    };
    names.iter().take(3).cloned().collect::<Vec<_>>().join(", ") + &more
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        MemberKind,
        import::source::{Above, Element},
        parametric::solid,
    };

    /// A box of a width, length and height whose lowest corner lies at a place.
    fn piece(id: &str, class: &str, above: &str, at: [f64; 3], size: [f32; 3]) -> Piece {
        let [x, y, z] = size;
        let mesh = solid::cells(&[0.0, x], &[0.0, y], |_, _| true, z);
        let low = mesh.positions.iter().fold(glam::Vec3::INFINITY, |l, p| l.min(*p));
        let points = mesh.positions.iter().map(|p| (*p - low).as_dvec3() + DVec3::from(at));
        let surface = Surface { points: points.collect(), triangles: mesh.triangles.clone() };
        let of = Above { class: String::new(), name: String::new(), id: above.into() };
        let element = Element {
            id: id.into(),
            name: id.into(),
            class: class.into(),
            above: vec![of],
            surface,
            ..Element::default()
        };
        let verdict = Verdict::Member(MemberKind::Beam, By::Class);
        Piece { element, verdict, tube: None, segments: Vec::new() }
    }

    fn left(pieces: Vec<Piece>) -> (Vec<String>, Vec<String>) {
        let mut notes = Vec::new();
        let kept = once(pieces, &mut notes);
        (kept.into_iter().map(|p| p.element.id).collect(), notes)
    }

    #[test]
    fn a_whole_counts_and_its_parts_do_not() {
        let part = |id, z| piece(id, "IfcBuildingElementPart", "w", [0.0, 0.0, z], [0.4, 0.6, 4.0]);
        let whole = |class| piece("w", class, "", [0.0; 3], [0.4, 0.6, 8.0]);
        let (kept, notes) = left(vec![whole("IfcBeam"), part("a", 0.0), part("b", 4.0)]);
        assert_eq!(kept, ["w"]);
        assert!(notes[0].contains("\"w\" of 2"), "{notes:?}");
        // What stands for its parts goes; what lies outside of its whole stays.
        let parts = [part("a", 0.0), part("b", 4.0), part("c", 8.0)];
        let all = std::iter::once(whole("IfcElementAssembly")).chain(parts).collect();
        assert_eq!(left(all).0, ["a", "b", "c"]);
        let (kept, _) = left(vec![whole("IfcBeam"), part("c", 8.0)]);
        assert_eq!(kept, ["w", "c"]);
    }

    /// A step apart each time: the same, nearly the same, two.
    #[test]
    fn what_lies_at_one_place_counts_once() {
        for (step, count, doubts) in [(0.0, 1, 1), (0.002, 1, 1), (0.02, 2, 1), (0.5, 2, 0)] {
            let pieces = [0.0, step].map(|x| piece("c", "IfcColumn", "", [x, 0.0, 0.0], [0.4; 3]));
            let (kept, notes) = left(pieces.into());
            assert_eq!((kept.len(), notes.len()), (count, doubts), "{step}: {notes:?}");
        }
        // A wedge and the wedge that makes a box of it are two.
        let mut pieces = [0.0, 0.0].map(|x| piece("w", "IfcBeam", "", [x; 3], [0.4; 3]));
        for (k, piece) in pieces.iter_mut().enumerate() {
            for p in &mut piece.element.surface.points {
                let slope = if k == 0 { p.x } else { 0.4 - p.x };
                p.y = if p.y > 0.2 { slope } else { p.y };
            }
        }
        assert_eq!(left(pieces.into()).0.len(), 2);
    }
}
