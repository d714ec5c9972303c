//! Animations: times that grow, values that fit what they move.

use std::collections::HashSet;

use intrados_stage::Cancelled;
use serde_json::Value;

use super::Check;
use crate::gltf::{
    accessor::{Component, Layout, Shape},
    json::Json,
    problem::remedy::{EXPORT, REFERENCE},
};

pub(super) fn check(check: &mut Check) -> Result<(), Cancelled> {
    let mut timed = HashSet::new();
    for (i, animation) in check.document.root.list("animations").iter().enumerate() {
        check.job.step(6, 10)?;
        let at = format!("/animations/{i}");
        for (k, sampler) in animation.list("samplers").iter().enumerate() {
            close(check, sampler, &format!("{at}/samplers/{k}"));
            times(check, sampler, &format!("{at}/samplers/{k}/input"), &mut timed)?;
        }
        let mut targets = HashSet::new();
        for (k, channel) in animation.list("channels").iter().enumerate() {
            let (at, target) = (format!("{at}/channels/{k}"), channel.field("target"));
            let moved = target.index("node").zip(target.text("path"));
            if moved.is_some_and(|moved| !targets.insert(moved)) {
                check.error(
                    format!("{at}/target"),
                    "ANIMATION_TARGET",
                    "another channel moves the same",
                    "remove one of them",
                );
            }
            self::target(check, target, &format!("{at}/target"));
            match channel.index("sampler").map(|s| animation.list("samplers").get(s)) {
                Some(None) => check.error(
                    format!("{at}/sampler"),
                    "REFERENCE",
                    "there is no such sampler",
                    REFERENCE,
                ),
                Some(Some(sampler)) => values(check, sampler, target, &format!("{at}/sampler"))?,
                None => {}
            }
        }
    }
    Ok(())
}

fn accessor<'a>(check: &Check<'a>, index: Option<usize>) -> Option<&'a Value> {
    check.document.root.list("accessors").get(index?)
}

/// Keyframes lie close.
fn close(check: &mut Check, sampler: &Value, at: &str) {
    for key in ["input", "output"] {
        let view = accessor(check, sampler.index(key)).and_then(|a| a.index("bufferView"));
        if view
            .and_then(|v| check.document.root.list("bufferViews").get(v))
            .is_some_and(|v| v.get("byteStride").is_some())
        {
            check.error(
                format!("{at}/{key}"),
                "STRIDE",
                "keyframes must lie close, without a stride",
                EXPORT,
            );
        }
    }
}

/// Times are floats with bounds, not negative, and grow.
fn times(
    check: &mut Check,
    sampler: &Value,
    at: &str,
    timed: &mut HashSet<usize>,
) -> Result<(), Cancelled> {
    let Some(number) = sampler.index("input") else { return Ok(()) };
    let Some(json) = accessor(check, Some(number)) else { return Ok(()) };
    if Layout::of(json)
        .is_some_and(|l| l != Layout { component: Component::F32, shape: Shape::Scalar })
    {
        check.error(at, "ANIMATION_TIMES", "times must be single floats", EXPORT);
        return Ok(());
    }
    if json.get("min").is_none() || json.get("max").is_none() {
        check.error(at, "ANIMATION_TIMES", "times must declare min and max", EXPORT);
    }
    if sampler.text("interpolation") == Some("CUBICSPLINE")
        && json.index("count").is_some_and(|n| n < 2)
    {
        check.error(at, "ANIMATION_TIMES", "a cubic spline needs two keyframes", EXPORT);
    }
    let Some(accessor) = check.data(number).filter(|_| timed.insert(number)) else { return Ok(()) };
    let mut before = -f64::MIN_POSITIVE;
    let mut damaged = None;
    check.visit(&accessor, |i, time| {
        let time = time.first().copied().unwrap_or(f64::NAN);
        if (time.is_nan() || time <= before || time < 0.0) && damaged.is_none() {
            damaged = Some((i, time));
        }
        before = time;
    })?;
    if let Some((i, time)) = damaged {
        check.error(
            at,
            "ANIMATION_TIMES",
            format!("time {i}, {time} s, is negative or does not grow"),
            EXPORT,
        );
    }
    Ok(())
}

