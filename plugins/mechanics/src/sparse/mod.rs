//! (sparse)
