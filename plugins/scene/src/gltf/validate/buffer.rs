//! Buffer views lie within their buffers.

use super::Check;
use crate::gltf::{json::Json, meshopt, problem::remedy::EXPORT};

/// Target of indices; 34962 is that of vertices.
pub(super) const INDICES: usize = 34963;

pub(super) fn check(check: &mut Check) {
    let root = &check.document.root;
    for (i, view) in root.list("bufferViews").iter().enumerate() {
        let at = |key: &str| format!("/bufferViews/{i}/{key}");
        let (offset, length) =
            (view.index("byteOffset").unwrap_or(0), view.index("byteLength").unwrap_or(0));
        let buffer = view
            .index("buffer")
            .and_then(|b| root.list("buffers").get(b))
            .and_then(|b| b.index("byteLength"));
        if let Some(size) =
            buffer.filter(|&size| offset.checked_add(length).is_none_or(|end| end > size))
        {
            let message =
                format!("{length} bytes from byte {offset} do not fit the buffer of {size} bytes");
            check.error(at("byteLength"), "VIEW_TOO_LONG", message, EXPORT);
        }
        let Some(stride) = view.index("byteStride") else { continue };
        if stride % 4 != 0 {
            check.error(
                at("byteStride"),
                "STRIDE",
                format!("a stride of {stride} is no multiple of 4"),
                EXPORT,
            );
        }
        if stride > length {
            check.error(
                at("byteStride"),
                "STRIDE",
                format!("a stride of {stride} is longer than the view"),
                EXPORT,
            );
        }
        if view.index("target") == Some(INDICES) && view.extension(meshopt::NAME).is_none() {
            check.error(
                at("byteStride"),
                "STRIDE",
                "only vertices may have a stride, indices lie close",
                EXPORT,
            );
        }
    }
}
