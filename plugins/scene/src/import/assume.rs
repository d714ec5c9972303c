//! What nobody has stated, by rules that the project's README repeats. None of them replaces a
//! drawing.

use super::source::{Course, Surface};
use crate::{
    Frame, MemberKind, Part,
    file::Assumed,
    parametric,
    structure::{ASSUMED_CONCRETE, Bars, Grade, Reinforcement, Stirrups, fctm},
};

/// Steel of bars where nothing is said of it.
pub(super) const STEEL: &str = "B500B";
/// How long a member has been exposed where no year is known, years.
pub(super) const YEARS: f32 = 30.0;

/// Classes by the year of building. A rule of this program, and of no code: what was ordinary in
/// bridges and buildings of those years in Central Europe, by the lower of the usual classes. Error
/// bars take it so (`damage`'s forecast).
const BY_YEAR: [(i32, &str); 3] = [(1950, "C12/15"), (1972, "C20/25"), (2001, "C25/30")];

/// The class of a member that was built in that year.
#[must_use]
pub fn concrete(year: Option<i32>) -> &'static str {
    let Some(year) = year else { return ASSUMED_CONCRETE };
    BY_YEAR.iter().find(|(until, _)| year < *until).map_or(ASSUMED_CONCRETE, |(_, class)| class)
}

/// What attacks a member out of doors of which nothing is said: carbonation, by EN 206's examples
/// (wet and dry in turn; footings mostly wet).
pub(super) fn exposure(kind: MemberKind) -> &'static str {
    if kind == MemberKind::Footing { "XC2" } else { "XC4" }
}

/// Nominal cover of EN 1992-1-1, mm: c_min,dur of table 4.4N for structural class S4, at least 10,
/// and Δc_dev = 10 (§4.4.1.2, §4.4.1.3). Of several classes the one that asks for most.
pub(super) fn cover_mm(exposure: &str) -> f32 {
    let durable = |class: &str| match class {
        "X0" => 10.0,
        "XC1" => 15.0,
        "XC2" | "XC3" => 25.0,
        "XC4" => 30.0,
        "XD1" | "XS1" => 35.0,
        "XD2" | "XS2" => 40.0,
        "XD3" | "XS3" => 45.0,
        // Frost and chemical attack ask for a better concrete, not for more of it.
        _ => 0.0,
    };
    let classes = exposure.split(|c: char| !c.is_ascii_alphanumeric());
    classes.map(durable).fold(10.0, f32::max) + 10.0
}

/// A member's measures, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Measures {
    pub(super) kind: MemberKind,
    /// Along its axis.
    pub(super) length: f64,
    /// Across: towards angle 0 and towards angle 90.
    pub(super) across: [f64; 2],
    pub(super) is_round: bool,
    /// Of its section.
    pub(super) area: f64,
}

/// Diameters of bars that are made, mm (EN 10080).
const DIAMETERS: [f64; 10] = [8.0, 10.0, 12.0, 14.0, 16.0, 20.0, 25.0, 28.0, 32.0, 40.0];
/// Least distance between bars that concrete comes through (§8.2 asks for less), m.
const TIGHT: f64 = 0.08;

/// Bars of one diameter, no further apart than `most` over `width` and no thinner than `least`, mm,
/// that have the area together, m².
fn bars(area: f64, width: f64, most: f64, least: f64) -> (u32, f32) {
    let fewest = ((width / most).ceil() + 1.0).max(2.0);
    let room = (width / TIGHT).floor().max(2.0);
    let mut found = (fewest, 40.0);
    for diameter in DIAMETERS.into_iter().filter(|d| *d >= least) {
        let one = std::f64::consts::FRAC_PI_4 * (diameter * 1e-3).powi(2);
        found = (fewest.max((area / one).ceil()), diameter);
        if found.0 <= room {
            break;
        }
    }
    (found.0.min(1000.0) as u32, found.1 as f32)
}

