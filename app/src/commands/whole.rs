//! `intrados analyze --whole`: reactions and end forces of all members of a scene, as one frame.

use intrados_mechanics::frame::{FrameError, Redundancy, SectionForces, Whole, whole};
use intrados_scene::Scene;
use intrados_stage::time::DAY;

use crate::{failure::Failure, output, session::Session};

/// N in a kilonewton, Pa in a megapascal.
const KILO: f64 = 1e3;
const MPA: f64 = 1e6;

/// Computes the whole of a scene.
pub(super) fn computed(
    session: &Session,
    scene: &Scene,
    redundancy: bool,
) -> Result<Whole, Failure> {
    let _progress = session.watch("the whole structure");
    let found = whole(scene, redundancy, &session.job)?;
    for (id, why) in &found.left_out {
        tracing::warn!("{} is no part of the whole: {why}", scene.name_of(id));
    }
    if let [first, ..] = &found.hanging[..] {
        tracing::warn!(
            "{} members hang in the air, {} the first: join them in joints of the scene, or hold them by supports",
            found.hanging.len(),
            scene.name_of(first)
        );
    }
    Ok(found)
}

/// Reactions, end forces and joints, for people.
pub(super) fn table(whole: &Whole, scene: &Scene) -> String {
    let name = |id: &str| scene.name_of(id).to_owned();
    let mut text = reactions(whole, &name);
    text.push('\n');
    text += &ends(whole, &name);
    let pulled = whole.joints.iter().filter(|j| j.pressure_n.is_some_and(|p| p < 0.0));
    for [a, b] in pulled.map(|j| j.of.each_ref().map(|id| name(id))) {
        text += &format!("{a} pulls at {b}: a bearing lifts off\n");
    }
    if !whole.redundancy.is_empty() {
        text.push('\n');
        text += &redundancy(whole, &name);
    }
    for id in &whole.hanging {
        text += &format!("{} hangs in the air: nothing holds it\n", name(id));
    }
    for (id, why) in &whole.left_out {
        text += &format!("{} is left out: {why}\n", name(id));
    }
    whole.notes.iter().for_each(|n| text += &format!("note: {n}\n"));
    text += &format!(
        "{} unknowns, {} beams, {} plates; loads and reactions leave {:.1e} of the loads\n",
        whole.unknowns, whole.beams, whole.plates, whole.unbalanced
    );
    text
}

fn kilo(values: [f64; 3]) -> impl Iterator<Item = String> {
    values.into_iter().map(|v| format!("{:.1}", v / KILO))
}

fn reactions(whole: &Whole, name: &dyn Fn(&str) -> String) -> String {
    let head = ["ground holds", "F_x kN", "F_y kN", "F_z kN", "M_x kNm", "M_y kNm", "M_z kNm"];
    let mut rows = vec![head.map(String::from).to_vec()];
    let mut sum = [0.0; 3];
    for r in &whole.reactions {
        sum.iter_mut().zip(r.force_n).for_each(|(s, f)| *s += f);
        let cells = [name(&r.member)].into_iter();
        rows.push(cells.chain(kilo(r.force_n)).chain(kilo(r.moment_nm)).collect());
    }
    rows.push(["in all".to_owned()].into_iter().chain(kilo(sum)).collect());
    output::table(&rows)
}

fn ends(whole: &Whole, name: &dyn Fn(&str) -> String) -> String {
    let head = [
        "member", "day", "end", "N kN", "V_y kN", "V_z kN", "T kNm", "M_y kNm", "M_z kNm",
        "edge MPa",
    ];
    let mut rows = vec![head.map(String::from).to_vec()];
    let last = whole.times_s.len() - 1;
    for member in &whole.members {
        let edge = format!("{:.2}", member.peak_edge_stress_pa / MPA);
        let Some(both) = member.ends.get(last) else {
            let mut row = vec![String::new(); head.len()];
            (row[0], row[2], row[9]) = (name(&member.name), member.computed_as.into(), edge);
            rows.push(row);
            continue;
        };
        for (end, forces) in ["start", "end"].iter().zip(both) {
            let day = format!("{:.0}", whole.times_s[last] / DAY);
            let mut row = vec![name(&member.name), day, (*end).into()];
            let SectionForces { n, v_y, v_z, t, m_y, m_z, .. } = *forces;
            row.extend(kilo([n, v_y, v_z]).chain(kilo([t, m_y, m_z])));
            row.push(edge.clone());
            rows.push(row);
        }
    }
    output::table(&rows)
}

fn redundancy(whole: &Whole, name: &dyn Fn(&str) -> String) -> String {
    let head = ["without", "the others", "edge MPa rises from", "to", "of f_ctm", "in"];
    let mut rows = vec![head.map(String::from).to_vec()];
    for r in &whole.redundancy {
        let falls: Vec<String> = r.falls.iter().map(|id| name(id)).collect();
        let stand = if r.stands { "stand".into() } else { format!("fall: {}", falls.join(", ")) };
        let rise = r.largest_rise.as_ref().map_or_else(Default::default, |rise| {
            let [from, to] = [rise.before_pa, rise.after_pa].map(|pa| format!("{:.2}", pa / MPA));
            [from, to, format!("{:.2}", rise.after_over_strength), name(&rise.member)]
        });
        rows.push([name(&r.without), stand].into_iter().chain(rise).collect());
    }
    let cracks =
        |r: &Redundancy| r.largest_rise.as_ref().is_some_and(|rise| rise.after_over_strength > 1.0);
    let mut text = output::table(&rows);
    if whole.redundancy.iter().any(cracks) {
        text += "note: all is taken as elastic here: above 1 f_ctm a section cracks, and whether its bars hold what is handed to it is not asked\n";
    }
    text
}

impl From<FrameError> for Failure {
    fn from(error: FrameError) -> Self {
        match error {
            FrameError::Cancelled(_)
            | FrameError::Solve(intrados_mechanics::sparse::SolveError::Cancelled(_)) => {
                Self::Interrupted
            }
            other => Self::BadInput(other.to_string()),
        }
    }
}
