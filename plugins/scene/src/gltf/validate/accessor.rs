//! Accessors fit their buffer views, and their data keeps what they promise.

use intrados_stage::Cancelled;
use serde_json::Value;

use super::Check;
use crate::gltf::{
    accessor::{Accessor, Component, Layout, Shape},
    json::Json,
    meshopt,
    problem::remedy::EXPORT,
};

pub(super) fn check(check: &mut Check) -> Result<(), Cancelled> {
    for (i, json) in check.document.root.list("accessors").iter().enumerate() {
        check.job.step(5, 10)?;
        let before = check.problems.len();
        form(check, i, json);
        if check.problems.len() == before {
            data(check, i, json)?;
        }
    }
    Ok(())
}

/// What can be told without the data.
fn form(check: &mut Check, index: usize, json: &Value) {
    let at = |key: &str| format!("/accessors/{index}{key}");
    if json.get("byteOffset").is_some() && json.get("bufferView").is_none() {
        check.error(at("/byteOffset"), "ACCESSOR", "an offset without a buffer view", EXPORT);
    }
    let (Some(layout), Some(count)) = (Layout::of(json), json.index("count")) else { return };
    let integer = !matches!(layout.component, Component::F32 | Component::U32);
    if json.field("normalized").as_bool() == Some(true) && !integer {
        check.error(
            at("/normalized"),
            "ACCESSOR",
            "only integers of one or two bytes can be normalised",
            EXPORT,
        );
    }
    for key in ["min", "max"] {
        let n = json.list(key).len();
        if n > 0 && n != layout.shape.components() {
            check.error(
                at(&format!("/{key}")),
                "LENGTH",
                format!("{n} numbers for {} components", layout.shape.components()),
                EXPORT,
            );
        }
    }
    place(check, json, &at(""), layout, count);
    let Some(sparse) = json.get("sparse") else { return };
    let replaced = sparse.index("count").unwrap_or(0);
    if replaced > count {
        check.error(
            at("/sparse/count"),
            "SPARSE_COUNT",
            format!("{replaced} elements are replaced, there are only {count}"),
            EXPORT,
        );
    }
    let indices = sparse.field("indices");
    if let Some(component) = indices.index("componentType").and_then(Component::from_code) {
        place(
            check,
            indices,
            &at("/sparse/indices"),
            Layout { component, shape: Shape::Scalar },
            replaced,
        );
    }
    place(check, sparse.field("values"), &at("/sparse/values"), layout, replaced);
    for part in ["indices", "values"] {
        let view = sparse
            .field(part)
            .index("bufferView")
            .and_then(|v| check.document.root.list("bufferViews").get(v));
        if view.is_some_and(|v| v.get("byteStride").is_some()) {
            check.error(
                at(&format!("/sparse/{part}/bufferView")),
                "STRIDE",
                "sparse data must lie close, without a stride",
                EXPORT,
            );
        }
    }
}

/// Alignment, stride and fit of `count` elements at an offset in a buffer view (glTF 2.0 §3.6.2.4).
fn place(check: &mut Check, json: &Value, at: &str, layout: Layout, count: usize) {
    let Some(view) =
        json.index("bufferView").and_then(|v| check.document.root.list("bufferViews").get(v))
    else {
        return;
    };
    let (offset, view_offset) =
        (json.index("byteOffset").unwrap_or(0), view.index("byteOffset").unwrap_or(0));
    let align = layout.component.bytes();
    // Columns of matrices start at multiples of 4.
    let own_align = if layout.shape.columns() > 1 { 4 } else { align };
    if offset % own_align != 0 {
        check.error(
            format!("{at}/byteOffset"),
            "ALIGNMENT",
            format!("offset {offset} is no multiple of {own_align}"),
            EXPORT,
        );
    } else if offset.wrapping_add(view_offset) % align != 0 {
        let message = format!("offsets {view_offset} + {offset} make no multiple of {align}");
        check.error(at, "ALIGNMENT", message, EXPORT);
    }
    let stride = view.index("byteStride");
    if let Some(stride) = stride.filter(|&s| s < layout.element_bytes()) {
        check.error(
            at,
            "STRIDE",
            format!(
                "a stride of {stride} is shorter than an element of {}",
                layout.element_bytes()
            ),
            EXPORT,
        );
    }
    let packed = view.extension(meshopt::NAME).and_then(|packed| meshopt::size(packed).ok());
    let length = packed.or_else(|| view.index("byteLength")).unwrap_or(0);
    let reach = layout
        .reach(count, stride.unwrap_or(layout.element_bytes()))
        .and_then(|reach| reach.checked_add(offset));
    if count > 0 && reach.is_none_or(|reach| reach > length) {
        let message = format!(
            "{count} elements from byte {offset} do not fit the buffer view of {length} bytes"
        );
        check.error(at, "ACCESSOR_TOO_LONG", message, EXPORT);
    }
}

/// Sparse order, finiteness, declared bounds.
fn data(check: &mut Check, index: usize, json: &Value) -> Result<(), Cancelled> {
    let accessor = match Accessor::open(check.document, index) {
        Ok(accessor) => accessor,
        Err(problem) => {
            // Bytes that are not in the file, and types that only warn, are legal; other faults of
            // form were reported by the schema.
            if problem.code.starts_with("SPARSE") || problem.code == "ACCESSOR_TOO_LONG" {
                check.push(problem.under(&format!("/accessors/{index}")));
            }
            return Ok(());
        }
    };
    if !accessor.has_data() {
        return Ok(());
    }
    let mut bounds = [[f64::INFINITY; 16], [f64::NEG_INFINITY; 16]];
    let mut infinite = None;
    check.visit(&accessor, |i, element| {
        let [low, high] = &mut bounds;
        for ((&x, low), high) in element.iter().zip(low).zip(high) {
            if !x.is_finite() {
                infinite.get_or_insert((i, x));
            }
            *low = low.min(x);
            *high = high.max(x);
        }
    })?;
    if let Some((i, x)) = infinite {
        check.error(
            format!("/accessors/{index}"),
            "NOT_FINITE",
            format!("element {i} is {x}"),
            EXPORT,
        );
    }
    for (key, actual) in [("min", bounds[0]), ("max", bounds[1])] {
        for (c, (declared, &actual)) in json.list(key).iter().zip(&actual).enumerate() {
            let Some(declared) = declared.as_f64() else { continue };
            // Bounds of floats are floats written in decimals.
            let declared = if accessor.layout.component == Component::F32 {
                f64::from(declared as f32)
            } else {
                declared
            };
            if declared != actual && actual.is_finite() {
                let message = format!("the declared {key} is {declared}, the data's is {actual}");
                check.error(format!("/accessors/{index}/{key}/{c}"), "BOUNDS", message, EXPORT);
            }
        }
    }
    Ok(())
}