/// The least reinforcement of EN 1992-1-1 for a member, none of one that has no room for it.
///
/// - columns (§9.5.2): .002 A_c, a bar in each corner, at most 400 mm apart; links of §9.5.3
/// - piles and round footings (§9.8.5, table 9.6N): .005 A_c, 25 cm², .0025 A_c; six bars of 16 mm
/// - beams (§9.2.1.1): .26 f_ctm/f_yk b d, at least .0013 b d, below and above; links of §9.2.2,
///   .08 √f_ck/f_yk
/// - slabs and footings (§9.3.1.1): the same at both faces, at most 3 h or 400 mm apart; 20 % of it
///   across
/// - walls (§9.6): .002 A_c upright, half at each face, at most 3 t or 400 mm apart; .001 A_c level
pub(super) fn reinforcement(m: &Measures, fck: f64, cover_mm: f32) -> Option<Reinforcement> {
    let grade = Grade::named(STEEL)?;
    let fyk = f64::from(grade.yield_mpa);
    let cover = f64::from(cover_mm) * 1e-3;
    let [depth, width] = m.across;
    let thin = depth.min(width);
    if thin < 2.0 * cover + 0.03 || m.length < 4.0 * cover || m.area <= 0.0 {
        return None;
    }
    let tension = (0.26 * fctm(fck) / fyk).max(0.0013);
    let (bars, stirrups) = match m.kind {
        MemberKind::Footing if m.is_round => {
            let area = match m.area {
                a if a <= 0.5 => 0.005 * a,
                a if a <= 1.0 => 0.0025,
                a => 0.0025 * a,
            };
            around(area, 6, 16.0, std::f64::consts::PI * (thin - 2.0 * cover))
        }
        MemberKind::Column | MemberKind::Other | MemberKind::Pipe => {
            let fewest = if m.is_round { 6 } else { 4 };
            around(0.002 * m.area, fewest, 8.0, 2.0 * (depth + width - 4.0 * cover))
        }
        MemberKind::Wall => wall(m, cover),
        _ => flat(m, cover, tension, fck, fyk),
    };
    let (diameter, spacing) = stirrups;
    Some(Reinforcement {
        cover_mm,
        steel: STEEL.into(),
        f_y_mpa: None,
        bars,
        stirrups: Some(Stirrups { diameter_mm: diameter, spacing_mm: spacing, f_y_mpa: None }),
        bond: Default::default(),
    })
}

type Laid = (Vec<Bars>, (f32, f32));

/// Bars around a section, and links of §9.5.3: at least 6 mm and a quarter of the bar, at most 20
/// bars' diameters or 400 mm apart.
fn around(area: f64, fewest: u32, least: f64, way: f64) -> Laid {
    let (count, diameter_mm) = bars(area, way, 0.4, least);
    let link = (0.25 * diameter_mm).max(6.0);
    (vec![Bars::around(count.max(fewest), diameter_mm)], (link, (20.0 * diameter_mm).min(400.0)))
}

fn wall(m: &Measures, cover: f64) -> Laid {
    let [depth, width] = m.across;
    let (thick, wide, sides) =
        if depth <= width { (depth, width, [0.0, 180.0]) } else { (width, depth, [90.0, 270.0]) };
    let apart = (3.0 * thick).min(0.4);
    let (count, diameter_mm) = bars(0.001 * m.area, wide - 2.0 * cover, apart, 8.0);
    let rows = sides.map(|side_deg| Bars::row(side_deg, count, diameter_mm));
    // Level bars: a hoop has one at each face.
    let per_metre = 0.0005 * thick;
    (rows.to_vec(), hoops(per_metre, 0.4))
}

