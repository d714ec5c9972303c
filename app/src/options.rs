//! Which options of a command go together: one table, which the command line is held against before
//! anything is done. An option that a run would not use is refused in one line.

use std::{ffi::OsString, path::PathBuf};

use clap::{
    Arg, ArgMatches, Command, CommandFactory, FromArgMatches,
    parser::ValueSource::{CommandLine, DefaultValue},
};

use crate::args::{self, Cli};

/// Something that a command line says.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fact {
    /// This option is given.
    Given(&'static str),
    /// The first is given, the second is not.
    Alone(&'static str, &'static str),
    /// This option, given or not, has this value.
    Value(&'static str, &'static str),
    /// The file that this option names ends so.
    Ends(&'static str, &'static [&'static str]),
}
use Fact::{Alone, Ends, Given, Value};

/// When a command uses one of its options.
struct OptionRule {
    command: &'static str,
    option: &'static str,
    /// It needs one of these; none: nothing.
    needs: &'static [Fact],
    /// It does nothing with any of these.
    excludes: &'static [Fact],
}

/// Decks and meshes of other programs.
const DECKS: Fact = Ends("scene", &["inp", "msh"]);
/// A frame of beams and plates, which has neither bricks nor cracks.
const FRAME: Fact = Alone("whole", "member");
const PHOTOGRAPH: Fact = Ends("scene", &["jpg", "jpeg", "png", "tif", "tiff", "heic", "heif"]);
const TABLE: Fact = Ends("files", &["csv", "tsv", "txt"]);
const BRIDGES: Fact = Ends("over", &["csv"]);
const REPLAYED: &[Fact] = &[Given("replay")];
const GIVEN_SINOGRAM: &[Fact] = &[Given("sinogram")];
const NEVER_GUIDED: &[Fact] = &[
    Value("guide", "off"),
    Value("estimator", "analog"),
    Value("estimator", "collision"),
    Value("estimator", "last-event"),
];
const OF_CALIBRATION: &[Fact] = &[Value("name", "calibration")];
const OF_TABLE: &[Fact] = &[Value("name", "table-3-1")];
const RELIT: &[Fact] = &[Given("relight"), Given("read")];
const CORNERS: &[Fact] = &[Given("corners")];
const UNPLACED: &[Fact] = &[Given("corners"), PHOTOGRAPH];
const OF_PLAIN_FILE: &[Fact] = &[Given("pose")];
const FILES: &[Fact] = &[Given("files")];

/// A row of [`RULES`].
const fn rule(
    command: &'static str,
    option: &'static str,
    needs: &'static [Fact],
    excludes: &'static [Fact],
) -> OptionRule {
    OptionRule { command, option, needs, excludes }
}

/// An option that its command always uses, or looks after itself.
const fn free(command: &'static str, option: &'static str) -> OptionRule {
    rule(command, option, &[], &[])
}

/// Every option of every command, once.
const RULES: &[OptionRule] = &[
    free("view", "scene"),
    free("screenshot", "tab"),
    free("screenshot", "member"),
    free("screenshot", "layout"),
    free("screenshot", "size"),
    free("screenshot", "scale"),
    free("screenshot", "theme"),
    free("screenshot", "language"),
    free("screenshot", "wait"),
    free("new", "file"),
    free("new", "force"),
    free("import", "out"),
    free("import", "unit"),
    free("import", "up"),
    free("import", "kinds"),
    free("import", "year"),
    free("import", "exposure"),
    free("import", "imposed"),
    // What else goes with a finding or a file `attach` says, in the words of what is attached.
    free("attach", "files"),
    free("attach", "name"),
    free("attach", "along"),
    free("attach", "face"),
    free("attach", "angle"),
    free("attach", "height"),
    free("attach", "date"),
    free("attach", "instrument"),
    rule("attach", "picture", &[], &[Given("load_test")]),
    rule("attach", "unit", FILES, &[]),
    rule("attach", "kind", FILES, &[]),
    rule("attach", "test", FILES, &[]),
    rule("attach", "pixel_mm", FILES, &[]),
    rule("attach", "pose", FILES, &[TABLE]),
    rule("attach", "focal_px", &[Given("pose")], &[]),
    rule("attach", "stack", FILES, &[]),
    rule("attach", "voxel_mm", FILES, OF_PLAIN_FILE),
    rule("attach", "raw", FILES, OF_PLAIN_FILE),
    rule("attach", "voxel_type", &[Given("raw")], &[]),
    rule("attach", "skip_bytes", &[Given("raw")], &[]),
    rule("attach", "big_endian", &[Given("raw")], &[]),
    rule("attach", "axis", FILES, OF_PLAIN_FILE),
    free("attach", "load_test"),
    free("attach", "force_kn"),
    free("attach", "crack"),
    free("attach", "course"),
    free("attach", "length_m"),
    free("attach", "spall"),
    rule("attach", "depth_mm", &[], OF_PLAIN_FILE),
    free("attach", "bars_bare"),
    free("attach", "rust"),
    free("attach", "efflorescence"),
    free("attach", "wet"),
    free("attach", "hollow"),
    free("attach", "tapped"),
    free("attach", "intact"),
    free("attach", "cover"),
    free("attach", "half_cell"),
    rule("attach", "electrode", &[], OF_PLAIN_FILE),
    free("attach", "rebound"),
    free("attach", "velocity"),
    free("attach", "carbonation"),
    free("attach", "chloride"),
    free("attach", "of_concrete"),
    free("attach", "core_strength"),
    rule("attach", "diameter_mm", &[], OF_PLAIN_FILE),
    free("attach", "length_mm"),
    free("attach", "std_error"),
    free("attach", "confirmed"),
    free("detach", "member"),
    free("detach", "name"),
    free("detach", "list"),
    rule("schema", "of", &[], &[Given("page")]),
    free("schema", "page"),
    rule("render", "out", &[], REPLAYED),
    free("render", "camera"),
    rule("render", "exposure", &[], REPLAYED),
    free("render", "replay"),
    free("render", "cracks"),
    free("render", "planted"),
    rule("render", "widen", &[Given("cracks"), Given("planted")], &[]),
    free("render", "width"),
    free("render", "height"),
    free("render", "side"),
    free("render", "estimator"),
    free("render", "max_depth"),
    free("render", "roulette_from"),
    free("render", "roulette"),
    rule("render", "guide", &[], REPLAYED),
    rule("render", "guide_from", &[], NEVER_GUIDED),
    free("render", "learn_only"),
    free("render", "seed"),
    rule("render", "spp", &[], REPLAYED),
    rule("render", "time_limit", &[], REPLAYED),
    rule("render", "target_rel_error", &[], REPLAYED),
    rule("render", "shard", &[], REPLAYED),
    rule("render", "checkpoint", &[], REPLAYED),
    free("render", "checkpoint_every"),
    rule("render", "resume", &[], REPLAYED),
    free("measure", "out"),
    free("measure", "all"),
    free("measure", "sensor"),
    rule("measure", "explain", &[], NEVER_GUIDED),
    free("measure", "width"),
    free("measure", "height"),
    free("measure", "side"),
    free("measure", "estimator"),
    free("measure", "max_depth"),
    free("measure", "roulette_from"),
    free("measure", "roulette"),
    free("measure", "guide"),
    rule("measure", "guide_from", &[], NEVER_GUIDED),
    free("measure", "learn_only"),
    free("measure", "seed"),
    free("measure", "spp"),
    free("measure", "time_limit"),
    free("measure", "target_rel_error"),
    free("measure", "shard"),
    free("measure", "checkpoint"),
    free("measure", "checkpoint_every"),
    free("measure", "resume"),
    rule("analyze", "units", &[DECKS], &[]),
    rule("analyze", "groups", &[Ends("scene", &["msh"])], &[]),
    rule("analyze", "member", &[], &[DECKS, Given("redundancy")]),
    rule("analyze", "whole", &[], &[DECKS]),
    free("analyze", "redundancy"),
    rule("analyze", "element", &[], &[DECKS, FRAME]),
    rule("analyze", "fine", &[], &[DECKS, FRAME]),
    free("analyze", "fine_element"),
    rule("analyze", "tolerance", &[], &[FRAME]),
    rule("analyze", "to_failure", &[], &[DECKS, FRAME]),
    rule("analyze", "regularise", &[], &[FRAME]),
    rule("analyze", "length", &[Value("regularise", "gradient")], &[FRAME]),
    rule("analyze", "crack_law", &[], &[FRAME]),
    free("analyze", "out"),
    free("scan", "scene"),
    free("scan", "out"),
    rule("scan", "scanner", &[Given("scene")], &[]),
    rule("scan", "member", &[Given("scene")], &[]),
    rule("scan", "along", &[Given("scene")], &[]),
    free("scan", "cracks"),
    rule("scan", "projections", &[], GIVEN_SINOGRAM),
    free("scan", "size"),
    rule("scan", "slices", &[Given("scene")], &[]),
    rule("scan", "beam", &[], GIVEN_SINOGRAM),
    free("scan", "correct"),
    rule("scan", "seed", &[Given("scene")], &[]),
    free("scan", "sinogram"),
    free("scan", "geometry"),
    free("scan", "by_row"),
    free("scan", "pixel_mm"),
    free("scan", "arc_deg"),
    rule("scan", "source_m", &[Value("geometry", "fan"), Value("geometry", "cone")], &[]),
    rule("scan", "detector_m", &[Value("geometry", "fan"), Value("geometry", "cone")], &[]),
    free("scan", "axis_bin"),
    free("detect", "truth"),
    free("detect", "pixel_mm"),
    free("detect", "method"),
    free("detect", "strict"),
    free("detect", "out"),
    free("photo", "files"),
    rule("photo", "pose", &[], &[PHOTOGRAPH]),
    rule("photo", "corners", &[], &[PHOTOGRAPH]),
    rule("photo", "member", &[], UNPLACED),
    rule("photo", "mm_per_px", &[], CORNERS),
    rule("photo", "series", &[], UNPLACED),
    rule("photo", "focal_px", &[], UNPLACED),
    rule("photo", "picking_px", &[], UNPLACED),
    rule("photo", "relight", &[], UNPLACED),
    rule("photo", "read", &[], CORNERS),
    rule("photo", "light", &[Given("read")], UNPLACED),
    rule("photo", "spp", RELIT, UNPLACED),
    rule("photo", "shadow_error_mm", RELIT, UNPLACED),
    rule("photo", "seed", RELIT, UNPLACED),
    rule("photo", "out", &[], CORNERS),
    free("predict", "profile"),
    free("predict", "method"),
    free("predict", "ahead"),
    free("predict", "element"),
    free("predict", "no_forecast"),
    free("predict", "strength"),
    free("predict", "strict"),
    free("predict", "spp"),
    rule("predict", "seed", &[], &[Value("spp", "0")]),
    free("predict", "ifc"),
    free("predict", "pdf"),
    free("predict", "out"),
    free("predict", "structure"),
    free("predict", "owner"),
    free("predict", "inspector"),
    free("predict", "place"),
    free("predict", "purpose"),
    free("predict", "inspected"),
    rule("experiment", "cases", &[], OF_CALIBRATION),
    rule("experiment", "ablations", &[], OF_CALIBRATION),
    rule("experiment", "corrections", &[], OF_CALIBRATION),
    rule("experiment", "rehearsal", &[], OF_CALIBRATION),
    rule("experiment", "scenes", &[], OF_TABLE),
    rule("experiment", "plantings", &[], OF_TABLE),
    free("experiment", "out"),
    free("merge", "exposure"),
    free("merge", "out"),
    free("campaign new", "split"),
    rule("campaign new", "each_member", &[], &[BRIDGES]),
    rule("campaign new", "life", &[BRIDGES], &[]),
    rule("campaign new", "now", &[BRIDGES], &[]),
    rule("campaign new", "ahead", &[BRIDGES], &[]),
    rule("campaign new", "first", &[BRIDGES], &[]),
    rule("campaign new", "rest", &[], &[BRIDGES]),
    free("campaign run", "unit"),
    free("campaign run", "part"),
    free("campaign collect", "out"),
    free("campaign collect", "partial"),
    free("campaign launch", "slurm"),
    free("campaign launch", "hyperqueue"),
    free("campaign launch", "kubernetes"),
    free("campaign launch", "local"),
    free("campaign launch", "tasks"),
    free("campaign launch", "cores"),
    rule("campaign launch", "image", &[Given("kubernetes")], &[]),
    rule("campaign launch", "claim", &[Given("kubernetes")], &[]),
    free("campaign launch", "submit"),
];

/// Options of `analyze` that a deck of solids does not use, which is linear. Whether a deck is one
/// says its content.
const OF_MEMBERS: [&str; 4] = ["tolerance", "regularise", "length", "crack_law"];

/// Why a command line is not taken.
#[derive(Debug)]
pub(crate) enum Unread {
    /// It does not read as one, or asks for help.
    Words(clap::Error),
    /// An option would not be used: one line.
    Unused(String),
}

impl From<clap::Error> for Unread {
    fn from(error: clap::Error) -> Self {
        Self::Words(error)
    }
}

/// Reads a command line and holds it against the table.
pub(crate) fn read(words: impl IntoIterator<Item = OsString>) -> Result<Cli, Unread> {
    let matches = Cli::command().try_get_matches_from(words)?;
    let mut cli = Cli::from_arg_matches(&matches)?;
    let root = Cli::command();
    let (mut name, mut command, mut inner) = (String::new(), &root, &matches);
    while let Some((word, theirs)) = inner.subcommand() {
        name = if name.is_empty() { word.to_owned() } else { format!("{name} {word}") };
        let Some(found) = command.find_subcommand(word) else { break };
        (command, inner) = (found, theirs);
    }
    let said = Said { command, matches: inner };
    if let Some(line) = said.unused(&name).or_else(|| said.led_astray()) {
        return Err(Unread::Unused(line));
    }
    if let Some(args::Command::Analyze(analyze)) = &mut cli.command {
        analyze.of_members = OF_MEMBERS
            .into_iter()
            .filter(|id| said.is_given(id))
            .map(|id| said.shown(id))
            .collect();
    }
    Ok(cli)
}

/// A command and what was said to it.
struct Said<'a> {
    command: &'a Command,
    matches: &'a ArgMatches,
}

impl Said<'_> {
    /// The first option that is given and would not be used.
    fn unused(&self, name: &str) -> Option<String> {
        let mut given = RULES.iter().filter(|r| r.command == name && self.is_given(r.option));
        given.find_map(|rule| {
            let option = self.shown(rule.option);
            if let Some(with) = rule.excludes.iter().find(|fact| self.holds(fact)) {
                let with = self.words(with);
                return Some(format!(
                    "{option} does nothing with {with}: leave one of the two out"
                ));
            }
            if rule.needs.is_empty() || rule.needs.iter().any(|fact| self.holds(fact)) {
                return None;
            }
            let needs: Vec<String> = rule.needs.iter().map(|fact| self.words(fact)).collect();
            Some(format!("{option} needs {}: add that, or leave {option} out", needs.join(" or ")))
        })
    }

    /// A folder that nobody has named, and that a link leads out of.
    fn led_astray(&self) -> Option<String> {
        let is_default = self.argument("out").is_some()
            && self.matches.value_source("out") == Some(DefaultValue);
        let out =
            self.matches.try_get_one::<PathBuf>("out").ok().flatten().filter(|_| is_default)?;
        let is_link = std::fs::symlink_metadata(out).is_ok_and(|facts| facts.is_symlink());
        let out = out.display();
        is_link.then(|| format!("{out}: is a link to another folder: name that one with --out"))
    }

    fn argument(&self, id: &str) -> Option<&Arg> {
        self.command.get_arguments().find(|arg| arg.get_id() == id)
    }

    fn is_given(&self, id: &str) -> bool {
        self.argument(id).is_some() && self.matches.value_source(id) == Some(CommandLine)
    }

    fn holds(&self, fact: &Fact) -> bool {
        let values = |id: &str| -> Vec<String> {
            let raw = self.argument(id).and_then(|_| self.matches.get_raw(id));
            raw.into_iter().flatten().map(|word| word.to_string_lossy().into_owned()).collect()
        };
        match *fact {
            Given(id) => self.is_given(id),
            Alone(id, without) => self.is_given(id) && !self.is_given(without),
            Value(id, value) => values(id).iter().any(|word| word == value),
            Ends(id, endings) => values(id).iter().any(|word| {
                let ending = word.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
                ending.is_some_and(|ending| endings.contains(&ending.as_str()))
            }),
        }
    }

    /// An option as it is written.
    fn shown(&self, id: &str) -> String {
        let argument = self.argument(id);
        match argument.and_then(Arg::get_long) {
            Some(long) => format!("--{long}"),
            None => {
                let name = argument.and_then(Arg::get_value_names).and_then(|names| names.first());
                name.map_or_else(|| id.to_uppercase(), ToString::to_string)
            }
        }
    }

    fn words(&self, fact: &Fact) -> String {
        match *fact {
            Given(id) => self.shown(id),
            Alone(id, without) => format!("{} without {}", self.shown(id), self.shown(without)),
            Value(id, value) => match self.argument(id).is_some_and(Arg::is_positional) {
                true => value.to_owned(),
                false => format!("{} {value}", self.shown(id)),
            },
            Ends(id, endings) => {
                let endings: Vec<String> = endings.iter().map(|e| format!(".{e}")).collect();
                format!("{} that ends in {}", self.shown(id), endings.join(" or "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::error::ErrorKind;

    use super::*;

    /// Commands without commands of their own, by their words.
    fn commands(of: &Command, name: &str) -> Vec<(String, Command)> {
        let mut all = Vec::new();
        for sub in of.get_subcommands().filter(|sub| sub.get_name() != "help") {
            let name = format!("{name} {}", sub.get_name()).trim().to_owned();
            if sub.has_subcommands() {
                all.extend(commands(sub, &name));
            } else {
                all.push((name, sub.clone()));
            }
        }
        all
    }

    fn is_optional(arg: &Arg) -> bool {
        let common = ["help", "version", "format", "quiet", "verbose", "threads", "allow"];
        !arg.is_required_set() && !common.contains(&arg.get_id().as_str())
    }

    fn ids(fact: &Fact) -> Vec<&'static str> {
        match *fact {
            Given(id) | Value(id, _) | Ends(id, _) => vec![id],
            Alone(id, without) => vec![id, without],
        }
    }

    /// A new option is not taken before somebody has said what uses it.
    #[test]
    fn every_option_of_every_command_stands_in_the_table_once() {
        let mut there = BTreeSet::new();
        for (name, command) in commands(&Cli::command(), "") {
            let known = |id: &str| command.get_arguments().any(|arg| arg.get_id() == id);
            for arg in command.get_arguments().filter(|arg| is_optional(arg)) {
                let id = arg.get_id().as_str();
                let count = RULES.iter().filter(|r| r.command == name && r.option == id).count();
                assert_eq!(count, 1, "{name}: {id}");
                there.insert((name.clone(), id.to_owned()));
            }
            for rule in RULES.iter().filter(|r| r.command == name) {
                let named = rule.needs.iter().chain(rule.excludes).flat_map(ids);
                named.for_each(|id| assert!(known(id), "{name}: {} names {id}", rule.option));
            }
        }
        for rule in RULES {
            let row = (rule.command.to_owned(), rule.option.to_owned());
            assert!(there.contains(&row), "{row:?} is no option");
        }
    }

    /// What makes a fact true, as words of the command line: options, and what stands without one.
    fn stated(fact: &Fact, of: &Said) -> Vec<String> {
        match *fact {
            Given(id) | Alone(id, _) => sample(of, id),
            Value(id, value) => match of.argument(id).is_some_and(Arg::is_positional) {
                true => vec![value.to_owned()],
                false => vec![format!("{}={value}", of.shown(id))],
            },
            Ends(id, endings) => match of.argument(id).is_some_and(Arg::is_positional) {
                true => vec![format!("x.{}", endings[0])],
                false => vec![format!("{}=x.{}", of.shown(id), endings[0])],
            },
        }
    }

    /// An option with a value that it takes.
    fn sample(of: &Said, id: &str) -> Vec<String> {
        let Some(arg) = of.argument(id) else { panic!("{id}") };
        let values = [
            "1",
            "0.5",
            "0.001",
            "0.4..0.6",
            "1..2",
            "0/2",
            "1,1,1",
            "1,1",
            "m,N",
            "2026-05-03",
            "2000",
            "8",
            "64",
            "XC4",
            "column",
            "front",
            "all",
            "1s",
        ];
        let possible = arg.get_possible_values();
        let takes =
            arg.get_num_args().is_none_or(|n| n.takes_values()) && arg.get_action().takes_values();
        if arg.is_positional() {
            return vec!["x".into()];
        }
        if !takes {
            return vec![of.shown(id)];
        }
        if let Some(value) = possible.first() {
            return vec![format!("{}={}", of.shown(id), value.get_name())];
        }
        // The first that it reads.
        let said = |value: &str| format!("{}={value}", of.shown(id));
        let reads = |value: &&&str| {
            let words = ["x".to_owned(), said(value)];
            let error = of.command.clone().try_get_matches_from(words).err();
            let refused = [ErrorKind::ValueValidation, ErrorKind::InvalidValue];
            error.is_none_or(|error| !refused.contains(&error.kind()))
        };
        let value = values.iter().find(reads);
        vec![said(value.unwrap_or_else(|| panic!("{id}: no sample")))]
    }

    /// What a command needs in any case, unless it is said already.
    fn required(of: &Said, words: &[String]) -> Vec<String> {
        let mut all = Vec::new();
        let plain = words.iter().filter(|word| !word.starts_with('-')).count();
        let mut skipped = 0;
        for arg in of.command.get_arguments().filter(|arg| arg.is_required_set()) {
            let id = arg.get_id().as_str();
            let named = arg.get_long().map(|long| format!("--{long}"));
            if arg.is_positional() {
                skipped += 1;
                if skipped > plain {
                    let value = arg.get_possible_values();
                    all.push(value.first().map_or("x".into(), |v| v.get_name().to_owned()));
                }
            } else if !words.iter().any(|w| named.as_ref().is_some_and(|n| w.starts_with(n))) {
                match id {
                    "over" => all.push("--over=x.ron".to_owned()),
                    _ => all.extend(sample(of, id)),
                }
            }
        }
        all
    }

    /// What is said of a command line: none, it is taken.
    fn refusal(name: &str, words: &[String]) -> Option<Unread> {
        let all = std::iter::once("intrados").chain(name.split(' ')).map(OsString::from);
        read(all.chain(words.iter().map(OsString::from))).err()
    }

    /// Every pair of the table is refused in one line that names both, by the table or already by
    /// clap, whose own rules come first. `attach`, whose words stand in an order, is tried below.
    #[test]
    fn options_that_a_run_would_not_use_are_refused() {
        let root = Cli::command();
        let empty = root.clone().try_get_matches_from(["intrados"]).unwrap();
        let mut pairs = 0;
        for (name, mut command) in commands(&root, "").into_iter().filter(|c| c.0 != "attach") {
            command.build();
            let of = Said { command: &command, matches: &empty };
            let optional = |r: &&OptionRule| {
                r.command == name && !of.argument(r.option).is_some_and(Arg::is_positional)
            };
            for rule in RULES.iter().filter(optional) {
                let option = of.shown(rule.option);
                let mut refused = |before: Vec<String>, names: &[&str]| {
                    let words = [before, sample(&of, rule.option)].concat();
                    let all = [required(&of, &words), words].concat();
                    match refusal(&name, &all) {
                        None => panic!("{name} {all:?} is taken"),
                        Some(Unread::Words(_)) => {}
                        Some(Unread::Unused(line)) => {
                            names.iter().for_each(|n| assert!(line.contains(n), "{all:?}: {line}"));
                            pairs += 1;
                        }
                    }
                };
                if !rule.needs.is_empty() {
                    refused(Vec::new(), &[&option]);
                }
                for fact in rule.excludes {
                    // What it needs besides does not make it useful.
                    let needed = rule.needs.first().map_or(Vec::new(), |need| stated(need, &of));
                    let words = stated(fact, &of).into_iter().chain(needed).collect();
                    let with = of.words(fact);
                    let with = with.split(' ').next().unwrap_or_default();
                    let names = [with, &option];
                    refused(words, if rule.needs.is_empty() { &names } else { &names[..1] });
                }
            }
        }
        assert!(pairs > 50, "{pairs}");
    }

    #[test]
    fn what_belongs_together_is_taken() {
        for line in [
            "analyze x.ron --whole --member B1 --element 0.1 --to-failure",
            "analyze x.ron --member B1 --regularise gradient --length 0.05 --crack-law diffuse",
            "analyze x.msh --units m,N --groups g.ron",
            "experiment table-3-1 --cases 1..2 --ablations --rehearsal 3",
            "experiment calibration --scenes column --plantings 2",
            "campaign new d --command predict --over b.csv --now 2030 --life full --ahead 5 --first 2",
            "campaign new d --command measure --over door -- --spp 64",
            "photo x.jpg --read --out o",
            "photo s.ron x.jpg --pose p.csv --read --light none --spp 4",
            "scan s.ron --sinogram v.tif --member P1 --along 0.3 --slices 2",
            "render column --planted --widen 3",
            "attach b P1 core.tif --depth-mm 3 --axis down",
        ] {
            let words: Vec<String> = line.split(' ').map(String::from).collect();
            let why = refusal(&words[0], &words[1..]);
            assert!(why.is_none(), "{line}: {why:?}");
        }
        for (line, with) in [
            ("attach b P1 --load-test t --force-kn 9 --picture p.png", "--load-test"),
            ("attach b P1 a.jpg --pose p.csv --axis down", "--pose"),
            ("attach b P1 a.jpg --pose p.csv --electrode calomel", "--pose"),
            ("attach b P1 a.csv --pose p.csv", ".csv"),
            ("campaign launch d --slurm --image x", "--kubernetes"),
            ("analyze x.ron --length 0.05", "--regularise gradient"),
            ("analyze x.inp --units m,N --fine 0.4..0.6", ".inp"),
            ("photo x.jpg --read --seed 3", "FILE"),
        ] {
            let words: Vec<String> = line.split(' ').map(String::from).collect();
            let Some(Unread::Unused(why)) = refusal(&words[0], &words[1..]) else {
                panic!("{line}");
            };
            assert!(why.contains(with) || with == "FILE", "{line}: {why}");
        }
    }
}
