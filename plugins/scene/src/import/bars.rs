//! Bars, links and tendons: what each is, how thick, and how it is stressed.

use serde_json::Value;

use super::{
    quantity::{Guess, only_plausible},
    source::{Course, Element},
};
use crate::{
    Part,
    structure::{Prestress, StrandGrade},
};

/// Diameters of bars, m.
const DIAMETERS: std::ops::RangeInclusive<f64> = 3e-3..=0.08;

/// A number of the class' attributes, in SI units.
fn number(element: &Element, name: &str) -> Option<f64> {
    element.attributes.get(name).and_then(Value::as_f64).filter(|n| *n > 0.0)
}

/// The same number as the file has it.
fn raw(element: &Element, name: &str) -> Option<f64> {
    let own = element.attributes.get("raw").and_then(|raw| raw.get(name));
    own.and_then(Value::as_f64).filter(|n| *n > 0.0)
}

/// Whether a bar is a link: by its role (IFC2X3's BarRole, later its predefined type), its name, or
/// because it comes back to where it began, hooks aside.
pub(super) fn is_link(element: &Element, course: &Course) -> bool {
    const ROLES: [&str; 5] = ["LIGATURE", "STIRRUP", "SHEAR", "PUNCHING", "RING"];
    let role = element.attributes.get("BarRole").and_then(Value::as_str).unwrap_or_default();
    let says = [element.predefined.as_str(), role];
    if says.iter().any(|role| ROLES.contains(role)) {
        return true;
    }
    if says.contains(&"MAIN") {
        return course.line.first() == course.line.last() && course.line.len() > 2;
    }
    let names = element.words.iter().chain([&element.name]).map(|n| n.to_lowercase());
    let words = ["stirrup", "ligature", "bügel", "buegel", "étrier", "estribo", "staffa"];
    names.into_iter().any(|name| words.iter().any(|word| name.contains(word)))
        || element.said.as_ref().is_some_and(|s| s.part == Part::Stirrup)
        || is_loop(course)
}

/// Whether the first quarter of a bar comes to its last quarter, and its middle stays away.
fn is_loop(course: &Course) -> bool {
    let near = 3.0 * course.diameter;
    let total = course.length();
    let mut way = 0.0;
    let mut points = vec![];
    for (i, point) in course.line.iter().enumerate() {
        if i > 0 {
            way += point.distance(course.line[i - 1]);
        }
        points.push((way / total.max(1e-9), *point));
    }
    let begins = || points.iter().filter(|(share, _)| *share < 0.25);
    let ends = || points.iter().filter(|(share, _)| *share > 0.75);
    let meets = |a: &glam::DVec3| ends().any(|(_, b)| a.distance(*b) < near);
    begins().any(|(_, a)| {
        meets(a) && points.iter().any(|(_, b)| a.distance(*b) > 2.0 * near && total > 8.0 * near)
    })
}

/// The diameter of a bar, m: as it is drawn, as its attribute says, and as its area says; two
/// against one. The sentence says that they disagree.
pub(super) fn diameter(element: &Element, course: &Course) -> (f64, Option<String>) {
    let drawn = course.diameter;
    let said = |name: &str| number(element, name).map(|d| believed(d, raw(element, name)));
    let of_mesh = ["LongitudinalBarNominalDiameter", "TransverseBarNominalDiameter"];
    let nearest = of_mesh
        .iter()
        .filter_map(|name| said(name))
        .min_by(|a, b| (a - drawn).abs().total_cmp(&(b - drawn).abs()));
    let nominal = said("NominalDiameter").or(nearest).filter(|d| DIAMETERS.contains(d));
    let area = number(element, "CrossSectionArea")
        .map(|area| (4.0 * area / std::f64::consts::PI).sqrt())
        .filter(|d| DIAMETERS.contains(d));
    let mm = |d: f64| ((1e4 * d).round() / 10.0).to_string();
    match (nominal, area) {
        // Ribs are drawn, too; a tube of few corners is thinner.
        (Some(nominal), _) if (0.93..=1.2).contains(&(drawn / nominal)) => (nominal, None),
        (Some(nominal), Some(area)) if (drawn / area - 1.0).abs() < 0.05 => (
            drawn,
            Some(format!(
                "its nominal diameter is {} mm, it is drawn with {} mm, which its area confirms: that is taken",
                mm(nominal),
                mm(drawn)
            )),
        ),
        (Some(nominal), _) => (
            nominal,
            Some(format!(
                "its nominal diameter is {} mm, and it is drawn with {} mm: the nominal one is taken",
                mm(nominal),
                mm(drawn)
            )),
        ),
        (None, Some(area)) if !(0.8..=1.25).contains(&(drawn / area)) => (
            drawn,
            Some(format!(
                "it is drawn with {} mm, and its area is that of {} mm: what is drawn is taken",
                mm(drawn),
                mm(area)
            )),
        ),
        _ => (drawn, None),
    }
}

