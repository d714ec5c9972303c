//! Accessors: typed views of buffers, with every size checked before the first element is read.

use intrados_stage::{Cancelled, Job};
use serde_json::Value;

use super::{
    document::Document,
    json::Json,
    problem::{GltfProblem, remedy::EXPORT},
};

/// Type of one component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    pub(super) fn from_code(code: usize) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Largest value of an integer type: the divisor of normalised integers, and the
    /// primitive-restart index.
    pub(super) fn max(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::U32 => f64::from(u32::MAX),
            Self::F32 => 1.0,
        }
    }

    /// The component at the start of `bytes`; NaN where they end too early.
    fn read(self, bytes: &[u8]) -> f64 {
        fn first<const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
            bytes.first_chunk::<N>().copied()
        }
        let value = match self {
            Self::I8 => first(bytes).map(|b| f64::from(i8::from_le_bytes(b))),
            Self::U8 => first(bytes).map(|b| f64::from(u8::from_le_bytes(b))),
            Self::I16 => first(bytes).map(|b| f64::from(i16::from_le_bytes(b))),
            Self::U16 => first(bytes).map(|b| f64::from(u16::from_le_bytes(b))),
            Self::U32 => first(bytes).map(|b| f64::from(u32::from_le_bytes(b))),
            Self::F32 => first(bytes).map(|b| f64::from(f32::from_le_bytes(b))),
        };
        value.unwrap_or(f64::NAN)
    }
}

/// Shape of one element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

impl Shape {
    pub(super) fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "SCALAR" => Self::Scalar,
            "VEC2" => Self::Vec2,
            "VEC3" => Self::Vec3,
            "VEC4" => Self::Vec4,
            "MAT2" => Self::Mat2,
            "MAT3" => Self::Mat3,
            "MAT4" => Self::Mat4,
            _ => return None,
        })
    }

    pub(super) fn columns(self) -> usize {
        match self {
            Self::Mat2 => 2,
            Self::Mat3 => 3,
            Self::Mat4 => 4,
            _ => 1,
        }
    }

    pub(super) fn rows(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vec2 | Self::Mat2 => 2,
            Self::Vec3 | Self::Mat3 => 3,
            Self::Vec4 | Self::Mat4 => 4,
        }
    }

    pub(super) fn components(self) -> usize {
        self.columns() * self.rows()
    }
}

/// How elements lie in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    pub component: Component,
    pub shape: Shape,
}

impl Layout {
    pub(super) fn of(json: &Value) -> Option<Self> {
        let component = Component::from_code(json.index("componentType")?)?;
        Some(Self { component, shape: Shape::from_name(json.text("type")?)? })
    }

    /// Bytes from one column to the next: columns of matrices start at multiples of 4.
    fn column_stride(self) -> usize {
        let bytes = self.shape.rows() * self.component.bytes();
        if self.shape.columns() > 1 { bytes.next_multiple_of(4) } else { bytes }
    }

    /// Bytes of an element, padding within a matrix included, padding behind its last column
    /// included too.
    pub(super) fn element_bytes(self) -> usize {
        self.column_stride() * self.shape.columns()
    }

    /// Bytes that `count` elements at `stride` reach over: the last one needs no padding behind it.
    pub(super) fn reach(self, count: usize, stride: usize) -> Option<usize> {
        let last = self.column_stride() * (self.shape.columns() - 1)
            + self.shape.rows() * self.component.bytes();
        stride.checked_mul(count.checked_sub(1)?)?.checked_add(last)
    }
}

/// Bytes with a stride.
#[derive(Debug, Clone, Copy)]
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Strided<'a> {
    fn new(
        document: &'a Document,
        place: &Value,
        layout: Layout,
        count: usize,
        pointer: &str,
    ) -> Result<Self, GltfProblem> {
        let Some(view) = place.index("bufferView") else {
            return Err(GltfProblem::error(pointer, "ACCESSOR", "bufferView is missing", EXPORT));
        };
        let stride = document
            .root
            .list("bufferViews")
            .get(view)
            .and_then(|v| v.index("byteStride"))
            .unwrap_or(layout.element_bytes());
        let Some(bytes) = document.view(view) else {
            let message = format!("the bytes of buffer view {view} are not in the file");
            return Err(GltfProblem::error(
                pointer,
                "BUFFER_ABSENT",
                message,
                "embed the buffer or put its file beside the model",
            ));
        };
        let offset = place.index("byteOffset").unwrap_or(0);
        let reach =
            layout.reach(count, stride).filter(|_| stride >= layout.element_bytes() || count <= 1);
        match reach.and_then(|reach| bytes.get(offset..offset.checked_add(reach)?)) {
            Some(bytes) => Ok(Self { bytes, stride }),
            None => {
                let message = format!(
                    "{count} elements from byte {offset} do not fit the {} bytes of buffer view {view}",
                    bytes.len()
                );
                Err(GltfProblem::error(pointer, "ACCESSOR_TOO_LONG", message, EXPORT))
            }
        }
    }

    fn read(&self, layout: Layout, index: usize, element: &mut [f64]) {
        let bytes = self.bytes.get(index * self.stride..).unwrap_or(&[]);
        for (c, column) in element.chunks_mut(layout.shape.rows()).enumerate() {
            for (r, value) in column.iter_mut().enumerate() {
                let at = c * layout.column_stride() + r * layout.component.bytes();
                *value = layout.component.read(bytes.get(at..).unwrap_or(&[]));
            }
        }
    }
}

