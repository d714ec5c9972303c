//! Load tests by command: a weight on a member.

use glam::Vec3;

use crate::{
    Member, Scene,
    file::{
        concrete_class,
        evidence::{Face, Sort},
    },
    structure::{Action, Place},
};

/// Most that is put on a member in a test, kN.
const MOST_KN: f64 = 1e5;
/// What wheels at one place cover, as a share of the axis (ours).
const WHEELS: f64 = 0.05;

/// A weight on a member as it acts: on the top of what lies, on the head of what stands.
///
/// # Errors
/// What was given does not fit: one line without the file.
pub(super) fn weight(
    scene: &Scene,
    index: usize,
    force_kn: f64,
    along: Option<[f32; 2]>,
) -> Result<Action, String> {
    let member = &scene.members[index];
    if !(force_kn > 0.0 && force_kn <= MOST_KN) {
        return Err(format!(
            "force_kn: {force_kn} must be above 0 and at most {MOST_KN}: a weight acts downwards, \
             in kN"
        ));
    }
    if let Some(most) = crushing_kn(scene, member).filter(|most| force_kn > *most) {
        return Err(format!(
            "force_kn: {force_kn} kN is more than crushes the whole section of {}, {most:.0} kN: \
             is it in N? write {}",
            name(member),
            force_kn / 1000.0
        ));
    }
    let place = match Sort::of(member.kind, member.frame) {
        Sort::Lying => {
            let side = Face::Top.angle_deg(member.kind, member.frame);
            let side_deg = Some(side.map_err(|why| why.to_string())?);
            let [from, to] = stretch(member, along)?;
            Place::Surface { from, to, side_deg }
        }
        Sort::Upright if along.is_some() => {
            let id = name(member);
            return Err(format!(
                "along: {id} stands, so that the weight is on its head: leave it out"
            ));
        }
        Sort::Upright if member.frame.axis.y < 0.0 => Place::Start,
        Sort::Upright => Place::End,
        Sort::Tunnel => {
            let id = name(member);
            return Err(format!(
                "{id} is a tunnel or a pipe: write its load test into evidence.ron"
            ));
        }
    };
    Ok(Action::Force { place, force_kn: Vec3::new(0.0, -force_kn as f32, 0.0) })
}

/// What crushes the mean section of a member, its volume over its length, at the mean strength of
/// its concrete, f_ck + 8 MPa (EN 1992-1-1, table 3.1), kN. None: its surface is open.
fn crushing_kn(scene: &Scene, member: &Member) -> Option<f64> {
    let own = scene.structure.concrete(&member.concrete).map(|c| c.fck_mpa);
    let fck = own.or_else(|| concrete_class(&member.concrete)).unwrap_or(30.0);
    let area = member.volume / f64::from(member.frame.axis.length());
    (area > 0.0 && area.is_finite()).then(|| 1e3 * area * (f64::from(fck) + 8.0))
}

/// A member as people call it.
fn name(member: &Member) -> &str {
    if member.name.is_empty() { &member.id } else { &member.name }
}

/// From and to on the axis; a place is as long as wheels.
fn stretch(member: &Member, along: Option<[f32; 2]>) -> Result<[f32; 2], String> {
    let Some([from, to]) = along.map(|ends| ends.map(f64::from)) else {
        return Err(format!(
            "along: is missing: say where on {} the weight is, 0 to 1",
            name(member)
        ));
    };
    if !((0.0..=1.0).contains(&from) && (0.0..=1.0).contains(&to)) {
        let other = if (0.0..=1.0).contains(&from) { to } else { from };
        return Err(format!(
            "along: {other} is outside 0 to 1: it is a share of the axis, not metres or per cent"
        ));
    }
    if from > to {
        return Err(format!("along: ends at {to}, before it begins at {from}: turn them round"));
    }
    let half = if from < to { 0.0 } else { 0.5 * WHEELS };
    // Ends as people write them.
    let round = |at: f64| ((at.clamp(0.0, 1.0) * 1e4).round() / 1e4) as f32;
    Ok([round(from - half), round(to + half)])
}
