//! Slices that nobody measured: drawn from planted damage, or made by the simulated scanner.

pub mod drawn;
pub mod scanned;