/// An accessor whose sizes hold.
#[derive(Debug)]
pub(super) struct Accessor<'a> {
    pub layout: Layout,
    pub count: usize,
    pub normalised: bool,
    base: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
}

#[derive(Debug)]
struct Sparse<'a> {
    /// Ascending.
    indices: Vec<usize>,
    values: Strided<'a>,
}

impl<'a> Accessor<'a> {
    /// Checks an accessor and opens it. The problem's pointer is below `/accessors/N`.
    pub(super) fn open(document: &'a Document, index: usize) -> Result<Self, GltfProblem> {
        let broken = |message: &str| GltfProblem::error("", "ACCESSOR", message, EXPORT);
        let json = document
            .root
            .list("accessors")
            .get(index)
            .ok_or_else(|| broken("there is no such accessor"))?;
        let layout = Layout::of(json)
            .ok_or_else(|| broken("type or componentType is missing or unknown"))?;
        let count = json
            .index("count")
            .filter(|&n| n > 0)
            .ok_or_else(|| broken("count is missing or zero"))?;
        if count > u32::MAX as usize {
            return Err(broken("more elements than indices can count"));
        }
        let base = if json.get("bufferView").is_some() {
            Some(Strided::new(document, json, layout, count, "")?)
        } else {
            None
        };
        let sparse = match json.get("sparse") {
            Some(sparse) => Some(
                Sparse::open(document, sparse, layout, count).map_err(|p| p.under("/sparse"))?,
            ),
            None => None,
        };
        let normalised = json.field("normalized").as_bool().unwrap_or(false);
        Ok(Self { layout, count, normalised, base, sparse })
    }

    /// Whether it holds any data of its own (otherwise it is all zeros).
    pub(super) fn has_data(&self) -> bool {
        self.base.is_some() || self.sparse.is_some()
    }

    /// Visits every element in order, integers as stored.
    pub(super) fn visit(
        &self,
        job: &Job,
        mut visitor: impl FnMut(usize, &[f64]),
    ) -> Result<(), Cancelled> {
        let mut buffer = [0.0; 16];
        let (element, _) = buffer.split_at_mut(self.layout.shape.components());
        let mut replaced = self
            .sparse
            .iter()
            .flat_map(|s| s.indices.iter().copied().enumerate().map(move |e| (s, e)))
            .peekable();
        for i in 0..self.count {
            if i % (1 << 20) == 0 && job.is_cancelled() {
                return Err(Cancelled);
            }
            if let Some((sparse, (k, _))) = replaced.next_if(|(_, (_, at))| *at == i) {
                sparse.values.read(self.layout, k, element);
            } else if let Some(base) = &self.base {
                base.read(self.layout, i, element);
            } else {
                element.fill(0.0);
            }
            visitor(i, element);
        }
        Ok(())
    }

    /// The real value of a stored component: normalised integers become [0, 1] or [−1, 1] (glTF 2.0
    /// §3.6.2.2).
    pub(super) fn real(&self, stored: f64) -> f64 {
        if self.normalised && self.layout.component != Component::F32 {
            (stored / self.layout.component.max()).max(-1.0)
        } else {
            stored
        }
    }
}

impl<'a> Sparse<'a> {
    fn open(
        document: &'a Document,
        json: &Value,
        layout: Layout,
        base_count: usize,
    ) -> Result<Self, GltfProblem> {
        let count = json.index("count").filter(|n| (1..=base_count).contains(n));
        let count = count.ok_or_else(|| {
            GltfProblem::error(
                "/count",
                "SPARSE_COUNT",
                format!("the count is not within 1 to {base_count}"),
                EXPORT,
            )
        })?;
        let places = json.field("indices");
        let component = places.index("componentType").and_then(Component::from_code);
        let component =
            component.filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32));
        let component = component.ok_or_else(|| {
            GltfProblem::error(
                "/indices/componentType",
                "ACCESSOR",
                "the indices must be unsigned integers",
                EXPORT,
            )
        })?;
        let index_layout = Layout { component, shape: Shape::Scalar };
        let stored = Strided::new(document, places, index_layout, count, "/indices")?;
        // `count` indices were found in the file, so this allocation is backed by bytes that were
        // read.
        let mut indices = Vec::with_capacity(count);
        let mut next = 0;
        for k in 0..count {
            let mut value = [0.0];
            stored.read(index_layout, k, &mut value);
            let index = value[0] as usize;
            if index < next || index >= base_count {
                let message = format!(
                    "sparse index {index} at {k} is out of order or not below {base_count}"
                );
                return Err(GltfProblem::error("/indices", "SPARSE_INDICES", message, EXPORT));
            }
            next = index + 1;
            indices.push(index);
        }
        let values = Strided::new(document, json.field("values"), layout, count, "/values")?;
        Ok(Self { indices, values })
    }
}