/// A diameter in m; in mm where only that can be meant.
fn believed(metres: f64, raw: Option<f64>) -> f64 {
    let units = [("mm", 1e-3), ("m", 1.0)];
    match raw.map(|raw| only_plausible(raw, &units, &DIAMETERS)) {
        Some(Guess::Only(d, _)) if !DIAMETERS.contains(&metres) => d,
        _ => metres,
    }
}

/// Stresses that tendons are stressed to, MPa.
const STRESSES: std::ops::RangeInclusive<f64> = 100.0..=2000.0;

/// How a tendon is stressed, as far as it is said: area and stress of the class' attributes, else
/// .75 f_pk after stressing (EN 1992-1-1, 5.10.3) on strands that fill .35 of the duct. The
/// sentences say what was doubted.
pub(super) fn prestress(element: &Element, course: &Course) -> (Prestress, Vec<String>) {
    let mut doubts = Vec::new();
    let named = element.attributes.get("SteelGrade").and_then(Value::as_str);
    let grade = named.and_then(StrandGrade::named).or_else(|| StrandGrade::named("Y1860S7"));
    let steel = grade.map_or("Y1860S7", |g| g.name);
    let duct = 1e6 * std::f64::consts::FRAC_PI_4 * course.diameter * course.diameter;
    let area_mm2 = area(element, duct, &mut doubts);
    let strands = (area_mm2 / 140.0).round().clamp(1.0, 100.0);
    let usual = 0.75 * grade.map_or(1860.0, |g| f64::from(g.strength_mpa));
    let by_stress = stress(
        element,
        "PreStress",
        1e-6,
        [("Pa", 1e-6), ("kPa", 1e-3), ("MPa", 1.0)],
        &mut doubts,
    );
    let per_area = 1.0 / area_mm2;
    let units = [("N", per_area), ("kN", 1e3 * per_area), ("MN", 1e6 * per_area)];
    let by_force = stress(element, "TensionForce", per_area, units, &mut doubts);
    if let (Some(stress), Some(force)) = (by_stress, by_force)
        && (stress / force - 1.0).abs() > 0.1
    {
        doubts.push(format!(
            "its stress is {stress:.0} MPa, and its force on its area comes to {force:.0} MPa: the stress is taken"
        ));
    }
    let known = by_stress.or(by_force);
    if known.is_none() {
        doubts.push(format!(
            "neither its force nor its stress is known: .75 f_pk, {usual:.0} MPa, is assumed"
        ));
    }
    let friction = number(element, "FrictionCoefficient").filter(|f| (0.0..0.6).contains(f));
    let slip = number(element, "AnchorageSlip").filter(|s| (0.0..0.02).contains(s));
    let prestress = Prestress {
        steel: steel.into(),
        strands: strands as u32,
        strand_mm2: (area_mm2 / strands) as f32,
        stress_mpa: known.unwrap_or(usual) as f32,
        at_days: 0.0,
        friction: friction.unwrap_or(0.19) as f32,
        wobble_per_m: 0.005,
        slip_mm: 1e3 * slip.unwrap_or(0.005) as f32,
        relaxation_class: 2,
        both_ends: false,
        bonded: true,
        plate_mm: None,
    };
    (prestress, doubts)
}

/// Area of the steel, mm²: it fits into the duct.
fn area(element: &Element, duct_mm2: f64, doubts: &mut Vec<String>) -> f64 {
    const NAME: &str = "CrossSectionArea";
    let fits = 7.0..=1.05 * duct_mm2.max(20.0);
    let Some(said) = number(element, NAME).map(|area| 1e6 * area) else {
        doubts.push(format!(
            "its area is not said: .35 of what is drawn, {:.0} mm², is assumed",
            0.35 * duct_mm2
        ));
        return 0.35 * duct_mm2;
    };
    if fits.contains(&said) {
        return said;
    }
    let units = [("mm²", 1.0), ("cm²", 100.0), ("m²", 1e6)];
    let raw = raw(element, NAME).unwrap_or(said);
    match only_plausible(raw, &units, &fits) {
        Guess::Only(area, unit) => {
            doubts.push(format!(
                "its area is {said} mm² in the file's unit, which does not fit into {duct_mm2:.0} mm²: {raw} {unit} is taken"
            ));
            area
        }
        Guess::No => {
            doubts.push(format!(
                "its area, {said} mm², does not fit into {duct_mm2:.0} mm²: .35 of that is assumed"
            ));
            0.35 * duct_mm2
        }
    }
}

