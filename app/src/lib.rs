//! Puts the plugins together.
