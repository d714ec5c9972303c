//! Laps that are shorter than EN 1992-1-1 asks for, and ends that make no difference.

use super::*;

/// γ_c and γ_s (EN 1992-1-1, table 2.1N).
const GAMMA: [f32; 2] = [1.5, 1.15];

/// A place where bars hand on their force to others.
struct Lapped {
    /// Which sets of a member's bars: one that is lapped in itself, twice, or two that overlap.
    sets: [usize; 2],
    /// Its middle on the axis, and from end to end, m.
    at: f32,
    length: f32,
}

/// One line for every lap of a member that is shorter than its l_0 in concrete of this f_ck.
pub(super) fn short_laps(member: &Member, fck_mpa: f32) -> Vec<String> {
    let Some((r, axis)) = member.body.reinforcement().zip(axis_m(&member.body)) else {
        return Vec::new();
    };
    let laps = laps(&r.bars, axis);
    let told = |lap: &Lapped| {
        let (needed, share) = needed(r, lap, &laps, axis, fck_mpa)?;
        let [one, other] = lap.sets;
        let which = match one == other {
            true => format!("bars[{one}] are lapped over"),
            false => format!("bars[{one}] and bars[{other}] overlap by"),
        };
        (lap.length < needed).then(|| {
            format!(
                "member {}: {which} {:.0} mm at {:.2} of its axis; EN 1992-1-1, 8.7.3, asks for {:.0} mm in good bond where {:.0} % of them are lapped at one place: make the lap longer, or lap them apart",
                member.id,
                1e3 * lap.length,
                lap.at / axis,
                1e3 * needed,
                100.0 * share
            )
        })
    };
    laps.iter().filter_map(told).collect()
}

/// Straight ends of bars that do not slip: nobody would see a difference.
pub(super) fn unused_ends(member: &Member) -> Option<String> {
    let r = member.body.reinforcement().filter(|r| r.bond == Bond::Perfect)?;
    let straight = |bars: &Bars| bars.laps().is_empty() && bars.ends().contains(&BarEnd::Straight);
    let set = r.bars.iter().position(straight)?;
    Some(format!(
        "member {}: bars[{set}] end straight, which makes no difference where bars do not slip: give its reinforcement bond: Slip",
        member.id
    ))
}

/// Length of a bar-shaped member's axis, m.
fn axis_m(body: &Body) -> Option<f32> {
    match body {
        Body::Column { height_m, .. } => Some(*height_m),
        Body::Beam { length_m, .. } | Body::BoxGirder { length_m, .. } => Some(*length_m),
        Body::Tunnel { .. } => None,
    }
}

/// Where bars lie across the axis: the side of a row and its layer; none: around.
fn line(bars: &Bars) -> Option<[f32; 2]> {
    match *bars {
        Bars::Row { side_deg, inset_mm, .. } => Some([side_deg, inset_mm]),
        Bars::Around { .. } => None,
    }
}

/// All laps along an axis, m: those that a set has, and those of two sets of equally many bars on
/// one line, of which one ends after the other has begun, as starter bars do.
fn laps(bars: &[Bars], axis: f32) -> Vec<Lapped> {
    let mut all = Vec::new();
    for (i, one) in bars.iter().enumerate() {
        let own =
            |lap: &Lap| Lapped { sets: [i; 2], at: lap.at * axis, length: 1e-3 * lap.length_mm };
        all.extend(one.laps().iter().map(own));
        for (j, next) in bars.iter().enumerate() {
            let [[from, end], [start, to]] = [one.span(), next.span()];
            let later = from < start || (from == start && next.ends()[0] == BarEnd::Straight);
            let alike = line(one) == line(next) && one.size().0 == next.size().0;
            if i != j && alike && later && start < end && end < to {
                let (at, length) = (0.5 * (start + end) * axis, (end - start) * axis);
                all.push(Lapped { sets: [i, j], at, length });
            }
        }
    }
    all
}

/// l_0 of a lap, m, and the share of the bars on its line that are lapped with it. The weaker of
/// its bars counts: more than that has, none hands on. None: of a grade that nobody knows.
fn needed(
    r: &Reinforcement,
    lap: &Lapped,
    laps: &[Lapped],
    axis: f32,
    fck_mpa: f32,
) -> Option<(f32, f32)> {
    let grade = r.grade()?;
    let of = |set: usize| {
        let bars = r.bars.get(set)?;
        let own = match bars {
            Bars::Row { f_y_mpa, .. } => *f_y_mpa,
            Bars::Around { .. } => None,
        };
        Some((1e-3 * bars.size().1, own.unwrap_or(grade.yield_mpa)))
    };
    let [one, other] = [of(lap.sets[0])?, of(lap.sets[1])?];
    let force = |(diameter, f_y): (f32, f32)| diameter * diameter * f_y;
    let (diameter, f_y) = if force(other) < force(one) { other } else { one };
    let anchorage = anchorage(diameter, f_y, fck_mpa);
    // .65 l_0 to both sides, l_0 at its longest.
    let share = share(&r.bars, lap, laps, axis, 0.65 * 1.5 * anchorage)?;
    Some((lap_length(anchorage, diameter, share), share))
}

/// Of the bars on the line of a lap, the share that is lapped within so far (m) of its middle.
fn share(bars: &[Bars], lap: &Lapped, laps: &[Lapped], axis: f32, within: f32) -> Option<f32> {
    let own = line(bars.get(lap.sets[0])?);
    let near =
        |set: usize| laps.iter().any(|l| l.sets.contains(&set) && (l.at - lap.at).abs() <= within);
    let (mut all, mut lapped) = (0.0, 0.0);
    for (i, set) in bars.iter().enumerate().filter(|(_, set)| line(set) == own) {
        let [from, to] = set.span().map(|at| at * axis);
        let is_lapped = near(i);
        if is_lapped || (from..=to).contains(&lap.at) {
            all += set.area();
        }
        lapped += if is_lapped { set.area() } else { 0.0 };
    }
    (all > 0.0).then(|| lapped / all)
}

