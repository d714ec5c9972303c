//! What an earlier prediction said of a member, beside what the newest says.

use egui::Ui;
use intrados_predict::Predicted;
use intrados_scene::Member;
use intrados_stage::Estimate;

use super::bars;
use crate::{
    history::Earlier,
    lang::term,
    number::{copied, plus_minus},
};

/// So many standard errors are no chance.
const CLEAR: f64 = 1.96;

pub(super) fn compare(ui: &mut Ui, member: &Member, predicted: &Predicted, earlier: &Earlier) {
    ui.weak(&earlier.title);
    let Some(was) = earlier.member(&member.id) else {
        ui.label(tr!("This member was not in it."));
        return;
    };
    let Some(before) = was.damage() else {
        ui.label(tr!("Nothing was known of it then."));
        return;
    };
    let now = predicted.damage;
    for (when, damage, state) in
        [(tr!("then|in the past"), before, &was.state), (tr!("now"), now, &predicted.verdict.state)]
    {
        let value = plus_minus(damage.value, damage.std_error, "");
        copied(ui, format!("{when}: d = {}, {}", value.trim(), term(state)).into());
    }
    ui.label(changed(before, now));
    let sides = [was.zones, predicted.zones].map(|zones| zones.0.map(|z| z.map(|z| z.value)));
    let name = tr!("Damage along the member, then and now");
    bars::two(ui, &name, sides, [tr!("then|in the past"), tr!("now")]);
    ui.weak(tr!("each zone: left then, right now"));
}

/// What has changed, as far as both errors let anybody say. Both predictions share what they rest
/// on alike, so that the error of the difference is rather smaller than is said.
fn changed(before: Estimate, now: Estimate) -> String {
    let by = now.value - before.value;
    let error = before.std_error.hypot(now.std_error);
    let value = plus_minus(by.abs(), error, "");
    let value = value.trim();
    match by.abs() > CLEAR * error {
        true if by > 0.0 => tr!("It has grown by {}.", value),
        true => tr!("It is less by {}: what is known has changed, not the concrete.", value),
        false => tr!("{} apart, which the errors of both leave open.", value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_within_both_errors_is_none() {
        let of = |value, std_error| Estimate { value, std_error };
        assert!(changed(of(0.2, 0.1), of(0.3, 0.1)).contains("leave open"));
        assert!(changed(of(0.2, 0.05), of(0.5, 0.05)).starts_with("It has grown"));
        assert!(changed(of(0.5, 0.05), of(0.2, 0.05)).starts_with("It is less"));
    }
}
