//! (recon)
