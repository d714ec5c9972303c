//! Where a hit is, how far that may be wrong, and where the next ray has to start.
