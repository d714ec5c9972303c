//! What can be computed as it is written, and is probably not meant.

mod bars;
mod unloaded;

use std::f32::consts::TAU;

use super::*;

pub(crate) use unloaded::unloaded;

/// Share of a section beyond which bars are rarely meant, outside of laps (EN 1992-1-1, 9.2.1.1 and
/// 9.5.2).
const MUCH_STEEL: f32 = 0.04;

/// Strength classes of EN 206, table 12, and the two that BS 8500-1 adds.
pub(crate) const CLASSES: [&str; 18] = [
    "C8/10", "C12/15", "C16/20", "C20/25", "C25/30", "C28/35", "C30/37", "C32/40", "C35/45",
    "C40/50", "C45/55", "C50/60", "C55/67", "C60/75", "C70/85", "C80/95", "C90/105", "C100/115",
];

/// One line for everything that a scene probably does not mean. What is wrong for certain,
/// [`check`] lists. `as_one`: whether what nothing holds is carried by others.
#[must_use]
pub(crate) fn doubts(scene: &SceneFile, as_one: bool) -> Vec<String> {
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
    doubts.extend(scene.members.iter().flat_map(|m| bars::short_laps(m, fck(scene, m))));
    doubts.extend(scene.members.iter().filter_map(bars::unused_ends));
    doubts.extend(scene.members.iter().filter_map(no_class));
    if !as_one {
        doubts.extend(scene.members.iter().filter_map(|member| unheld(scene, member)));
    }
    doubts.extend(scene.details.iter().filter_map(|detail| unattacked(scene, detail)));
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

/// A class that is in no standard: its strength is believed, but was another one meant?
fn no_class(member: &Member) -> Option<String> {
    let name = member.concrete.as_deref().filter(|n| !CLASSES.contains(n))?;
    let fck = concrete_class(name)?;
    let off = |class: &&str| concrete_class(class).map_or(f32::MAX, |other| (other - fck).abs());
    let nearest = CLASSES.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
    Some(format!(
        "member {}: {name} is no class of EN 206: {nearest} may be meant; it is computed with {fck} MPa",
        member.id
    ))
}

/// A member that carries loads and that nothing holds: neither its stress nor its life can be
/// computed. (A tunnel is held by its ground, and what is joined by what it is joined to.)
fn unheld(scene: &SceneFile, member: &Member) -> Option<String> {
    let carries =
        scene.loads.iter().any(|l| l.members.is_empty() || l.members.contains(&member.id));
    let held = scene.supports.iter().any(|s| s.member == member.id);
    let in_ground = matches!(member.body, Body::Tunnel { .. });
    let joined = scene.joints.iter().any(|j| j.of.0 == member.id || j.of.1 == member.id);
    (carries && !held && !in_ground && !joined).then(|| {
        format!(
            "member {}: nothing holds it, so that neither its stress nor its life is computed: add a support such as (member: \"{}\", place: Start, hold: Fixed)",
            member.id, member.id
        )
    })
}

/// A segment with bars of its own and an exposure of its own: the ring is computed under one.
fn unattacked(scene: &SceneFile, detail: &Detail) -> Option<String> {
    detail.exposure.as_ref()?;
    let id = &detail.member;
    let tunnel = check::tunnel_of(scene, id)?;
    let Body::Tunnel { segments: Some(segments), .. } = &tunnel.body else { return None };
    segments.reinforcement.as_ref()?;
    Some(format!(
        "details of {id}: its bars rust by the exposure of the whole tunnel, {}; its own is not computed",
        tunnel.exposure.as_ref().map_or("which has none", |e| e.class.as_str())
    ))
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
        | Action::PipeTemperature { .. }
        | Action::Temperature { .. } => None,
    }
}

/// Mean strength of a member's concrete, f_ck + 8 MPa (EN 1992-1-1, table 3.1), MPa.
fn strength(scene: &SceneFile, member: &Member) -> f32 {
    8.0 + fck(scene, member)
}

/// Characteristic strength of a member's concrete, MPa.
fn fck(scene: &SceneFile, member: &Member) -> f32 {
    let name = member.concrete.as_deref().unwrap_or(ASSUMED_CONCRETE);
    let own = scene.concretes.iter().find(|c| c.name == name).map(|c| c.fck_mpa);
    own.or_else(|| concrete_class(name)).unwrap_or(30.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The column that `intrados new column` writes, with some words replaced.
    fn doubts_with(from: &str, to: &str) -> Vec<String> {
        let text = crate::parametric::template("column").unwrap();
        assert!(text.contains(from), "{from}");
        doubts(&parse("column", &text.replace(from, to)).unwrap(), false)
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

    #[test]
    fn a_class_of_no_standard_and_a_member_in_the_air_are_doubted() {
        let class = doubts_with("C30/37", "C33/40");
        assert!(
            matches!(&class[..], [one] if one.contains("C33/40") && one.contains("C32/40 may be")),
            "{class:?}"
        );
        let air = doubts_with("(member: \"C1\", place: Start, hold: Fixed)", "");
        assert!(matches!(&air[..], [one] if one.contains("nothing holds it")), "{air:?}");
    }
}
