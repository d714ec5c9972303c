use std::ops::{Add, AddAssign, Div, Mul, Sub};

/// The numbers of densities and probabilities: `f32` where speed counts, `f64` where exactness
/// does.
pub trait Real:
    Copy
    + Default
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// The smallest normal number above 0.
    const LEAST: Self;
    /// Nearest number.
    fn of(x: f64) -> Self;
    /// As `f64`.
    fn get(self) -> f64;
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const LEAST: Self = Self::MIN_POSITIVE;
    fn of(x: f64) -> Self {
        x as Self
    }
    fn get(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const LEAST: Self = Self::MIN_POSITIVE;
    fn of(x: f64) -> Self {
        x
    }
    fn get(self) -> f64 {
        self
    }
}

/// What a walk carries and scores: a number, a colour, an energy spectrum.
pub trait Value:
    Copy + Default + Send + Sync + Add<Output = Self> + AddAssign + Mul<Output = Self> + 'static
{
    /// The numbers that scale it.
    type Real: Real;
    /// 1 in every channel.
    const ONE: Self;
    /// Every channel times `factor`.
    fn scale(self, factor: Self::Real) -> Self;
    /// The largest channel: zero only if all are.
    fn largest(self) -> Self::Real;
    /// The one number that a meter reads from it (luminance Y of a colour).
    fn reading(self) -> f64;
    /// Whether every channel is a finite number.
    fn is_finite(self) -> bool;
}

impl Value for f64 {
    type Real = Self;
    const ONE: Self = 1.0;
    fn scale(self, factor: Self) -> Self {
        self * factor
    }
    fn largest(self) -> Self {
        self
    }
    fn reading(self) -> f64 {
        self
    }
    fn is_finite(self) -> bool {
        Self::is_finite(self)
    }
}
