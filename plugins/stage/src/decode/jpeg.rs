//! The markers of a JPEG (ITU-T T.81, annex B): its size, and whether it is there to its end. A
//! decoder fills in grey what a file that was cut short lacks, and says nothing.

/// What the markers say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JpegMarkers {
    /// Pixels across and down, of the first frame.
    pub size: [u16; 2],
    /// Colours.
    pub components: u8,
    /// Bits of a colour.
    pub precision: u8,
    /// Whether its end is there: the marker EOI after its scans.
    pub is_whole: bool,
}

/// The markers of the first picture in these bytes; `None` where they hold no frame.
///
/// ```
/// use intrados_stage::decode::jpeg;
/// let head = [0xff, 0xd8, 0xff, 0xc0, 0, 11, 8, 0, 3, 0, 5, 1, 1, 0x11, 0];
/// let scan = [0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0, 9, 9, 0xff, 0];
/// let cut = jpeg::markers(&[&head[..], &scan].concat()).unwrap();
/// assert_eq!((cut.size, cut.components, cut.is_whole), ([5, 3], 1, false));
/// assert!(jpeg::markers(&[&head[..], &scan, &[0xff, 0xd9]].concat()).unwrap().is_whole);
/// assert_eq!(jpeg::markers(b"PNG"), None);
/// ```
#[must_use]
pub fn markers(bytes: &[u8]) -> Option<JpegMarkers> {
    let mut at = bytes.starts_with(&[0xff, 0xd8]).then_some(2)?;
    let mut found: Option<JpegMarkers> = None;
    loop {
        // Any number of fill bytes may precede a marker's code.
        let step = bytes.get(at..).and_then(|rest| rest.iter().position(|b| *b != 0xff));
        let Some(code) = step.filter(|step| *step > 0).and_then(|step| {
            at += step;
            bytes.get(at)
        }) else {
            // The end of the file, or bytes between segments that are no marker.
            return found;
        };
        at += 1;
        match code {
            0xd9 => return found.map(|found| JpegMarkers { is_whole: true, ..found }),
            0x01 | 0xd0..=0xd8 => continue,
            _ => {}
        }
        let Some(length) =
            bytes.get(at..at + 2).map(|b| usize::from(b[0]) << 8 | usize::from(b[1]))
        else {
            return found;
        };
        // Frames begin with FFC0 to FFCF, but for tables and arithmetic conditioning.
        if (0xc0..=0xcf).contains(code)
            && ![0xc4, 0xc8, 0xcc].contains(code)
            && found.is_none()
            && let Some(&[precision, h0, h1, w0, w1, components]) =
                bytes.get(at + 2..at + 8).and_then(|b| b.as_array())
        {
            let two = |a: u8, b: u8| u16::from(a) << 8 | u16::from(b);
            let size = [two(w0, w1), two(h0, h1)];
            found = Some(JpegMarkers { size, components, precision, is_whole: false });
        }
        at += length.max(2);
        if *code == 0xda {
            at += scan_length(bytes.get(at..).unwrap_or_default());
        }
    }
}

/// Bytes of a scan's data, up to the marker that ends it.
fn scan_length(bytes: &[u8]) -> usize {
    let mut at = 0;
    while let Some(next) = bytes.get(at..).and_then(|rest| rest.iter().position(|b| *b == 0xff)) {
        at += next;
        match bytes.get(at + 1) {
            // A byte FF of the data, a restart marker, or a fill byte.
            Some(0 | 0xd0..=0xd7) => at += 2,
            Some(0xff) => at += 1,
            Some(_) => return at,
            None => break,
        }
    }
    bytes.len()
}
