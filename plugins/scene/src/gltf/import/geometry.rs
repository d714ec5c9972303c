//! Primitives to triangle meshes.

use glam::{DMat4, DQuat, DVec4, Vec2, Vec3, Vec4};
use intrados_stage::{Cancelled, Job};
use serde_json::Value;

use crate::{
    Mesh,
    gltf::{
        MAX_TRIANGLES,
        accessor::{Accessor, Shape},
        document::Document,
        json::Json,
        problem::{
            GltfProblem,
            remedy::{EXPORT, SMALLER},
        },
    },
};

/// Most instances of one node.
const MAX_INSTANCES: usize = 1 << 20;

/// Why decoding ended early.
pub(super) enum Stop {
    Damaged(GltfProblem),
    Cancelled(Cancelled),
}

impl From<GltfProblem> for Stop {
    fn from(problem: GltfProblem) -> Self {
        Self::Damaged(problem)
    }
}

impl From<Cancelled> for Stop {
    fn from(cancelled: Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

/// What a primitive turned out to be.
pub(super) enum Primitive {
    Triangles(Mesh),
    /// Points or lines.
    Wires,
    /// No positions, or no triangle of any area.
    Nothing,
}

/// Reads one primitive. `triangles` counts what was read so far.
pub(super) fn primitive(
    document: &Document,
    json: &Value,
    triangles: &mut usize,
    job: &Job,
) -> Result<Primitive, Stop> {
    let attributes = json.field("attributes");
    let Some(positions) = attributes.index("POSITION") else { return Ok(Primitive::Nothing) };
    let mode = json.get("mode").map_or(Some(4), crate::gltf::json::as_index);
    let mode = match mode {
        Some(0..=3) => return Ok(Primitive::Wires),
        Some(mode @ 4..=6) => mode,
        _ => {
            return Err(
                GltfProblem::error("/mode", "MODE", "the mode is none of 0 to 6", EXPORT).into()
            );
        }
    };
    let mut reader = Reader { document, job, count: 0, kept: None };
    reader.count = reader.open(positions)?.count;
    let corners = match json.index("indices") {
        Some(index) => reader.indices(index, mode, triangles)?,
        None => reader.triangles(0..reader.count as u32, mode, triangles)?,
    };
    let mut mesh = Mesh { triangles: corners, ..Mesh::default() };
    if mesh.triangles.is_empty() {
        return Ok(Primitive::Nothing);
    }
    reader.keep_used(&mut mesh.triangles);
    mesh.positions = reader.vectors(positions, Shape::Vec3, Vec3::from_array)?;
    if let Some(normals) = attributes.index("NORMAL") {
        mesh.normals =
            reader.vectors(normals, Shape::Vec3, |n| Vec3::from_array(n).normalize_or(Vec3::Y))?;
    }
    // Tangents belong to given normals (glTF 2.0 §3.7.2.1).
    if let (Some(tangents), false) = (attributes.index("TANGENT"), mesh.normals.is_empty()) {
        let tangent = |t: [f32; 4]| {
            Vec3::new(t[0], t[1], t[2]).normalize_or(Vec3::X).extend(if t[3] < 0.0 {
                -1.0
            } else {
                1.0
            })
        };
        mesh.tangents = reader.vectors(tangents, Shape::Vec4, tangent)?;
    }
    for (uv, name) in mesh.uv.iter_mut().zip(["TEXCOORD_0", "TEXCOORD_1"]) {
        if let Some(index) = attributes.index(name) {
            *uv = reader.vectors(index, Shape::Vec2, Vec2::from_array)?;
        }
    }
    if let Some(colours) = attributes.index("COLOR_0") {
        mesh.colours = match reader.open(colours)?.layout.shape {
            Shape::Vec3 => reader.vectors(colours, Shape::Vec3, Vec3::from_array)?,
            _ => reader.vectors(colours, Shape::Vec4, |c| Vec4::from_array(c).truncate())?,
        };
    }
    Ok(Primitive::Triangles(mesh))
}

/// Transforms of the instances of a node's mesh (`EXT_mesh_gpu_instancing`): translation, rotation
/// and scale, each a number of times or not at all.
pub(super) fn instances(document: &Document, json: &Value, job: &Job) -> Result<Vec<DMat4>, Stop> {
    let attributes = json.field("attributes");
    let [translation, rotation, scale] =
        ["TRANSLATION", "ROTATION", "SCALE"].map(|name| attributes.index(name));
    let mut reader = Reader { document, job, count: 0, kept: None };
    let Some(first) = translation.or(rotation).or(scale) else { return Ok(Vec::new()) };
    reader.count = reader.open(first)?.count;
    if reader.count > MAX_INSTANCES {
        let message = format!("{} instances are more than {MAX_INSTANCES}", reader.count);
        return Err(GltfProblem::error("", "TOO_BIG", message, SMALLER).into());
    }
    let vectors = |index: Option<usize>, absent: Vec3| match index {
        Some(index) => reader.vectors(index, Shape::Vec3, Vec3::from_array),
        None => Ok(vec![absent; reader.count]),
    };
    let (moved, scaled) = (vectors(translation, Vec3::ZERO)?, vectors(scale, Vec3::ONE)?);
    let turned = match rotation {
        Some(index) => reader.vectors(index, Shape::Vec4, Vec4::from_array)?,
        None => vec![Vec4::W; reader.count],
    };
    let one = |((moved, turned), scaled): ((Vec3, Vec4), Vec3)| {
        let turn = turned.as_dvec4();
        let turn = if turn.length_squared() > 0.0 { turn.normalize() } else { DVec4::W };
        DMat4::from_scale_rotation_translation(
            scaled.as_dvec3(),
            DQuat::from_vec4(turn),
            moved.as_dvec3(),
        )
    };
    Ok(moved.into_iter().zip(turned).zip(scaled).map(one).collect())
}

struct Reader<'a> {
    document: &'a Document,
    job: &'a Job,
    /// Vertices of the primitive.
    count: usize,
    /// Those that are used, ascending, where they are few.
    kept: Option<Vec<u32>>,
}

impl Reader<'_> {
    fn open(&self, index: usize) -> Result<Accessor<'_>, GltfProblem> {
        Accessor::open(self.document, index).map_err(|p| p.under(&format!("/accessors/{index}")))
    }

    /// Exporters let many primitives share one large vertex buffer: a primitive with fewer corners
    /// than the buffer has vertices takes only its own.
    fn keep_used(&mut self, triangles: &mut [[u32; 3]]) {
        if triangles.len() * 3 >= self.count {
            return;
        }
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        for corner in triangles.iter_mut().flatten() {
            *corner = used.binary_search(corner).unwrap_or(0) as u32;
        }
        self.kept = Some(used);
    }

    /// The kept elements as vectors of `N` finite components.
    fn vectors<T, const N: usize>(
        &self,
        index: usize,
        shape: Shape,
        make: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, Stop> {
        let accessor = self.open(index)?;
        let problem = |code, message: &str| {
            GltfProblem::error(format!("/accessors/{index}"), code, message, EXPORT)
        };
        if accessor.layout.shape != shape || shape.components() != N || accessor.count != self.count
        {
            return Err(problem(
                "ACCESSOR_FORMAT",
                "its type or count does not fit its use as a vertex attribute",
            )
            .into());
        }
        let count = self.kept.as_ref().map_or(self.count, Vec::len);
        self.document.spend(count.saturating_mul(size_of::<T>()))?;
        self.document.work(accessor.count.saturating_mul(N))?;
        let mut kept = self.kept.iter().flatten().map(|&v| v as usize).peekable();
        let mut vectors = Vec::with_capacity(count);
        let mut finite = true;
        accessor.visit(self.job, |i, element| {
            if self.kept.is_some() && kept.next_if_eq(&i).is_none() {
                return;
            }
            let mut vector = [0.0; N];
            for (component, &stored) in vector.iter_mut().zip(element) {
                *component = accessor.real(stored) as f32;
                finite &= component.is_finite();
            }
            vectors.push(make(vector));
        })?;
        if finite {
            Ok(vectors)
        } else {
            Err(problem("NOT_FINITE", "it holds NaN or infinity").into())
        }
    }

    /// Triangles of an index accessor, every index below `vertices`.
    fn indices(
        &self,
        index: usize,
        mode: usize,
        triangles: &mut usize,
    ) -> Result<Vec<[u32; 3]>, Stop> {
        let accessor = self.open(index)?;
        let problem = |code, message: String| {
            GltfProblem::error(format!("/accessors/{index}"), code, message, EXPORT)
        };
        if accessor.layout.shape != Shape::Scalar
            || accessor.layout.component == crate::gltf::accessor::Component::F32
        {
            return Err(
                problem("ACCESSOR_FORMAT", "indices must be unsigned integers".into()).into()
            );
        }
        self.document.spend(accessor.count.saturating_mul(4))?;
        self.document.work(accessor.count)?;
        let mut indices = Vec::with_capacity(accessor.count);
        let mut beyond = None;
        accessor.visit(self.job, |at, element| {
            let value = element.first().copied().unwrap_or(f64::NAN);
            if value >= 0.0 && value < self.count as f64 {
                indices.push(value as u32);
            } else {
                beyond.get_or_insert((at, value));
            }
        })?;
        if let Some((at, value)) = beyond {
            return Err(problem(
                "INDEX_OUT_OF_RANGE",
                format!("index {value} at {at} is not below the {} vertices", self.count),
            )
            .into());
        }
        self.triangles(indices.into_iter(), mode, triangles)
    }

    /// Assembles lists (4), strips (5) and fans (6), glTF 2.0 §3.7.2.1; triangles without area
    /// because two corners are one vertex, as strips have them, are left out.
    fn triangles(
        &self,
        vertices: impl ExactSizeIterator<Item = u32>,
        mode: usize,
        total: &mut usize,
    ) -> Result<Vec<[u32; 3]>, Stop> {
        let count = if mode == 4 { vertices.len() / 3 } else { vertices.len().saturating_sub(2) };
        *total = total.saturating_add(count);
        if *total > MAX_TRIANGLES {
            let message =
                format!("the model has more than {} million triangles", MAX_TRIANGLES >> 20);
            return Err(GltfProblem::error("", "TOO_BIG", message, SMALLER).into());
        }
        self.document.spend(count.saturating_mul(size_of::<[u32; 3]>()))?;
        let mut triangles = Vec::with_capacity(count);
        let mut push = |corners: [u32; 3]| {
            let [a, b, c] = corners;
            if a != b && b != c && c != a {
                triangles.push(corners);
            }
        };
        let mut before: [Option<u32>; 2] = [None; 2];
        for (i, v) in vertices.enumerate() {
            if let [Some(a), Some(b)] = before {
                // Every second triangle of a strip winds the other way.
                push(if mode == 5 && i % 2 == 1 { [b, a, v] } else { [a, b, v] });
            }
            before = match (mode, before, i % 3) {
                (4, _, 2) => [None; 2],
                (6, [Some(hub), _], _) => [Some(hub), Some(v)],
                (_, [None, None], _) => [Some(v), None],
                (_, [a, None], _) => [a, Some(v)],
                (_, [_, b], _) => [b, Some(v)],
            };
        }
        Ok(triangles)
    }
}
