//! (volume)
