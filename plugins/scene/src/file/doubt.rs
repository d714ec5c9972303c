//! What can be computed as it is written, and is probably not meant.

use std::f32::consts::TAU;

use super::*;

/// Share of a section beyond which bars are rarely meant, outside of laps (EN 1992-1-1, 9.2.1.1 and
/// 9.5.2).
const MUCH_STEEL: f32 = 0.04;

/// One line for everything that a scene probably does not mean. What is wrong for certain,
/// [`check`] lists.
#[must_use]
pub fn doubts(scene: &SceneFile) -> Vec<String> {
    let mut doubts = Vec::new();
    for member in &scene.members {
        if let Some(share) = member.body.steel_share().filter(|&share| share > MUCH_STEEL) {
            doubts.push(format!(
                "member {}: bars fill {:.1} % of its section; EN 1992-1-1 allows {:.0} % outside of laps: check their number and diameter",
                member.id,
                100.0 * share,
                100.0 * MUCH_STEEL
            ));
        }
    }
    for load in &scene.loads {
        let bear = |m: &&Member| load.members.is_empty() || load.members.contains(&m.id);
        let factor = load.history.iter().map(|h| h.1.abs()).reduce(f32::max).unwrap_or(1.0);
        let worst = scene
            .members
            .iter()
            .filter(bear)
            .filter_map(|m| Some((m, factor * times(scene, m, &load.action)?)));
        if let Some((member, times)) =
            worst.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, times)| *times > 1.0)
        {
            doubts.push(format!(
                "load {}: {times:.1} times what crushes the section of member {}: kN, kN/m or kPa are meant, not N or Pa",
                load.name, member.id
            ));
        }
    }
    doubts
}

/// An action over what crushes the member's section, A_c f_cm + A_s f_y, whatever its direction:
/// across the axis it breaks at less. None: not of a kind that could be told by that.
fn times(scene: &SceneFile, member: &Member, action: &Action) -> Option<f32> {
    let strength_mpa = strength(scene, member);
    let (area, length) = match &member.body {
        Body::Column { height_m, .. } => (member.body.section_area()?, *height_m),
        Body::Beam { length_m, .. } | Body::BoxGirder { length_m, .. } => {
            (member.body.section_area()?, *length_m)
        }
        Body::Tunnel { radius_m, length_m, inner_lining, segments, .. } => {
            let thick = inner_lining.as_ref().map_or(0.0, |l| l.thickness_m)
                + segments.as_ref().map_or(0.0, |s| s.thickness_m);
            (TAU * radius_m * thick, *length_m)
        }
    };
    let bars = member
        .body
        .reinforcement()
        .map_or(0.0, |r| r.area() * r.grade().map_or(0.0, |g| g.yield_mpa));
    let squash_kn = 1e3 * (area * strength_mpa + bars);
    match action {
        Action::Force { force_kn, .. } => Some(force_kn.length() / squash_kn),
        Action::Line { from, to, force_kn_m } => {
            Some(force_kn_m.length() * (to - from) * length / squash_kn)
        }
        Action::Pressure { pressure_kpa, .. } | Action::InnerPressure { pressure_kpa } => {
            Some(pressure_kpa.abs() / (1e3 * strength_mpa))
        }
        Action::SelfWeight
        | Action::Displacement { .. }
        | Action::Air { .. }
        | Action::Temperature { .. } => None,
    }
}

/// Mean strength of a member's concrete, f_ck + 8 MPa (EN 1992-1-1, table 3.1), MPa.
fn strength(scene: &SceneFile, member: &Member) -> f32 {
    let name = member.concrete.as_deref().unwrap_or(ASSUMED_CONCRETE);
    let own = scene.concretes.iter().find(|c| c.name == name).map(|c| c.fck_mpa);
    8.0 + own.or_else(|| concrete_class(name)).unwrap_or(30.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The column that `intrados new column` writes, with some words replaced.
    fn doubts_with(from: &str, to: &str) -> Vec<String> {
        let text = crate::parametric::template("column").unwrap();
        assert!(text.contains(from), "{from}");
        doubts(&parse("column", &text.replace(from, to)).unwrap())
    }

    #[test]
    fn newtons_for_kilonewtons_and_too_much_steel_are_doubted() {
        assert_eq!(doubts_with("count: 12", "count: 12"), Vec::<String>::new());
        let newtons = doubts_with("-1600,", "-1600000,");
        assert!(
            matches!(&newtons[..], [one] if one.contains("load from above: 200.") && one.contains("C1")),
            "{newtons:?}"
        );
        let steel = doubts_with("count: 12", "count: 24");
        assert!(matches!(&steel[..], [one] if one.contains("4.7 %")), "{steel:?}");
    }
}