/// Stress by an attribute, MPa: `factor` is that of its SI unit, `units` what else it may be in.
fn stress(
    element: &Element,
    name: &str,
    factor: f64,
    units: [(&'static str, f64); 3],
    doubts: &mut Vec<String>,
) -> Option<f64> {
    let said = factor * number(element, name)?;
    if STRESSES.contains(&said) {
        return Some(said);
    }
    let raw = raw(element, name)?;
    match only_plausible(raw, &units, &STRESSES) {
        Guess::Only(mpa, unit) => {
            doubts.push(format!(
                "its {name} is {raw} in the file, {said:.3} MPa: {raw} {unit}, {mpa:.0} MPa, is taken"
            ));
            Some(mpa)
        }
        Guess::No => {
            doubts.push(format!(
                "its {name} is {raw} in the file, {said:.3} MPa, which no tendon is stressed to: it is not used"
            ));
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use serde_json::json;

    use super::*;

    fn bar(attributes: &Value) -> Element {
        let fields = attributes.as_object().cloned().unwrap_or_default();
        Element {
            class: "IfcReinforcingBar".into(),
            attributes: fields.into_iter().collect(),
            ..Element::default()
        }
    }

    fn course(line: &[[f64; 3]], diameter: f64) -> Course {
        Course { diameter, line: line.iter().map(|p| DVec3::from_array(*p)).collect() }
    }

    #[test]
    fn links_are_told_from_bars() {
        let hooked = [
            [0.16, 0.0, 0.08],
            [0.16, 0.0, 0.16],
            [-0.16, 0.0, 0.16],
            [-0.16, 0.0, -0.16],
            [0.16, 0.0, -0.16],
            [0.16, 0.0, 0.16],
            [0.08, 0.0, 0.16],
        ];
        let loop_ = course(&hooked, 0.008);
        let straight = course(&[[0.0; 3], [0.0, 4.0, 0.0]], 0.02);
        // A bar with a hook at either end, and an open U.
        let hooks =
            course(&[[0.1, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.1, 4.0, 0.0]], 0.02);
        let open = course(&[[0.0, 0.5, 0.0], [0.0; 3], [0.3, 0.0, 0.0], [0.3, 0.5, 0.0]], 0.01);
        let plain = bar(&json!({}));
        assert!(is_link(&plain, &loop_));
        for line in [&straight, &hooks, &open] {
            assert!(!is_link(&plain, line));
        }
        for role in ["LIGATURE", "SHEAR", "RING"] {
            assert!(is_link(&bar(&json!({ "BarRole": role })), &open), "{role}");
            let later = Element { predefined: role.into(), ..plain.clone() };
            assert!(is_link(&later, &open), "{role}");
        }
        assert!(!is_link(&bar(&json!({"BarRole": "MAIN"})), &straight));
    }

    #[test]
    fn two_diameters_outvote_one() {
        let of = |attributes: Value, drawn: f64| {
            let (d, doubt) =
                diameter(&bar(&attributes), &course(&[[0.0; 3], [0.0, 4.0, 0.0]], drawn));
            ((1e4 * d).round() / 10.0, doubt.is_some())
        };
        assert_eq!(of(json!({"NominalDiameter": 0.02}), 0.02), (20.0, false));
        assert_eq!(of(json!({"NominalDiameter": 0.02}), 0.023), (20.0, false));
        assert_eq!(of(json!({"NominalDiameter": 0.025}), 0.02), (25.0, true));
        let three = json!({"NominalDiameter": 0.025, "CrossSectionArea": 314e-6});
        assert_eq!(of(three, 0.02), (20.0, true));
        let in_mm = json!({"NominalDiameter": 20.0, "raw": {"NominalDiameter": 20.0}});
        assert_eq!(of(in_mm, 0.02), (20.0, false));
        assert_eq!(of(json!({"CrossSectionArea": 314e-6}), 0.01), (10.0, true));
        assert_eq!(of(json!({}), 0.012), (12.0, false));
    }

    #[test]
    fn tendons_are_stressed_as_they_say() {
        let of = |attributes: Value| {
            let course = course(&[[0.0; 3], [20.0, 0.0, 0.0]], 0.08);
            let (stress, doubts) = prestress(&bar(&attributes), &course);
            (
                stress.stress_mpa.round(),
                (stress.strand_mm2 * stress.strands as f32).round(),
                doubts.len(),
            )
        };
        let both = |area: f64, force: f64, raw_area: f64, raw_force: f64| {
            json!({
                "CrossSectionArea": area, "TensionForce": force,
                "raw": {"CrossSectionArea": raw_area, "TensionForce": raw_force},
            })
        };
        assert_eq!(of(both(1800e-6, 2.34e6, 1800.0, 2340.0)), (1300.0, 1800.0, 0));
        // A file without a unit of force, in kN; one in mm with areas in mm² that says m².
        assert_eq!(of(both(1800e-6, 2340.0, 1800e-6, 2340.0)), (1300.0, 1800.0, 1));
        assert_eq!(of(both(1800.0, 2.34e6, 1800.0, 2.34e6)), (1300.0, 1800.0, 1));
        assert_eq!(of(both(1800e-6, 9e9, 1800e-6, 9e9)), (1395.0, 1800.0, 2));
        assert_eq!(of(json!({"CrossSectionArea": 1800e-6})), (1395.0, 1800.0, 1));
        let twice = json!({"CrossSectionArea": 1800e-6, "PreStress": 1.2e9, "TensionForce": 1e6});
        assert_eq!(of(twice), (1200.0, 1800.0, 1));
    }
}
