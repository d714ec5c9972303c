//! Load tests by command: a weight on a member.

use glam::Vec3;

use crate::{
    Member,
    file::evidence::{Face, Sort},
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
    member: &Member,
    force_kn: f64,
    along: Option<[f32; 2]>,
) -> Result<Action, String> {
    if !(force_kn > 0.0 && force_kn <= MOST_KN) {
        return Err(format!(
            "force_kn: {force_kn} must be above 0 and at most {MOST_KN}: a weight acts downwards, \
             in kN"
        ));
    }
    let place = match Sort::of(member.kind, member.frame) {
        Sort::Lying => {
            let side_deg = Some(Face::Top.angle_deg(member.kind, member.frame)?);
            let [from, to] = stretch(member, along)?;
            Place::Surface { from, to, side_deg }
        }
        Sort::Upright if along.is_some() => {
            let id = &member.id;
            return Err(format!(
                "along: {id} stands, so that the weight is on its head: leave it out"
            ));
        }
        Sort::Upright if member.frame.axis.y < 0.0 => Place::Start,
        Sort::Upright => Place::End,
        Sort::Tunnel => {
            let id = &member.id;
            return Err(format!(
                "{id} is a tunnel or a pipe: write its load test into evidence.ron"
            ));
        }
    };
    Ok(Action::Force { place, force_kn: Vec3::new(0.0, -force_kn as f32, 0.0) })
}

/// From and to on the axis; a place is as long as wheels.
fn stretch(member: &Member, along: Option<[f32; 2]>) -> Result<[f32; 2], String> {
    let Some([from, to]) = along.map(|ends| ends.map(f64::from)) else {
        return Err(format!("along: is missing: say where on {} the weight is, 0 to 1", member.id));
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