/// What is moved can be moved.
fn target(check: &mut Check, target: &Value, at: &str) {
    let root = &check.document.root;
    let Some(node) = target.index("node").and_then(|n| root.list("nodes").get(n)) else { return };
    match target.text("path") {
        Some("weights") if morphs(check, target) == Some(0) => {
            check.error(
                at,
                "ANIMATION_TARGET",
                "it moves weights of a node without morph targets",
                EXPORT,
            );
        }
        Some("translation" | "rotation" | "scale") if node.get("matrix").is_some() => {
            check.error(
                at,
                "ANIMATION_TARGET",
                "a node with a matrix cannot be animated",
                "write translation, rotation and scale",
            );
        }
        _ => {}
    }
}

/// Morph targets of the node that is moved.
fn morphs(check: &Check, target: &Value) -> Option<usize> {
    let root = &check.document.root;
    let node = root.list("nodes").get(target.index("node")?)?;
    let mesh = node.index("mesh").and_then(|m| root.list("meshes").get(m));
    Some(mesh.and_then(|m| m.list("primitives").first()).map_or(0, |p| p.list("targets").len()))
}

/// Values fit the path in type and count; quaternions are unit.
fn values(check: &mut Check, sampler: &Value, target: &Value, at: &str) -> Result<(), Cancelled> {
    let (Some(input), Some(number)) =
        (accessor(check, sampler.index("input")), sampler.index("output"))
    else {
        return Ok(());
    };
    let Some(output) = accessor(check, Some(number)) else { return Ok(()) };
    let (shape, times) = match target.text("path") {
        Some("translation" | "scale") => (Shape::Vec3, Some(1)),
        Some("rotation") => (Shape::Vec4, Some(1)),
        Some("weights") => (Shape::Scalar, morphs(check, target)),
        _ => return Ok(()),
    };
    let Some(layout) = Layout::of(output) else { return Ok(()) };
    let integers = matches!(target.text("path"), Some("rotation" | "weights"))
        && layout.component != Component::U32
        && output.field("normalized").as_bool() == Some(true);
    if layout.shape != shape || (layout.component != Component::F32 && !integers) {
        check.error(at, "ANIMATION_VALUES", "the values' type does not fit what they move", EXPORT);
        return Ok(());
    }
    let cubic = sampler.text("interpolation") == Some("CUBICSPLINE");
    let expected = times
        .zip(input.index("count"))
        .and_then(|(n, count)| (n * if cubic { 3 } else { 1 }).checked_mul(count));
    if let Some((expected, count)) =
        expected.filter(|&n| n > 0).zip(output.index("count")).filter(|(a, b)| a != b)
    {
        check.error(
            at,
            "ANIMATION_VALUES",
            format!("{count} values, {expected} are needed"),
            EXPORT,
        );
    }
    if shape != Shape::Vec4 {
        return Ok(());
    }
    let Some(accessor) = check.data(number) else { return Ok(()) };
    let mut damaged = None;
    check.visit(&accessor, |i, q| {
        let length = q.iter().map(|&x| accessor.real(x).powi(2)).sum::<f64>().sqrt();
        // Of a spline's triples only the middle one is a rotation, the others are tangents.
        if (!cubic || i % 3 == 1) && (length - 1.0).abs() > 0.02 {
            damaged.get_or_insert((i, length));
        }
    })?;
    if let Some((i, length)) = damaged {
        check.error(
            at,
            "ANIMATION_VALUES",
            format!("rotation {i} is no unit quaternion, its length is {length:.4}"),
            "normalise it",
        );
    }
    Ok(())
}
