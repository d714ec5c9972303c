//! (material)
