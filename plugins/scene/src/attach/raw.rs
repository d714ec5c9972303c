//! Bare voxels, as a scanner leaves them: what they need to be read is put before them.

use std::{
    fmt,
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
    str::FromStr,
};

use intrados_stage::access;

use super::AttachError;

/// How bare voxels lie in their file: x fastest, then y, then slice by slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Raw {
    /// Voxels to the right, down, and slices.
    pub size: [u32; 3],
    /// What each is.
    pub voxel: VoxelType,
    /// Bytes before the first.
    pub skip: u64,
    /// Whether the first byte of a voxel counts most.
    pub big_endian: bool,
}

/// No voxel is of this type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("is none of {}", TYPES.map(|t| t.1).join(", "))]
pub struct VoxelTypeError;

/// What a voxel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VoxelType {
    /// Unsigned, 8 bit.
    U8,
    /// Signed, 8 bit.
    I8,
    /// Unsigned, 16 bit.
    U16,
    /// Signed, 16 bit.
    I16,
    /// Unsigned, 32 bit.
    U32,
    /// Signed, 32 bit.
    I32,
    /// Floating, 32 bit.
    F32,
    /// Floating, 64 bit.
    F64,
}

/// Names of the types of a voxel, what MetaIO calls them, and their bytes.
const TYPES: [(VoxelType, &str, &str, u64); 8] = [
    (VoxelType::U8, "u8", "MET_UCHAR", 1),
    (VoxelType::I8, "i8", "MET_CHAR", 1),
    (VoxelType::U16, "u16", "MET_USHORT", 2),
    (VoxelType::I16, "i16", "MET_SHORT", 2),
    (VoxelType::U32, "u32", "MET_UINT", 4),
    (VoxelType::I32, "i32", "MET_INT", 4),
    (VoxelType::F32, "f32", "MET_FLOAT", 4),
    (VoxelType::F64, "f64", "MET_DOUBLE", 8),
];

impl VoxelType {
    fn entry(self) -> (&'static str, &'static str, u64) {
        let [u8, ..] = TYPES;
        let (_, name, meta, bytes) = *TYPES.iter().find(|t| t.0 == self).unwrap_or(&u8);
        (name, meta, bytes)
    }
}

impl FromStr for VoxelType {
    type Err = VoxelTypeError;

    fn from_str(text: &str) -> Result<Self, VoxelTypeError> {
        TYPES.iter().find(|t| t.1 == text).map(|t| t.0).ok_or(VoxelTypeError)
    }
}

impl fmt::Display for VoxelType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.entry().0)
    }
}

impl Raw {
    /// Bytes of all voxels.
    fn bytes(&self) -> u64 {
        let count = self.size.iter().map(|&n| u64::from(n)).product::<u64>();
        count.saturating_mul(self.voxel.entry().2)
    }

    /// Refuses a file that cannot hold these voxels, or holds more than them.
    pub(super) fn check(&self, file: &Path) -> Result<(), AttachError> {
        let (_, length) = access::open(file).map_err(|why| AttachError::denied(file, &why))?;
        let [x, y, z] = self.size;
        let (voxel, need, skip) = (self.voxel, self.bytes(), self.skip);
        if need > 0 && length == need.saturating_add(skip) {
            return Ok(());
        }
        Err(AttachError::BadInput(format!(
            "{}: is {length} bytes long; {x} × {y} × {z} voxels of {voxel} are {need} after {skip}: give the size, type and --skip-bytes that it was written with",
            file.display()
        )))
    }

    /// Writes the voxels of `file` as a MetaImage, from slice to slice `voxel_mm` apart.
    pub(super) fn write(
        &self,
        file: &Path,
        voxel_mm: [f32; 3],
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let list = |v: [String; 3]| v.join(" ");
        write!(
            out,
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = {}\nCompressedData = False\nElementSpacing = {}\nDimSize = {}\nElementType = {}\nElementDataFile = LOCAL\n",
            if self.big_endian { "True" } else { "False" },
            list(voxel_mm.map(|mm| mm.to_string())),
            list(self.size.map(|n| n.to_string())),
            self.voxel.entry().1
        )?;
        let (mut from, _) = access::open(file).map_err(|why| io::Error::other(why.to_string()))?;
        from.seek(SeekFrom::Start(self.skip))?;
        io::copy(&mut from.take(self.bytes()), out).map(drop)
    }
}
