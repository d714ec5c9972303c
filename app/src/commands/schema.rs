//! `intrados schema`: what a scene may hold, from the types that read it.

use intrados_scene::reference;

use crate::{
    args,
    failure::{Failure, Outcome},
    output::{json, say},
};

pub(crate) fn run(args: &args::Schema) -> Result<Outcome, Failure> {
    say(&if args.page { reference::page() } else { json(&reference::schema())? })?;
    Ok(Outcome::Done)
}
