//! The paper's twenty cases, ours: members scanned by simulated physics, three methods on the same
//! projections, one score.
//!
//! [`case`] is the table, frozen; [`shapes`] and [`scan`] make a case physically; [`correct`] takes
//! out of a scan what it can; [`reference`] holds the methods that ours is compared with; [`score`]
//! and [`paired`] judge; [`ours`] is the method, [`apart`] what its parts are worth, [`table`] all
//! of it. [`calibration`] asks whether error bars tell the truth. `docs/table-3-1.md` tells what
//! came of it.

pub mod apart;
pub mod calibration;
pub mod case;
pub mod correct;
mod error;
pub mod ours;
pub mod paired;
pub mod reference;
pub mod scan;
pub mod scatter;
pub mod score;
pub mod shapes;
pub mod table;

pub use error::ExperimentError;
