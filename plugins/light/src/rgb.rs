use std::ops::{Add, AddAssign, Mul};

use glam::{Vec3, Vec3A};
use intrados_transport::Value;

/// A linear Rec. 709 colour, as radiance, weight or flux.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rgb(pub Vec3A);

/// Luminance of a linear Rec. 709 colour: Y = .2126 R + .7152 G + .0722 B.
#[inline]
#[must_use]
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

impl Rgb {
    /// Black.
    pub const ZERO: Self = Self(Vec3A::ZERO);
}

impl From<Vec3> for Rgb {
    #[inline]
    fn from(v: Vec3) -> Self {
        Self(v.into())
    }
}

impl From<Rgb> for Vec3 {
    #[inline]
    fn from(c: Rgb) -> Self {
        c.0.into()
    }
}

impl Add for Rgb {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl AddAssign for Rgb {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

impl Mul for Rgb {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl Value for Rgb {
    type Real = f32;
    const ONE: Self = Self(Vec3A::ONE);
    #[inline]
    fn scale(self, factor: f32) -> Self {
        Self(self.0 * factor)
    }
    #[inline]
    fn largest(self) -> f32 {
        self.0.max_element()
    }
    #[inline]
    fn reading(self) -> f64 {
        f64::from(luminance(self.0.into()))
    }
    #[inline]
    fn is_finite(self) -> bool {
        self.0.is_finite()
    }
}
