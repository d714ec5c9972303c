//! (element)
