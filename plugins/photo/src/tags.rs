//! AprilTags of the family 36h11 (Olson 2011; Wang and Olson 2016) that were stuck on members: a
//! table says which one is where, the photograph where its corners are.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::{Photograph, Pick};

/// A tag that a table places.
#[derive(Debug, Clone, PartialEq)]
pub struct TagAt {
    /// Name of the photograph's file; `None`: of every one.
    pub photo: Option<String>,
    /// Its number in the family.
    pub number: usize,
    /// Of its black square, as it is read upright: lower left, lower right, upper right, upper
    /// left, m.
    pub corners: [DVec3; 4],
}

/// Picks of the tags that a photograph shows, four each. A number that it shows twice is nobody's.
#[must_use]
pub fn picks<'a>(photograph: &Photograph, tags: impl IntoIterator<Item = &'a TagAt>) -> Vec<Pick> {
    let tags: Vec<&TagAt> = tags.into_iter().collect();
    if tags.is_empty() {
        return Vec::new();
    }
    let found = found(photograph);
    let of = |tag: &&TagAt| {
        let [pixels] = found.get(&tag.number)?.as_slice() else { return None };
        let picks = pixels.iter().zip(tag.corners);
        Some(picks.map(|(pixel, place)| Pick { pixel: *pixel, place }).collect::<Vec<_>>())
    };
    tags.iter().filter_map(of).flatten().collect()
}

#[cfg(unix)]
/// Where a photograph shows tags, by number.
fn found(photograph: &Photograph) -> BTreeMap<usize, Vec<[[f64; 2]; 4]>> {
    use apriltag::{DetectorBuilder, Family, Image};

    use crate::picture::srgb;

    /// Quads are looked for in a picture of so many pixels at most; their edges in the whole one.
    const ENOUGH: f64 = 6e6;
    /// Bits that may be wrong of the 36; two tags differ in eleven.
    const WRONG_BITS: usize = 1;
    /// Least mean contrast of a tag's squares, of 255.
    const CLEAR: f32 = 15.0;

    let [width, height] = photograph.size;
    let image = Image::zeros_with_alignment(width as usize, height as usize, 96);
    let detector = DetectorBuilder::new().add_family_bits(Family::tag_36h11(), WRONG_BITS).build();
    // Both fail for want of memory alone.
    let (Ok(mut image), Ok(mut detector)) = (image, detector) else { return BTreeMap::new() };
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        // Of green, which cameras see most sharply.
        let green = photograph.light(x, y).map_or(0.0, |light| light.y);
        image[(x as usize, y as usize)] = srgb(green);
    }
    let pixels = f64::from(width) * f64::from(height);
    detector.set_decimation((pixels / ENOUGH).sqrt().ceil() as f32);
    let mut found: BTreeMap<usize, Vec<[[f64; 2]; 4]>> = BTreeMap::new();
    for tag in detector.detect(&image).iter().filter(|tag| tag.decision_margin() > CLEAR) {
        found.entry(tag.id()).or_default().push(tag.corners());
    }
    found
}

#[cfg(not(unix))]
/// Nothing: the reader of tags is not built here.
fn found(_photograph: &Photograph) -> BTreeMap<usize, Vec<[[f64; 2]; 4]>> {
    BTreeMap::new()
}
