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

/// Of concrete with its bars, N/m³.
const WEIGHT: f64 = 25e3;

/// What assumed bars come to under what surely acts.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Carrying {
    /// The least carry it.
    Least,
    /// They do not, and these below do.
    More(Bars),
    /// No bars do in this section.
    Nothing,
}

/// Whether the least bars below carry a member's own weight and `imposed`, N/m², over a span as a
/// simple beam, w l²/8 against A_s f_yk .9 d; else those that EN 1992-1-1 asks for, 1.35 of weight
/// and 1.5 of the rest against A_s f_yd .9 d, as long as concrete bears it without bars above:
/// M ≤ .167 f_ck b d², which is x = .45 d with f_cd = .85 f_ck / 1.5.
pub(super) fn carrying(
    m: &Measures,
    least: &Reinforcement,
    span: f64,
    fck: f64,
    imposed: f64,
) -> Carrying {
    let grade = least.grade();
    let fyk = grade.map_or(500e6, |g| 1e6 * f64::from(g.yield_mpa));
    let [depth, width] = m.across;
    let cover = 1e-3 * f64::from(least.cover_mm);
    let d = depth - cover - 0.02;
    let below = least.bars.iter().find(|b| matches!(b, Bars::Row { side_deg: 180.0, .. }));
    let area = below.map_or(0.0, |b| f64::from(b.area()));
    let moment = |weight: f64, rest: f64| {
        (weight * WEIGHT * m.area + rest * imposed * width) * span * span / 8.0
    };
    if d <= 0.0 || moment(1.0, 1.0) <= area * fyk * 0.9 * d {
        return Carrying::Least;
    }
    let designed = moment(1.35, 1.5);
    let needed = designed / (0.9 * d * fyk / 1.15);
    if designed > 0.167e6 * fck * width * d * d {
        return Carrying::Nothing;
    }
    let is_beam = width < 5.0 * depth && m.kind != MemberKind::Slab;
    let apart = if is_beam { 0.3 } else { (3.0 * depth).min(0.4) };
    let (count, diameter_mm) = bars(needed, width - 2.0 * cover, apart, 12.0);
    let row = Bars::row(180.0, count, diameter_mm);
    if f64::from(row.area()) < 0.999 * needed { Carrying::Nothing } else { Carrying::More(row) }
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

    /// By hand: a beam of .3 × .6 m weighs 4.5 kN/m. Over 6 m its least bars (4.9 cm² at most) carry
    /// 20 kNm; over 16 m they do not carry 144 kNm, and 1.35 · 144 kNm against 434.8 MPa · .9 · .54 m
    /// take 9.2 cm². Over 60 m no bars do: 1.35 · 2025 kNm are more than .167 · 30 MPa b d², 438 kNm.
    #[test]
    fn bars_carry_their_members_or_are_told_not_to() {
        let beam = member(MemberKind::Beam, 6.0, [0.6, 0.3]);
        let least = reinforcement(&beam, 30.0, 40.0).unwrap();
        let over = |span: f64, imposed: f64| carrying(&beam, &least, span, 30.0, imposed);
        assert_eq!(over(6.0, 0.0), Carrying::Least);
        match over(16.0, 0.0) {
            Carrying::More(row) => {
                let needed = 1.35 * 144e3 / (0.9 * 0.54 * 434.8e6);
                assert!((needed..1.3 * needed).contains(&area(&row)), "{row:?} for {needed}");
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(over(60.0, 0.0), Carrying::Nothing);
        // What people say that it carries counts, too: from least to most it asks for more.
        let rank = |answer: Carrying| match answer {
            Carrying::Least => 0.0,
            Carrying::More(row) => 1.0 + area(&row),
            Carrying::Nothing => f64::INFINITY,
        };
        let ranks = [0.0, 10e3, 20e3, 40e3, 80e3, 1e6].map(|imposed| rank(over(10.0, imposed)));
        assert!(ranks.windows(2).all(|w| w[0] <= w[1]) && ranks[5].is_infinite(), "{ranks:?}");
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
