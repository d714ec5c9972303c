//! Campaigns: work over many structures, or long work on one, as units that any scheduler can run.
//!
//! A *plan* lists pure units; a unit's id is a hash of all that its result depends on. A unit is an
//! ordinary command that is run for a part of the work, in a folder of its own that gets its place
//! by a rename once the result is whole. So workers share nothing but a folder, need not know each
//! other, and may be killed at any moment. What is *collected* is added up in the plan's order.

mod collect;
mod folder;
mod launch;
mod network;
mod page;
mod plan;
mod table;
mod unit;

pub(crate) use collect::{Collected, collect, few, states};
pub(crate) use folder::{Folder, State};
pub(crate) use launch::{Engine, Wish, job_files};
pub(crate) use page::{items, state_names};
pub(crate) use plan::{Plan, plan};
pub(crate) use table::{Rows, cell};
pub(crate) use unit::{Did, run};