/// Beams, slabs and all that lies: bars below and above; what runs across are the links.
fn flat(m: &Measures, cover: f64, tension: f64, fck: f64, fyk: f64) -> Laid {
    let [depth, width] = m.across;
    let d = depth - cover - 0.02;
    let area = tension * width * d;
    let is_beam = width < 5.0 * depth && !matches!(m.kind, MemberKind::Slab | MemberKind::Footing);
    let apart = if is_beam { 0.3 } else { (3.0 * depth).min(0.4) };
    // 9.8.2.1: 8 mm in footings.
    let least = if is_beam { 10.0 } else { 8.0 };
    let (count, diameter_mm) = bars(area, width - 2.0 * cover, apart, least);
    let rows = [180.0, 0.0].map(|side_deg| Bars::row(side_deg, count, diameter_mm)).to_vec();
    let across = if is_beam {
        // Two legs of each link.
        0.5 * 0.08 * fck.sqrt() / fyk * width
    } else {
        0.2 * tension * d
    };
    let most = if is_beam { (0.75 * d).min(0.4) } else { (3.5 * depth).min(0.45) };
    (rows, hoops(across, most))
}

/// Diameter and spacing, mm, of hoops of which one leg has the area per metre, m²/m, at most so
/// many metres apart.
fn hoops(per_metre: f64, most: f64) -> (f32, f32) {
    let area = |diameter: f64| std::f64::consts::FRAC_PI_4 * (diameter * 1e-3).powi(2);
    let fits = |diameter: &f64| area(*diameter) / per_metre >= 0.1;
    let diameter = DIAMETERS.into_iter().find(fits).unwrap_or(40.0);
    let spacing = (area(diameter) / per_metre).min(most);
    // Down to whole centimetres, as they are drawn.
    (diameter as f32, ((100.0 * spacing).floor() * 10.0).max(20.0) as f32)
}

/// Weight of reinforced concrete, N/m³ (EN 1991-1-1, table A.1).
const WEIGHT: f64 = 25e3;

/// Area of the bars below that are assumed, and the area that the member's own weight needs between
/// two supports at its ends, m²: M = ρ g A l² / 8 on .9 d at the yield stress. `None`: they carry
/// it, or the member does not lie on two supports.
pub(super) fn own_weight(m: &Measures, r: &Reinforcement) -> Option<[f64; 2]> {
    let spans = matches!(m.kind, MemberKind::Beam | MemberKind::Slab | MemberKind::Other);
    let grade = Grade::named(&r.steel).filter(|_| spans)?;
    let below = r.bars.iter().find(|b| matches!(b, Bars::Row { side_deg: 180.0, .. }))?;
    let moment = WEIGHT * m.area * m.length * m.length / 8.0;
    let d = m.across[0] - f64::from(r.cover_mm) * 1e-3 - 0.02;
    let need = moment / (0.9 * d.max(0.01) * 1e6 * f64::from(grade.yield_mpa));
    let have = f64::from(below.area());
    (need > have).then_some([have, need])
}

/// The least share of the length of its bars and stirrups that must lie in a member.
const INSIDE: f64 = 0.7;
/// Lines and points of each that are looked at.
const LINES: usize = 60;
const POINTS: usize = 9;

/// Whether a straight cage about a member's axis lies in its concrete: those of an arch, and of a
/// ring's segment, whose section is bent, do not.
pub(super) fn fits(reinforcement: &Reinforcement, frame: Frame, surface: &Surface) -> bool {
    let triangles: Vec<parametric::Triangle> =
        surface.faces().map(|t| t.map(|p| p.as_vec3())).collect();
    let lines = parametric::lines_in(frame, &triangles, reinforcement);
    let mut bars = lines.iter().filter(|line| line.part == Part::Bar).peekable();
    // Bent ones leave the cubes that a member is computed as for less than a step, and are refused.
    if bars.peek().is_none() || bars.any(|bar| bar.line.len() > 2) {
        return false;
    }
    let [mut all, mut within] = [0.0; 2];
    for line in lines.iter().step_by(lines.len().div_ceil(LINES).max(1)) {
        let line = line.line.iter().map(|p| p.as_dvec3()).collect();
        let course = Course { diameter: 0.0, line };
        let samples = course.samples(POINTS);
        let share = samples.iter().filter(|p| surface.holds(**p)).count() as f64
            / samples.len().max(1) as f64;
        all += course.length();
        within += course.length() * share;
    }
    within >= INSIDE * all
}

