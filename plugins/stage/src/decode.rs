//! The guard before every decoder of pictures, ours and those of other crates. A file says how much
//! memory it needs before any is asked for, and a decoder that panics on it has found it damaged:
//! [`decode`] makes one line of both. What is cut short must not read as sound: see [`jpeg`].

pub mod jpeg;

use crate::fault::catch_quietly;

/// A file holds at most this many times its own length: deflate and LZW pack no denser, and its
/// header lies where it says more.
const MOST_PACKED: u64 = 2000;

/// What a picture needs in memory, as its header says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PictureSize {
    /// Pixels across.
    pub width: u64,
    /// Pixels down.
    pub height: u64,
    /// Bytes that a pixel takes in memory while it is decoded.
    pub pixel_bytes: u64,
    /// Of the file, bytes.
    pub file_bytes: u64,
}

/// Largest picture that is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DecodeLimits {
    /// Pixels across or down.
    pub side: u64,
    /// Pixels.
    pub pixels: u64,
}

/// Why a picture is not decoded. Each reads on from the file's name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// No pixels, or too many.
    #[error(
        "is {0} × {1} pixels; 1 to {2} each way and at most {3} million are read: make it smaller"
    )]
    Size(u64, u64, u64, u64),
    /// More pixels than its bytes can hold.
    #[error("says {0} × {1} pixels and is only {2} bytes long: its header is damaged")]
    Header(u64, u64, u64),
    /// The decoder panicked.
    #[error("is damaged, its decoder fails on it ({0}): copy it again, or export it anew")]
    Damaged(String),
}

impl PictureSize {
    /// Whether a picture of this size is decoded.
    ///
    /// # Errors
    /// [`DecodeError`]: it is larger than the limits, or than its file can hold.
    pub fn check(&self, limits: &DecodeLimits) -> Result<(), DecodeError> {
        let Self { width, height, pixel_bytes, file_bytes } = *self;
        let pixels = width.saturating_mul(height);
        if pixels == 0 || width.max(height) > limits.side || pixels > limits.pixels {
            return Err(DecodeError::Size(width, height, limits.side, limits.pixels / 1_000_000));
        }
        if pixels.saturating_mul(pixel_bytes) > file_bytes.saturating_mul(MOST_PACKED) {
            return Err(DecodeError::Header(width, height, file_bytes));
        }
        Ok(())
    }
}

/// Decodes a picture: `header` reads its size, which is checked, and only then `pixels` unpacks it.
/// A panic of either is an error. `refused` says an error of the guard in the caller's words.
///
/// # Errors
/// What `header` and `pixels` say, or what `refused` makes of [`DecodeError`].
///
/// ```
/// use intrados_stage::decode::{DecodeError, DecodeLimits, PictureSize, decode};
/// let limits = DecodeLimits { side: 100, pixels: 10_000 };
/// let size = PictureSize { width: 10, height: 10, pixel_bytes: 1, file_bytes: 120 };
/// let sound = decode(&limits, || Ok((size, ())), |()| Ok::<_, DecodeError>(7), |why| why);
/// assert_eq!(sound, Ok(7));
/// let wide = PictureSize { width: 101, ..size };
/// let large = decode(&limits, || Ok((wide, ())), |()| -> Result<u8, _> { panic!() }, |why| why);
/// assert!(matches!(large, Err(DecodeError::Size(101, 10, ..))));
/// let damaged = decode(&limits, || Ok((size, ())), |()| -> Result<u8, _> { panic!("5") }, |why| why);
/// assert!(matches!(damaged, Err(DecodeError::Damaged(_))));
/// ```
pub fn decode<H, T, E>(
    limits: &DecodeLimits,
    header: impl FnOnce() -> Result<(PictureSize, H), E>,
    pixels: impl FnOnce(H) -> Result<T, E>,
    refused: impl Fn(DecodeError) -> E,
) -> Result<T, E> {
    let (size, begun) = guarded(header, &refused)?;
    size.check(limits).map_err(&refused)?;
    guarded(|| pixels(begun), &refused)
}

/// A part of [`decode`] by itself, where a reader takes several steps: a panic is an error.
///
/// # Errors
/// What `work` says, or what `refused` makes of [`DecodeError::Damaged`].
pub fn guarded<T, E>(
    work: impl FnOnce() -> Result<T, E>,
    refused: impl Fn(DecodeError) -> E,
) -> Result<T, E> {
    catch_quietly(work).unwrap_or_else(|fault| Err(refused(DecodeError::Damaged(fault.what))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked_before_memory() {
        let limits = DecodeLimits { side: 1000, pixels: 500_000 };
        let size =
            |width, height, file_bytes| PictureSize { width, height, pixel_bytes: 2, file_bytes };
        assert_eq!(size(500, 1000, 500).check(&limits), Ok(()));
        let cases = [
            (size(0, 5, 99), "is 0 × 5 pixels"),
            (size(1001, 1, 9999), "1 to 1000 each way"),
            (size(1000, 501, 1 << 20), "at most 0 million"),
            (size(u64::MAX, u64::MAX, 9), "pixels"),
            (size(500, 1000, 499), "only 499 bytes long"),
        ];
        for (size, said) in cases {
            let why = size.check(&limits).unwrap_err().to_string();
            assert!(why.contains(said), "{why}");
        }
    }
}
