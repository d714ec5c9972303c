//! Data that the program carries with it, made by this project: each folder says how, and under
//! which licence. No code.

/// Of X-rays; `xray/README.md` has their columns and sources.
pub mod xray {
    /// Spectra of bare tubes by voltage, CSV.
    pub const TUBE: &str = include_str!("../xray/tube.csv");
    /// μ/ρ of materials by energy, CSV.
    pub const ATTENUATION: &str = include_str!("../xray/attenuation.csv");
    /// Scattering functions and form factors of materials, CSV.
    pub const FORMS: &str = include_str!("../xray/form.csv");
}

/// Weights of the networks that read CT slices, little-endian 32-bit floats; `ct/README.md`.
pub mod ct {
    /// Of slices of cores.
    pub static CORES: &[u8] = include_bytes!("../ct/unet.f32");
    /// Of scans of members.
    pub static MEMBERS: &[u8] = include_bytes!("../ct/member.f32");
}

/// Weights of the networks that read photographs, little-endian 32-bit floats; `photo/README.md`.
pub mod photo {
    /// Of cracks.
    pub static CRACKS: &[u8] = include_bytes!("../photo/photo.f32");
    /// Of missing cover, bared steel, rust and efflorescence.
    pub static AREAS: &[u8] = include_bytes!("../photo/areas.f32");
}

/// Name and RON of each grading profile; the first holds where nobody names another.
pub const GRADING: [(&str, &str); 2] = [
    ("four_states", include_str!("../grading/four_states.ron")),
    ("tight_cracks", include_str!("../grading/tight_cracks.ron")),
];

/// What the window says in German and in Chinese, by what it says in English: file and RON.
pub const WORDS: [(&str, &str); 6] = [
    ("common.ron", include_str!("../words/common.ron")),
    ("files.ron", include_str!("../words/files.ron")),
    ("window.ron", include_str!("../words/window.ron")),
    ("member.ron", include_str!("../words/member.ron")),
    ("terms.ron", include_str!("../words/terms.ron")),
    ("told.ron", include_str!("../words/told.ron")),
];