/// What of a member was assumed, in the words of a scene.
pub(super) fn listed(assumed: &[Assumed]) -> String {
    assumed.iter().map(|a| format!("{a:?}")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn member(kind: MemberKind, length: f64, across: [f64; 2]) -> Measures {
        Measures { kind, length, across, is_round: false, area: across[0] * across[1] }
    }

    fn area(bars: &Bars) -> f64 {
        f64::from(bars.area())
    }

    #[test]
    fn cover_is_that_of_table_4_4n_and_ten_more() {
        assert_eq!(
            ["X0", "XC1", "XC2", "XC4", "XC4, XD3, XF4"].map(cover_mm),
            [20.0, 25.0, 35.0, 40.0, 55.0]
        );
    }

    #[test]
    fn classes_follow_the_year() {
        let years = [None, Some(1930), Some(1965), Some(1985), Some(2010)];
        assert_eq!(years.map(concrete), ["C30/37", "C12/15", "C20/25", "C25/30", "C30/37"]);
    }

    /// By hand, C30/37: f_ctm = 2.896 MPa, .26 f_ctm/f_yk = 1.506 ‰; a beam of .3 × .6 m with 40 mm
    /// of cover has d = .54 m, A_s,min = 2.44 cm².
    #[test]
    fn a_beam_has_its_least_bars_and_links() {
        let r = reinforcement(&member(MemberKind::Beam, 6.0, [0.6, 0.3]), 30.0, 40.0).unwrap();
        let below = area(&r.bars[0]);
        assert!((2.44e-4..4.9e-4).contains(&below), "{below} {r:?}");
        let s = r.stirrups.unwrap();
        // ρ_w = A_sw / (s b) ≥ .08 √30 / 500 = .876 ‰
        let legs = 2.0 * std::f32::consts::FRAC_PI_4 * s.diameter_mm.powi(2);
        assert!(legs / (s.spacing_mm * 300.0) >= 0.876e-3 && s.spacing_mm <= 400.0, "{s:?}");
    }

    /// By hand: a beam of .3 × .6 m weighs 4.5 kN/m; over 6 m M = 20 kNm needs .84 cm², and it has
    /// 2.44 or more; over 20 m 225 kNm need 9.3 cm².
    #[test]
    fn least_bars_carry_a_short_beam_and_no_long_one() {
        let of = |length: f64| {
            let m = member(MemberKind::Beam, length, [0.6, 0.3]);
            own_weight(&m, &reinforcement(&m, 30.0, 40.0).unwrap())
        };
        assert_eq!(of(6.0), None);
        let [have, need] = of(20.0).unwrap();
        assert!((need - 9.26e-4).abs() < 0.1e-4 && have < need, "{have} {need}");
        let carried: Vec<bool> = (2..40).map(|l| of(f64::from(l)).is_none()).collect();
        assert!(carried.windows(2).all(|w| w[0] || !w[1]), "{carried:?}");
    }

    #[test]
    fn columns_and_walls_have_two_per_mille() {
        let column =
            reinforcement(&member(MemberKind::Column, 4.0, [0.5, 0.5]), 30.0, 40.0).unwrap();
        assert!(area(&column.bars[0]) >= 0.002 * 0.25, "{column:?}");
        let wall = reinforcement(&member(MemberKind::Wall, 3.0, [0.25, 5.0]), 30.0, 40.0).unwrap();
        let upright: f64 = wall.bars.iter().map(area).sum();
        assert!((0.002 * 1.25..0.004 * 1.25).contains(&upright), "{upright} {wall:?}");
        assert!(matches!(wall.bars[0], Bars::Row { side_deg: 0.0, .. }));
        assert_eq!(reinforcement(&member(MemberKind::Slab, 3.0, [0.056, 5.0]), 30.0, 40.0), None);
    }
}
