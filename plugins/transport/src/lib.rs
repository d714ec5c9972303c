#![doc = include_str!("../README.md")]

pub mod check;
pub mod chi2;
mod exact;
pub mod field;
pub mod matrix;
mod perturbation;
mod problem;
pub mod process;
mod reach;
mod stats;
mod value;
pub mod verify;
mod walk;

pub use check::Check;
pub use exact::{Exact, power_of_two};
pub use field::Field;
pub use perturbation::{
    Change, Perturbed, Sensitivities, SensitivityTally, differentiate, remainders, severity,
};
pub use problem::{
    Ends, Links, RealOf, Side, States, Steps, TransportProblem, dimension, keep, spread,
};
pub use process::{
    Course, Process, Residual, Round, STEERED_COST, Schedule, Steering, Trace, Walked, Watched,
    alternate, watch,
};
pub use reach::{Arrivals, Reach, Unmet, unmet};
pub use stats::{
    Combined, Converged, Moments, Scores, WalkEstimate, combine, duality_z, figure_of_merit,
};
pub use value::{Real, Value};
pub use walk::{
    BATCH, Estimator, Nobody, Roulette, Tally, WalkObserver, WalkRule, Workspace, measure, run,
    run_watched,
};

/// What another physics implements, and what it is implemented with.
pub mod prelude {
    pub use crate::{
        Ends, Links, Perturbed, Side, States, Steps, TransportProblem, dimension, keep, spread,
    };
}
