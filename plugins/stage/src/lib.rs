#![doc = include_str!("../README.md")]

pub mod access;
mod clock;
pub mod csv;
mod estimate;
mod fault;
pub mod file;
mod job;
mod pace;
pub mod random;
mod stages;
pub mod time;

pub use access::Access;
pub use clock::{cpu_seconds, thread_cpu_seconds};
pub use estimate::Estimate;
pub use fault::{Fault, catch};
pub use job::{Cancelled, Job, Jobs, Task, Unfinished, Work, alone, aside};
pub use pace::Pace;
pub use stages::{Stage, StagePlugin};
