//! Symmetric tensors as six numbers: xx, yy, zz, xy, yz, zx.

/// Stress (Pa) or strain (engineering shear, γ = 2ε) in the order xx, yy, zz, xy, yz, zx.
pub type Voigt = [f64; 6];

/// ∂stress/∂strain, row = stress component.
pub type Tangent = [[f64; 6]; 6];
