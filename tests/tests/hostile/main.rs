//! Every reader of files, fed with bytes that nobody means well with: whatever they are, they end
//! in a value or in one line that says what is wrong, never in a panic, without an end, or in all
//! the memory of the machine.
//!
//! Each reader is one function of bytes (`readers`), its corpus what is good (made by our own
//! writers) and what once went wrong; `mutate` damages them. The gate tries some hundred inputs a
//! reader, the same in every run; `INTRADOS_FUZZ=50` tries fifty times as many (ten minutes and
//! more), and `INTRADOS_CORPUS` names a folder with files of other people, which are tried and
//! damaged too. What fails is kept, and its file named.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod mutate;
mod readers;

use std::{
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    sync::mpsc,
    time::Duration,
};

use intrados_stage::random::Key;
use readers::{READERS, Reader};

/// Addresses of the whole test, bytes: a reader that asks for more ends it.
const MEMORY: u64 = 8 << 30;
/// Memory that the process holds at most, bytes, with all readers that are attacked side by side.
const RESIDENT: u64 = 1 << 30;
/// Far beyond what the slowest input takes on a busy machine: it does not come back.
const PATIENCE: Duration = Duration::from_secs(240);

/// Feeds a reader, somewhere where it can be waited for; the input is kept where it fails.
fn feed(reader: &Reader, bytes: &[u8], name: &str) -> Result<(), String> {
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join(format!("hostile-{}-{name}.{}", reader.name, reader.extension));
    // Before it is read: what ends the process leaves no time for it.
    fs::write(&kept, bytes).unwrap();
    let (sender, done) = mpsc::channel();
    let (reads, extension, bytes) = (reader.reads, reader.extension, bytes.to_vec());
    std::thread::spawn(move || {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("input.{extension}"));
        fs::write(&path, &bytes).unwrap();
        let ended = catch_unwind(AssertUnwindSafe(|| reads(&path)));
        let said = |panic: Box<dyn std::any::Any + Send>| {
            panic
                .downcast_ref::<String>()
                .cloned()
                .or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()))
                .unwrap_or_default()
        };
        // Nobody listens any more where it took too long.
        let _ = sender.send(ended.map_err(said));
    });
    match done.recv_timeout(PATIENCE) {
        Ok(Ok(())) => {
            if let Some(most) = resident().filter(|most| *most > RESIDENT) {
                return Err(format!("{}: {most} bytes of memory", kept.display()));
            }
            fs::remove_file(&kept).unwrap();
            Ok(())
        }
        Ok(Err(panic)) => Err(format!("{}: {panic}", kept.display())),
        Err(_) => Err(format!("{}: no end", kept.display())),
    }
}

/// Other people's files below a folder, no large ones.
fn others(folder: &Path, extension: &str) -> Vec<Vec<u8>> {
    let (mut open, mut found) = (vec![folder.to_owned()], Vec::new());
    while let Some(place) = open.pop() {
        for entry in fs::read_dir(place).unwrap().map(|e| e.unwrap().path()) {
            if entry.is_dir() {
                open.push(entry);
            } else if entry.to_string_lossy().ends_with(&format!(".{extension}"))
                && entry.metadata().unwrap().len() < 1 << 20
            {
                found.push(entry);
            }
        }
    }
    found.sort();
    found.iter().map(|file| fs::read(file).unwrap()).collect()
}

/// The corpus as it is, then damaged.
fn attack(name: &str) {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Resource, Rlimit, setrlimit};
        setrlimit(Resource::As, Rlimit { current: Some(MEMORY), maximum: Some(MEMORY) }).unwrap();
    }
    let reader = READERS.iter().find(|r| r.name == name).unwrap();
    let mut corpus = (reader.corpus)();
    corpus.extend(
        std::env::var_os("INTRADOS_CORPUS")
            .into_iter()
            .flat_map(|folder| others(Path::new(&folder), reader.extension)),
    );
    let times = std::env::var("INTRADOS_FUZZ")
        .ok()
        .map_or(1, |n| n.parse().expect("INTRADOS_FUZZ is a number"));
    let mut failures: Vec<String> = Vec::new();
    for (i, seed) in corpus.iter().enumerate() {
        failures.extend(feed(reader, seed, &format!("seed{i}")).err());
    }
    for case in 0..reader.cases * times {
        let mut dice = mutate::Dice::new(Key::new(20, case));
        let seed = &corpus[dice.below(corpus.len())];
        let input = mutate::damage(seed, &mut dice);
        failures.extend(feed(reader, &input, &case.to_string()).err());
        if failures.len() >= 10 {
            break;
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The most memory that this process has held so far, bytes; none where nobody tells.
fn resident() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()?)
}

macro_rules! attacks {
    ($($name:ident),*) => { $(#[test] fn $name() { attack(stringify!($name)); })* };
}

attacks!(scene, model, properties, mesh, picture, slices, volume, evidence, table, profile, cracks);
attacks!(deck, gmsh, groups);
attacks!(photograph, dicom, sinogram, picks, colmap, spans, guide);

#[test]
fn every_reader_is_attacked() {
    assert_eq!(READERS.len(), 21);
    for reader in &READERS {
        assert!(!(reader.corpus)().is_empty(), "{}", reader.name);
    }
}

/// A shining triangle without area had an infinite one, and so the share of every other lamp was
/// nothing.
#[test]
fn a_lamp_without_area_turns_off_no_other() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("line.obj"), "v 0 1 0\nv 1 1 0\nv 2 1 0\nf 1 2 3\n").unwrap();
    let brightness = |more: &str| {
        let path = folder.path().join("scene.ron");
        let quad = "Quad(corner: (0,0,0), u: (0,0,1), v: (1,0,0))";
        fs::write(
            &path,
            format!("(schema: \"intrados.scene/1\", shapes: [{quad}{more}], {})", readers::LOOK),
        )
        .unwrap();
        readers::brightness(&path)
    };
    let lit = brightness("");
    assert!(lit > 0.0);
    let beside = brightness(", Mesh(file: \"line.obj\", emission: (9, 9, 9))");
    assert!((beside / lit - 1.0).abs() < 0.01, "{beside} {lit}");
}
