//! `intrados schema`: what a scene and its evidence may hold, from the types that read it.

use intrados_scene::reference;

use crate::{
    args,
    failure::{Failure, Outcome},
    output::{json, say},
};

pub(crate) fn run(args: &args::Schema) -> Result<Outcome, Failure> {
    say(&match (args.page, args.of) {
        (true, _) => reference::page(),
        (false, args::SchemaOf::Scene) => json(&reference::schema())?,
        (false, args::SchemaOf::Evidence) => json(&reference::evidence_schema())?,
    })?;
    Ok(Outcome::Done)
}
