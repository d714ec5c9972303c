//! What happens in one point: laws of concrete, steel and bond as pure functions.
//!
//! A law is built once from what is known of a material ([`concrete::Given`], a size of element),
//! and then asked again and again: given the state at the beginning of a step and the strain at its
//! end, what is the stress, how does it change with the strain, and what is the state at the end?
//! States are small `Copy` structs that belong to the caller; a law never changes. So a step can be
//! tried, thrown away and tried again, and a sensitivity can ask beside the path.
//!
//! | module | law | source |
//! |---|---|---|
//! | [`concrete`] | strengths, moduli, fracture energy from a class or a strength, and their growth with age | EN 1992-1-1 §3.1, fib MC2010 §5.1 |
//! | [`creep`], [`chain`] | creep and shrinkage of the codes; the Kelvin chain that computes them in O(1) a step | EN 1992-1-1 Annex B, fib MC2010 §5.1.9 |
//! | [`softening`], [`damage`] | tension and compression after the peak, regularised by the size of the element; damage | Bažant and Oh 1983, de Vree 1995 |
//! | [`cracks`] | cracks in three planes that turn while they are young, and interlock once grown | Rots and Blaauwendraad 1989, Jirásek and Zimmermann 1998, Walraven 1981, Vecchio and Collins 1986 |
//! | [`law`] | all of these in one law of ageing, creeping, cracking concrete | |
//! | [`steel`] | bars, and strands that relax | EN 1992-1-1 §3.2, §3.3 |
//! | [`bond`] | slip of bars; joints and ground are with their elements, `element::interface` and `element::spring` | fib MC2010 §6.1 |
//! | [`chloride`], [`carbonation`], [`thermal`] | what salt, air and heat do | fib Bulletin 34, fib MC2010 §7.8.3, EN 1992-1-1 Annex B |
//! | [`durability`] | the same by nothing but an exposure class, assumed and with its spread | EN 206, fib Bulletin 34, fib MC2020 |
//!
//! Units are SI without exception: Pa, m, s, K. The formulas of the codes are in MPa, mm and days;
//! the conversion happens inside.

pub mod bond;
pub(crate) mod carbonation;
pub(crate) mod chain;
pub mod chloride;
pub mod concrete;
pub(crate) mod cracks;
pub(crate) mod creep;
pub mod damage;
pub mod durability;
pub mod law;
pub(crate) mod softening;
pub mod steel;
pub(crate) mod thermal;

pub use intrados_stage::time::{DAY, YEAR};

/// Pascal in a megapascal.
pub(crate) const MPA: f64 = 1e6;

/// Why a material cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The name of a class is not one.
    #[error("`{0}` is no concrete class: write fck and fck,cube in MPa, such as C30/37")]
    UnknownClass(String),
    /// A value that no material has.
    #[error("{quantity} is {value}: give {expected}")]
    Unphysical {
        /// What is wrong.
        quantity: &'static str,
        /// What it is, SI.
        value: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// Nothing says how strong the concrete is.
    #[error("the strength of the concrete is not given: give its class, fck or fcm")]
    NoStrength,
    /// Cracks in planes know no zone.
    #[error(
        "cracks in planes are bands of elements: take the crack band, or diffuse cracks with the implicit gradient"
    )]
    NonlocalPlanes,
    /// The softening of an element this large would be steeper than its elastic unloading, so that
    /// its fracture energy cannot be kept.
    #[error(
        "element of {h:.4} m is too large for the fracture energy in {what}: refine it below {limit:.4} m"
    )]
    ElementTooLarge {
        /// Tension or compression.
        what: &'static str,
        /// Size of the element, m.
        h: f64,
        /// 2·E·G_f/f_t² (in compression 2·G_c/(f_c·ε_c1)), m.
        limit: f64,
    },
}

/// `value` if it is finite and lies in `low..=high`.
pub(crate) fn checked(
    quantity: &'static str,
    value: f64,
    low: f64,
    high: f64,
    expected: &'static str,
) -> Result<f64, Error> {
    match value.is_finite() && (low..=high).contains(&value) {
        true => Ok(value),
        false => Err(Error::Unphysical { quantity, value, expected }),
    }
}
