//! `EXT_meshopt_compression`: buffer views packed by meshoptimizer. Its decoders are made for
//! untrusted input but trust the sizes they are given, so every size is checked here first.

use serde_json::Value;

use super::{
    json::Json,
    problem::{GltfProblem, remedy::EXPORT},
};

/// The extension's name.
pub(super) const NAME: &str = "EXT_meshopt_compression";

fn damaged(message: impl Into<String>) -> GltfProblem {
    GltfProblem::error("", "MESHOPT", message, EXPORT)
}

/// Bytes that a packed view takes when unpacked.
pub(super) fn size(packed: &Value) -> Result<usize, GltfProblem> {
    let (count, stride) = layout(packed)?;
    count.checked_mul(stride).ok_or_else(|| damaged("the unpacked size overflows"))
}

fn layout(packed: &Value) -> Result<(usize, usize), GltfProblem> {
    let count = packed.index("count").ok_or_else(|| damaged("count is missing"))?;
    let stride = packed.index("byteStride").ok_or_else(|| damaged("byteStride is missing"))?;
    let fits = match packed.text("mode") {
        Some("ATTRIBUTES") => stride % 4 == 0 && (4..=256).contains(&stride),
        Some("TRIANGLES") => count % 3 == 0 && (stride == 2 || stride == 4),
        Some("INDICES") => stride == 2 || stride == 4,
        _ => return Err(damaged("mode is none of ATTRIBUTES, TRIANGLES, INDICES")),
    };
    let filtered = match packed.text("filter") {
        None | Some("NONE") => true,
        Some("OCTAHEDRAL") => stride == 4 || stride == 8,
        Some("QUATERNION") => stride == 8,
        Some("EXPONENTIAL") => stride % 4 == 0,
        _ => return Err(damaged("the filter is unknown")),
    };
    if fits && filtered && count > 0 {
        Ok((count, stride))
    } else {
        Err(damaged(format!(
            "{count} elements of {stride} bytes do not fit the mode or the filter"
        )))
    }
}

/// Unpacks a view whose [`size`] the caller has accepted.
pub(super) fn decode(packed: &Value, bytes: &[u8]) -> Result<Vec<u8>, GltfProblem> {
    let (count, stride) = layout(packed)?;
    let failed = |_| damaged("the packed data is damaged");
    let mut unpacked = match (packed.text("mode"), stride) {
        (Some("ATTRIBUTES"), _) => attributes(bytes, count, stride)?,
        (Some("TRIANGLES"), 2) => meshopt::decode_index_buffer::<u16>(bytes, count)
            .map_err(failed)?
            .into_iter()
            .flat_map(u16::to_le_bytes)
            .collect(),
        (Some("TRIANGLES"), _) => meshopt::decode_index_buffer::<u32>(bytes, count)
            .map_err(failed)?
            .into_iter()
            .flat_map(u32::to_le_bytes)
            .collect(),
        (_, 2) => meshopt::decode_index_sequence::<u16>(bytes, count)
            .map_err(failed)?
            .into_iter()
            .flat_map(u16::to_le_bytes)
            .collect(),
        _ => meshopt::decode_index_sequence::<u32>(bytes, count)
            .map_err(failed)?
            .into_iter()
            .flat_map(u32::to_le_bytes)
            .collect(),
    };
    match (packed.text("filter"), stride) {
        (Some("OCTAHEDRAL"), 4) => {
            filter(&mut unpacked, i8::from_le_bytes, i8::to_le_bytes, meshopt::decode_filter_oct)
        }
        (Some("OCTAHEDRAL"), _) => {
            filter(&mut unpacked, i16::from_le_bytes, i16::to_le_bytes, meshopt::decode_filter_oct)
        }
        (Some("QUATERNION"), _) => {
            filter(&mut unpacked, i16::from_le_bytes, i16::to_le_bytes, meshopt::decode_filter_quat)
        }
        // Each word stands alone, whatever the stride.
        (Some("EXPONENTIAL"), _) => filter(
            &mut unpacked,
            u32::from_le_bytes,
            u32::to_le_bytes,
            meshopt::decode_filter_exp::<1>,
        ),
        _ => {}
    }
    Ok(unpacked)
}

/// Applies a filter to rows of `W` words of `B` bytes.
fn filter<T: Copy + Default, const B: usize, const W: usize>(
    bytes: &mut [u8],
    from: fn([u8; B]) -> T,
    to: fn(T) -> [u8; B],
    decode: fn(&mut [[T; W]]),
) {
    let mut rows: Vec<[T; W]> = Vec::with_capacity(bytes.len() / (B * W).max(1));
    for row in bytes.chunks_exact(B * W) {
        let mut words = [T::default(); W];
        for (word, bytes) in words.iter_mut().zip(row.chunks_exact(B)) {
            *word = bytes.try_into().map(from).unwrap_or_default();
        }
        rows.push(words);
    }
    decode(&mut rows);
    for (bytes, &word) in bytes.chunks_exact_mut(B).zip(rows.as_flattened()) {
        bytes.copy_from_slice(&to(word));
    }
}

/// One vertex of `N` words: the decoder takes the stride from the type.
#[derive(Clone)]
struct Vertex<const N: usize>([[u8; 4]; N]);

impl<const N: usize> Default for Vertex<N> {
    fn default() -> Self {
        Self([[0; 4]; N])
    }
}

fn vertices<const N: usize>(bytes: &[u8], count: usize) -> Result<Vec<u8>, GltfProblem> {
    let vertices = meshopt::decode_vertex_buffer::<Vertex<N>>(bytes, count)
        .map_err(|_| damaged("the packed data is damaged"))?;
    Ok(vertices.iter().flat_map(|vertex| vertex.0.as_flattened()).copied().collect())
}

fn attributes(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, GltfProblem> {
    macro_rules! by_words {
        ($($n:literal)*) => {
            match stride / 4 {
                $($n => vertices::<$n>(bytes, count),)*
                _ => Err(damaged(format!("vertices of {stride} bytes are not supported"))),
            }
        };
    }
    by_words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32 33 34 35 36 37 38 39 40 41 42 43 44
        45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64)
}
