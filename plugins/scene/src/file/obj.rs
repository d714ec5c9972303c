//! Triangles of Wavefront OBJ files: `v` and `f` lines, `o` and `g` for what belongs together;
//! everything else is passed over.

use std::collections::{BTreeMap, HashMap};

use glam::Vec3;

use crate::{LoadError, Mesh};

/// Reads the mesh.
pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<Mesh, LoadError> {
    Ok(marked(name, bytes)?.0)
}

/// Reads the groups, each with its name and the vertices that it uses.
pub(crate) fn obj_groups(name: &str, bytes: &[u8]) -> Result<Vec<(String, Mesh)>, LoadError> {
    let (mesh, marks) = marked(name, bytes)?;
    let mut names: Vec<String> = Vec::new();
    let mut of: BTreeMap<usize, Vec<[u32; 3]>> = BTreeMap::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        // The last mark before a triangle names its group.
        let mark = marks.partition_point(|(from, _)| *from <= i).checked_sub(1);
        let group = mark.and_then(|m| marks.get(m)).map_or("object", |(_, group)| group);
        let group = *known.entry(group.to_owned()).or_insert_with(|| {
            names.push(group.to_owned());
            names.len() - 1
        });
        of.entry(group).or_default().push(*triangle);
    }
    let part = |triangles: &[[u32; 3]]| {
        let mut used: BTreeMap<u32, u32> = triangles.iter().flatten().map(|&i| (i, 0)).collect();
        used.values_mut().zip(0..).for_each(|(own, next)| *own = next);
        Mesh {
            positions: used
                .keys()
                .filter_map(|&i| mesh.positions.get(i as usize).copied())
                .collect(),
            triangles: triangles
                .iter()
                .map(|t| t.map(|i| used.get(&i).copied().unwrap_or(0)))
                .collect(),
            ..Mesh::default()
        }
    };
    Ok(names.into_iter().zip(of.values().map(|t| part(t))).collect())
}

/// All triangles, and from which on they belong to which group.
fn marked(name: &str, bytes: &[u8]) -> Result<(Mesh, Vec<(usize, String)>), LoadError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| LoadError::bad(name, "NOT_TEXT", "is not UTF-8 text: is it an OBJ file?"))?;
    let mut mesh = Mesh::default();
    let mut marks = Vec::new();
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
            Some("o" | "g") => {
                let group = words.collect::<Vec<_>>().join(" ");
                marks.push((mesh.triangles.len(), group));
            }
            _ => {}
        }
    }
    if mesh.triangles.is_empty() {
        return Err(LoadError::bad(name, "EMPTY", "has no faces: is it an OBJ file?"));
    }
    Ok((mesh, marks))
}

/// `7`, `7/1`, `7//3`, `7/1/3`; negative ones count from the last vertex.
fn vertex(word: &str, count: usize) -> Option<u32> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    let index = if index < 0 { count as i64 + index } else { index - 1 };
    (0..count as i64).contains(&index).then_some(index as u32)
}
