#![doc = include_str!("../README.md")]

pub mod access;
mod clock;
pub mod csv;
pub mod decode;
mod estimate;
mod fault;
pub mod file;
mod job;
mod pace;
pub mod random;
pub mod sheet;
mod stages;
pub mod time;

pub use access::Access;
pub use clock::{cpu_seconds, thread_cpu_seconds};
pub use estimate::Estimate;
pub use fault::{Fault, catch};
pub use job::{Cancelled, Job, Jobs, Task, Unfinished, Work, alone, aside};
pub use pace::Pace;
pub use stages::{Stage, StagePlugin};

// Not used here. The window and the tests ask these crates of others for more than the rest of the
// program does; asked for alike everywhere, they and all that rests on them are built once.
use async_task as _;
use bytemuck as _;
use concurrent_queue as _;
use futures_core as _;
use futures_lite as _;
use getrandom as _;
use hashbrown as _;
use regex_syntax as _;
use smallvec as _;
use uuid as _;
