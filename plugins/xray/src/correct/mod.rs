//! (correct)