/// l_b,rqd of a bar that bears its design strength in good bond, m (8.4.2 and 8.4.3): its diameter
/// is in m, f_yk and f_ck in MPa, of which no more than 60 counts.
fn anchorage(diameter: f32, f_yk: f32, fck: f32) -> f32 {
    let tensile = 0.7 * fctm(f64::from(fck.min(60.0))) as f32 / GAMMA[0];
    let bond = 2.25 * ((0.132 - diameter) / 0.1).min(1.0) * tensile;
    0.25 * diameter * f_yk / GAMMA[1] / bond
}

/// l_0, m: 8.7.3 with α₁ to α₅ of 1, which cover, stirrups and pressure across could only lower,
/// and with α₆ by the share of bars that are lapped.
fn lap_length(anchorage: f32, diameter: f32, share: f32) -> f32 {
    let length = (4.0 * share).sqrt().clamp(1.0, 1.5) * anchorage;
    length.max(15.0 * diameter).max(0.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand, C30/37 and B500B: f_ctm = 2.896, f_ctd = 1.352, f_bd = 3.041 MPa; a bar of 20 mm
    /// needs 20/4 · 434.8/3.041 = 715 mm, half as much again where all are lapped, 1.41 times where
    /// half are (table 8.3); one of 40 mm has .92 of the bond; none is lapped over less than 200 mm.
    #[test]
    fn laps_are_as_long_as_by_hand() {
        let long = |diameter: f32, share: f32| {
            1e3 * lap_length(anchorage(diameter, 500.0, 30.0), diameter, share)
        };
        for (diameter, share, mm) in [
            (0.02, 1.0, 1072.4),
            (0.02, 0.5, 1011.1),
            (0.02, 0.2, 714.9),
            (0.04, 0.2, 1554.2),
            (0.005, 0.2, 200.0),
        ] {
            let found = long(diameter, share);
            assert!((found / mm - 1.0).abs() < 1e-3, "{diameter} {share}: {found} for {mm}");
        }
    }

    /// The column that `intrados new column` writes, C30/37, 3 m, with other bars.
    fn told(bars: &str) -> Vec<String> {
        let text = crate::parametric::template("column").unwrap();
        let own = "Around(count: 12, diameter_mm: 20)";
        assert!(text.contains(own));
        let file = parse("column", &text.replace(own, bars)).unwrap();
        short_laps(&file.members[0], 30.0)
    }

    #[test]
    fn a_short_lap_is_told_with_both_lengths() {
        let with = |mm: u32| {
            told(&format!("Around(count: 12, diameter_mm: 20, laps: [(at: 0.5, length_mm: {mm})])"))
        };
        let short = with(600);
        let says = |line: &String| line.contains("over 600 mm at 0.50") && line.contains("1072 mm");
        assert!(matches!(&short[..], [one] if says(one)), "{short:?}");
        assert_eq!(with(1080), Vec::<String>::new());
    }

    /// Of four bars two are lapped here and two a long way off: 1.41 times l_b,rqd.
    #[test]
    fn bars_that_are_lapped_apart_need_less() {
        let lap = |at: f32| {
            format!(
                "Row(side_deg: 0, count: 2, diameter_mm: 12, laps: [(at: {at}, length_mm: 500)])"
            )
        };
        let near = told(&format!("{}, {}", lap(0.3), lap(0.35)));
        assert!(near.len() == 2 && near[0].contains("100 %"), "{near:?}");
        let apart = told(&format!("{}, {}", lap(0.2), lap(0.8)));
        assert!(apart.len() == 2 && apart[0].contains("50 %"), "{apart:?}");
    }

    /// Starter bars of 16 mm under bars of 20 mm: the weaker ones need 858 mm.
    #[test]
    fn starter_bars_are_laps_of_two_sets() {
        let with = |to: f32| {
            told(&format!(
                "Around(count: 12, diameter_mm: 16, to: {to}), Around(count: 12, diameter_mm: 20, from: 0.05)"
            ))
        };
        let short = with(0.25);
        let says = |line: &String| {
            line.contains("bars[0] and bars[1] overlap by 600 mm") && line.contains("858 mm")
        };
        assert!(matches!(&short[..], [one] if says(one)), "{short:?}");
        assert_eq!(with(0.4), Vec::<String>::new());
        // What lies beside a row all the way is none of it.
        let beside = told(
            "Row(side_deg: 0, count: 2, diameter_mm: 20, to: 0.4), Row(side_deg: 0, count: 2, diameter_mm: 20)",
        );
        assert_eq!(beside, Vec::<String>::new());
    }

    #[test]
    fn straight_ends_without_slip_are_told() {
        let text = crate::parametric::template("column").unwrap();
        let told = |ends: &str, bond: &str| {
            let text = text.replace("diameter_mm: 20)", &format!("diameter_mm: 20{ends})"));
            let text = text.replace("cover_mm: 35,", &format!("cover_mm: 35, {bond}"));
            unused_ends(&parse("column", &text).unwrap().members[0])
        };
        assert_eq!(told("", ""), None);
        assert_eq!(told(", ends: (Straight, Straight)", "bond: Slip,"), None);
        assert_eq!(told(", ends: (Hooked, Hooked)", ""), None);
        let line = told(", ends: (Anchored, Straight)", "").unwrap_or_default();
        assert!(line.contains("bars[0] end straight"), "{line}");
    }
}
