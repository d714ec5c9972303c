//! Triangles of Wavefront OBJ files: `v` and `f` lines; everything else is passed over.

use glam::Vec3;

use crate::{LoadError, Mesh};

/// Reads the mesh.
pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<Mesh, LoadError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| LoadError::bad(name, "NOT_TEXT", "is not UTF-8 text: is it an OBJ file?"))?;
    let mut mesh = Mesh::default();
    for (i, line) in text.lines().enumerate() {
        let bad = |message: &str| LoadError::bad(format!("{name}:{}:1", i + 1), "BAD_OBJ", message);
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let mut number = || words.next()?.parse::<f32>().ok().filter(|x| x.abs() <= 1e6);
                let (Some(x), Some(y), Some(z)) = (number(), number(), number()) else {
                    return Err(bad("a vertex needs three finite numbers within ±1e6"));
                };
                mesh.positions.push(Vec3::new(x, y, z));
            }
            Some("f") => {
                let corners: Option<Vec<u32>> =
                    words.map(|word| vertex(word, mesh.positions.len())).collect();
                let corners = corners.filter(|c| c.len() >= 3).ok_or_else(|| {
                    bad("a face needs three or more vertices that were given before")
                })?;
                if let Some((&first, rest)) = corners.split_first() {
                    mesh.triangles.extend(rest.windows(2).map(|w| [first, w[0], w[1]]));
                }
            }
            _ => {}
        }
    }
    if mesh.triangles.is_empty() {
        return Err(LoadError::bad(name, "EMPTY", "has no faces: is it an OBJ file?"));
    }
    Ok(mesh)
}

/// `7`, `7/1`, `7//3`, `7/1/3`; negative ones count from the last vertex.
fn vertex(word: &str, count: usize) -> Option<u32> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    let index = if index < 0 { count as i64 + index } else { index - 1 };
    (0..count as i64).contains(&index).then_some(index as u32)
}
