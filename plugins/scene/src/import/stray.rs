//! Elements that lie far from all others: markers of an origin, what was left where it was drawn.

use glam::DVec3;

use super::{
    count::listed,
    kind::{Verdict, kind},
    source::Element,
};

/// Elements that no chain of steps of this length leads to are strays, m.
const APART: f64 = 2000.0;

/// Corners of a box.
type Box2 = [DVec3; 2];

/// Takes out what lies far from the structure, and says what that was.
pub(super) fn without_strays(elements: Vec<Element>, notes: &mut Vec<String>) -> Vec<Element> {
    let boxes: Vec<Option<Box2>> = elements.iter().map(bounds).collect();
    let known: Vec<usize> = (0..boxes.len()).filter(|i| boxes[*i].is_some()).collect();
    let at = |i: usize| boxes[i].unwrap_or_default();
    let clusters = apart(known, &at);
    // The structure is where the most members are; of equals, the larger one.
    let weight = |cluster: &Vec<usize>| {
        let own = |i: &&usize| matches!(kind(&elements[**i], None, None), Verdict::Member(..));
        let volume: f64 = cluster.iter().map(|i| elements[*i].surface.volume()).sum();
        (cluster.iter().filter(own).count(), volume)
    };
    let weights: Vec<(usize, f64)> = clusters.iter().map(weight).collect();
    let best = (0..clusters.len()).reduce(|a, b| {
        let order = weights[a].0.cmp(&weights[b].0).then(weights[a].1.total_cmp(&weights[b].1));
        if order.is_ge() { a } else { b }
    });
    let Some(best) = best.filter(|_| clusters.len() > 1) else { return elements };
    let [low, high] = clusters[best]
        .iter()
        .map(|i| at(*i))
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], [a, b]| [l.min(a), h.max(b)]);
    let strays: Vec<usize> =
        (0..clusters.len()).filter(|c| *c != best).flat_map(|c| clusters[c].clone()).collect();
    let away = |i: &usize| {
        let [a, b] = at(*i);
        (low - b).max(a - high).max(DVec3::ZERO).length()
    };
    let farthest = strays.iter().map(away).fold(0.0, f64::max);
    let name = |i: &usize| {
        let element = &elements[*i];
        format!("{} \"{}\"", element.class, crate::file::shorten(&element.name))
            .trim_start()
            .to_owned()
    };
    let names: Vec<String> = strays.iter().map(name).collect();
    let (what, them) = match names.len() {
        1 => ("an element lies".into(), "it is"),
        n => (format!("{n} elements lie"), "they are"),
    };
    notes.push(format!(
        "{what} {:.0} km from the structure: {them} left out ({}); import such elements alone, or move them, where they are meant",
        1e-3 * farthest,
        listed(&names)
    ));
    let strays: std::collections::HashSet<usize> = strays.into_iter().collect();
    let kept = elements.into_iter().enumerate().filter(|(i, _)| !strays.contains(i));
    kept.map(|(_, element)| element).collect()
}

/// The box of what an element shows; none of what came with objects of its own, which stay.
fn bounds(element: &Element) -> Option<Box2> {
    let points = element.courses.iter().flat_map(|c| &c.line).map(|p| [*p, *p]);
    let surface = (!element.surface.is_empty()).then(|| element.surface.bounds());
    let all = points.chain(surface).reduce(|[l, h], [a, b]| [l.min(a), h.max(b)]);
    all.filter(|_| element.objects.is_empty())
}

/// Groups that lie apart along some axis.
fn apart(members: Vec<usize>, at: &impl Fn(usize) -> Box2) -> Vec<Vec<usize>> {
    let mut open = vec![members];
    let mut found = Vec::new();
    while let Some(group) = open.pop() {
        let split = (0..3).map(|axis| along(&group, axis, at)).find(|groups| groups.len() > 1);
        match split {
            Some(groups) => open.extend(groups),
            None if group.is_empty() => {}
            None => found.push(group),
        }
    }
    found
}

fn along(group: &[usize], axis: usize, at: &impl Fn(usize) -> Box2) -> Vec<Vec<usize>> {
    let mut sorted = group.to_vec();
    sorted.sort_by(|a, b| at(*a)[0][axis].total_cmp(&at(*b)[0][axis]));
    let (mut groups, mut end): (Vec<Vec<usize>>, f64) = (Vec::new(), f64::NEG_INFINITY);
    for i in sorted {
        let [low, high] = at(i).map(|p| p[axis]);
        match groups.last_mut() {
            Some(last) if low <= end + APART => last.push(i),
            _ => groups.push(vec![i]),
        }
        end = end.max(high);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::source::Surface;

    fn column(name: &str, class: &str, at: f64) -> Element {
        let mesh = crate::parametric::solid::cells(&[0.0, 0.4], &[0.0, 0.4], |_, _| true, 4.0);
        let points = mesh.positions.iter().map(|p| p.as_dvec3() + at).collect();
        let surface = Surface { points, triangles: mesh.triangles };
        Element { name: name.into(), class: class.into(), surface, ..Element::default() }
    }

    /// A step further each time: what is near stays, what is far goes, whatever comes first.
    #[test]
    fn what_lies_far_off_is_left_out_by_name() {
        for (at, stays) in [(10.0, 2), (1000.0, 2), (1e4, 1), (6e6, 1)] {
            for turned in [false, true] {
                let proxy = column("marker", "IfcBuildingElementProxy", 0.0);
                let mut elements = vec![proxy, column("pier", "IfcColumn", at)];
                if turned {
                    elements.reverse();
                }
                let mut notes = Vec::new();
                let kept = without_strays(elements, &mut notes);
                assert_eq!(kept.len(), stays, "{at}");
                assert!(kept.iter().any(|e| e.name == "pier"));
                assert_eq!(notes.len(), 2 - stays, "{notes:?}");
                assert!(notes.iter().all(|n| n.contains("\"marker\"")), "{notes:?}");
            }
        }
        // A viaduct's piers, each near the next.
        let chain = (0..20).map(|i| column("pier", "IfcColumn", 1000.0 * f64::from(i))).collect();
        assert_eq!(without_strays(chain, &mut Vec::new()).len(), 20);
    }
}
