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
    /// Whether its scans up to there give every coefficient to its last bit: where a picture that
    /// is sent coarse first (progressive) was cut, some do not.
    pub is_fine: bool,
}

/// Which bit of each coefficient the scans have given last (T.81, G.1.1.1), of each component.
struct Progression {
    /// Names of the components.
    names: Vec<u8>,
    bits: Vec<[u8; 64]>,
}

impl Progression {
    /// Of a frame's header behind its length, if it is one of a progression.
    fn of_frame(code: u8, header: &[u8]) -> Option<Self> {
        let names: Vec<u8> = header.get(6..)?.chunks_exact(3).map(|c| c[0]).collect();
        let bits = vec![[u8::MAX; 64]; names.len()];
        [0xc2, 0xca].contains(&code).then_some(Self { names, bits })
    }

    /// Takes a scan's header behind its length.
    fn scan(&mut self, header: &[u8]) {
        let count = header.first().map_or(0, |n| usize::from(*n));
        let of = header.get(1..).unwrap_or_default().chunks_exact(2).take(count).map(|c| c[0]);
        let Some(&[first, last, bits]) = header.get(1 + 2 * count..).and_then(|h| h.first_chunk())
        else {
            return;
        };
        for name in of {
            let at = self.names.iter().position(|n| *n == name);
            let Some(own) = at.and_then(|at| self.bits.get_mut(at)) else { continue };
            let band = own.iter_mut().take(usize::from(last) + 1).skip(usize::from(first));
            band.for_each(|bit| *bit = bits & 15);
        }
    }

    fn is_fine(&self) -> bool {
        self.bits.iter().flatten().all(|bit| *bit == 0)
    }
}

/// The markers of the first picture in these bytes; `None` where they hold no frame.
///
/// ```
/// use intrados_stage::decode::jpeg;
/// let head = [0xff, 0xd8, 0xff, 0xc0, 0, 11, 8, 0, 3, 0, 5, 1, 1, 0x11, 0];
/// let scan = [0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0, 9, 9, 0xff, 0];
/// let cut = jpeg::markers(&[&head[..], &scan].concat()).unwrap();
/// assert_eq!((cut.size, cut.components, cut.is_whole), ([5, 3], 1, false));
/// assert!(cut.is_fine);
/// assert!(jpeg::markers(&[&head[..], &scan, &[0xff, 0xd9]].concat()).unwrap().is_whole);
/// assert_eq!(jpeg::markers(b"PNG"), None);
/// ```
/// A progression of one component, first without the last bit of what follows the mean:
/// ```
/// # use intrados_stage::decode::jpeg;
/// let frame = [0xff, 0xd8, 0xff, 0xc2, 0, 11, 8, 0, 3, 0, 5, 1, 1, 0x11, 0];
/// let scan = |first, last, bits| [0xff, 0xda, 0, 8, 1, 1, 0, first, last, bits, 9, 9];
/// let read = |scans: &[[u8; 12]]| jpeg::markers(&[&frame[..], &scans.concat(), &[0xff, 0xd9]].concat());
/// let coarse = [scan(0, 0, 0), scan(1, 63, 1)];
/// assert!(!read(&coarse).unwrap().is_fine);
/// assert!(read(&[&coarse[..], &[scan(1, 63, 0x10)]].concat()).unwrap().is_fine);
/// ```
#[must_use]
pub fn markers(bytes: &[u8]) -> Option<JpegMarkers> {
    let mut at = bytes.starts_with(&[0xff, 0xd8]).then_some(2)?;
    let mut found: Option<JpegMarkers> = None;
    let mut progression: Option<Progression> = None;
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
            0xd9 => {
                let is_fine = progression.is_none_or(|scans| scans.is_fine());
                return found.map(|found| JpegMarkers { is_whole: true, is_fine, ..found });
            }
            0x01 | 0xd0..=0xd8 => continue,
            _ => {}
        }
        let Some(length) =
            bytes.get(at..at + 2).map(|b| usize::from(b[0]) << 8 | usize::from(b[1]))
        else {
            return found;
        };
        let segment = bytes.get(at + 2..at + length.max(2)).unwrap_or_default();
        // Frames begin with FFC0 to FFCF, but for tables and arithmetic conditioning.
        if (0xc0..=0xcf).contains(code)
            && ![0xc4, 0xc8, 0xcc].contains(code)
            && found.is_none()
            && let Some(&[precision, h0, h1, w0, w1, components]) =
                bytes.get(at + 2..at + 8).and_then(|b| b.as_array())
        {
            let two = |a: u8, b: u8| u16::from(a) << 8 | u16::from(b);
            let size = [two(w0, w1), two(h0, h1)];
            let whole = JpegMarkers { size, components, precision, is_whole: false, is_fine: true };
            found = Some(whole);
            progression = Progression::of_frame(*code, segment);
        }
        if *code == 0xda
            && let Some(scans) = &mut progression
        {
            scans.scan(segment);
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
