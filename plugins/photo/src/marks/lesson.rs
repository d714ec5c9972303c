//! What the network learns from: a rendered patch as it is kept in a file.

use std::{io, path::Path};

use glam::{Vec2, Vec3};
use intrados_light::{Patch, patch::CoursePoint};
use intrados_stage::{Cancelled, Job, random::Key};

/// Kinds of damage that a pixel is labelled with.
pub(crate) const MARKS: usize = 5;

/// The brightest light that is kept, a tenth of all pixels being above 1.
const BRIGHTEST: f32 = 16.0;

/// Pixels along a side of a lesson.
pub(crate) const SIDE: usize = 192;
/// Walks a pixel: they draw alike, so that a lesson has no grain of its own.
pub(crate) const SAMPLES: u64 = 10;

/// A patch with its labels.
#[derive(Debug, Clone, PartialEq)]
pub struct Lesson {
    /// Pixels along a side.
    pub side: usize,
    /// Linear light.
    pub light: Vec<Vec3>,
    /// Shares of each pixel: crack, spall, steel, rust, efflorescence.
    pub labels: Vec<[f32; MARKS]>,
    /// Middle lines of cracks.
    pub courses: Vec<Vec<Mouth>>,
}

/// A point of a crack's middle line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mouth {
    /// Pixels from the top left.
    pub at: Vec2,
    /// Opening, pixels.
    pub width: f32,
    /// Whether nothing stands before it.
    pub visible: bool,
}

impl Lesson {
    /// The lesson `number` of `seed`, in light of at most so many `orders`
    /// ([`ORDERS`](intrados_light::patch::ORDERS); fewer to find out what they are good for).
    ///
    /// # Errors
    /// The job was cancelled.
    pub fn render(seed: u64, number: u64, orders: u32, job: &Job) -> Result<Self, Cancelled> {
        let patch = Patch::render(Key::new(seed, number), SIDE as u32, SAMPLES, orders, job)?;
        let mouth =
            |p: &CoursePoint| Mouth { at: p.at, width: p.width / patch.pixel, visible: p.visible };
        let label =
            |l: &intrados_light::patch::Label| [l.crack, l.spall, l.steel, l.rust, l.efflorescence];
        Ok(Self {
            side: SIDE,
            courses: patch.courses.iter().map(|c| c.iter().map(mouth).collect()).collect(),
            labels: patch.labels.iter().map(label).collect(),
            light: patch.radiance,
        })
    }

    /// As it is kept: light by its root in 16 bits, shares in 8.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = (self.side as u32).to_le_bytes().to_vec();
        for light in self.light.iter().flat_map(|l| l.to_array()) {
            let root = (light / BRIGHTEST).clamp(0.0, 1.0).sqrt();
            bytes.extend(((root * 65_535.0 + 0.5) as u16).to_le_bytes());
        }
        bytes.extend(self.labels.iter().flatten().map(|s| (s * 255.0 + 0.5) as u8));
        for course in &self.courses {
            bytes.extend((course.len() as u32).to_le_bytes());
            for mouth in course {
                // What is hidden has no width.
                let width = if mouth.visible { mouth.width } else { -mouth.width };
                for value in [mouth.at.x, mouth.at.y, width] {
                    bytes.extend(value.to_le_bytes());
                }
            }
        }
        bytes
    }

    /// What [`Lesson::to_bytes`] kept; `None` if that was something else.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (side, bytes) = bytes.split_first_chunk::<4>()?;
        let side = u32::from_le_bytes(*side) as usize;
        let pixels = side.checked_mul(side).filter(|&n| n < 1 << 24)?;
        let (light, bytes) = bytes.split_at_checked(6 * pixels)?;
        let (labels, mut bytes) = bytes.split_at_checked(MARKS * pixels)?;
        let value = |b: &[u8; 2]| {
            let root = f32::from(u16::from_le_bytes(*b)) / 65_535.0;
            BRIGHTEST * root * root
        };
        let light = light.as_chunks::<2>().0.as_chunks::<3>().0.iter();
        let light = light.map(|c| Vec3::from(c.each_ref().map(value))).collect();
        let labels = labels.as_chunks::<MARKS>().0.iter();
        let labels = labels.map(|l| l.map(|s| f32::from(s) / 255.0)).collect();
        let mut courses = Vec::new();
        while let Some((count, rest)) = bytes.split_first_chunk::<4>() {
            let (points, rest) = rest.split_at_checked(12 * u32::from_le_bytes(*count) as usize)?;
            let points = points.as_chunks::<4>().0.as_chunks::<3>().0.iter();
            courses.push(points.map(|p| mouth(p.map(f32::from_le_bytes))).collect());
            bytes = rest;
        }
        Some(Self { side, light, labels, courses })
    }

    /// Writes it; the file is there whole or not at all.
    ///
    /// # Errors
    /// Of the system.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let beside = path.with_extension("part");
        std::fs::write(&beside, self.to_bytes())?;
        std::fs::rename(beside, path)
    }
}

fn mouth([x, y, width]: [f32; 3]) -> Mouth {
    Mouth { at: Vec2::new(x, y), width: width.abs(), visible: width > 0.0 }
}

#[cfg(test)]
mod tests {
    use intrados_light::patch::ORDERS;

    use super::*;

    #[test]
    fn a_lesson_is_read_as_it_was_kept() {
        let lesson = Lesson::render(3, 1, ORDERS, &Job::default()).unwrap();
        let again = Lesson::from_bytes(&lesson.to_bytes()).unwrap();
        assert_eq!(again.courses, lesson.courses);
        for (a, b) in again.light.iter().zip(&lesson.light) {
            let b = b.min(Vec3::splat(BRIGHTEST));
            assert!((*a - b).abs().max_element() < 2e-4 * b.max_element().sqrt() * 4.0 + 1e-6);
        }
        for (a, b) in again.labels.iter().flatten().zip(lesson.labels.iter().flatten()) {
            assert!((a - b).abs() < 0.003);
        }
        assert_eq!(Lesson::from_bytes(&lesson.to_bytes()[..1000]), None);
    }
}
