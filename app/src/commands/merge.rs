//! `intrados merge`: shards of one work made whole.

use super::{measure, render};
use crate::{
    accumulator::{self, Content},
    args,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

pub(crate) fn run(session: &Session, args: &args::Merge) -> Result<Outcome, Failure> {
    let sum = {
        let _progress = session.watch("adding up accumulators");
        accumulator::merge(&args.files)?
    };
    if let Some(complaint) = sum.shards().complaint() {
        tracing::warn!("not the whole work: shards: {complaint}");
    }
    match &sum.content {
        Content::Picture { plate, exposure } => {
            let mut report = render::Report::of(&sum, plate);
            render::write(&mut report, plate, args.exposure.unwrap_or(*exposure), &args.out)?;
            session.print(&report, || report.table())?;
        }
        Content::Readings { .. } if args.exposure.is_some() => {
            return Err(Failure::Usage(
                "--exposure does nothing with readings, of which no picture is made: leave it out"
                    .into(),
            ));
        }
        Content::Readings { .. } => {
            let mut report = measure::Report::of(&sum)?;
            report.write(output::begin(&args.out)?)?;
            session.print(&report, || report.table())?;
        }
    }
    Ok(Outcome::Done)
}
