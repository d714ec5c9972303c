//! The state of work in a file: checkpoints, and the shards that `merge` adds up. Floats are stored
//! bit by bit, so that work that is resumed has the same bits as work that was never interrupted.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use intrados_light::{Exposure, Plate, Sensor};
use serde::{Deserialize, Serialize};

use crate::{failure::Failure, sealed};

/// Raise its number whenever anything that is stored changes. A picture of 64 megapixels from both
/// sides has 20 GB less than the most.
const MARK: sealed::Mark = sealed::Mark {
    magic: *b"INTRADOS",
    format: 4,
    most: 40 << 30,
    stranger: "is no accumulator of Intrados: name a file that --shard or --checkpoint wrote",
};

/// Work of one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Accumulator {
    /// Version of the program that made it.
    pub(crate) version: String,
    /// Name of the scene.
    pub(crate) scene: String,
    /// Hash of the scene and of every file it names.
    pub(crate) scene_hash: String,
    pub(crate) content: Content,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "there is one of it in a run")]
pub(crate) enum Content {
    /// Of `render`.
    Picture {
        plate: Plate,
        /// For the PNG.
        exposure: crate::args::Exposure,
    },
    /// Of `measure`.
    Readings {
        sensors: Vec<Sensor>,
        /// One a sensor, or none at all.
        primal: Vec<Exposure>,
        dual: Option<Exposure>,
        /// CPU-seconds spent on the fields that steer.
        training: f64,
    },
}

/// Which parts of the work an accumulator holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Shards {
    /// How many,
    given: usize,
    /// of how many.
    of: u64,
    /// Those that are not there.
    missing: Vec<u64>,
    /// Those that were stopped before they had all their walks.
    unfinished: Vec<u64>,
}

impl Shards {
    /// What is not there, in words; `None` where all is.
    pub(crate) fn complaint(&self) -> Option<String> {
        let list = |numbers: &[u64]| {
            let few: Vec<String> =
                numbers.iter().take(8).map(|i| format!("{i}/{}", self.of)).collect();
            few.join(", ") + if numbers.len() > 8 { ", …" } else { "" }
        };
        let missing =
            format!("{} of {} given, {} missing", self.given, self.of, list(&self.missing));
        let unfinished = format!("{} not walked to the end", list(&self.unfinished));
        match (self.missing.is_empty(), self.unfinished.is_empty()) {
            (true, true) => None,
            (false, true) => Some(missing),
            // The one part of a work that was not split: the stop rule says it already.
            (true, false) if self.of == 1 => None,
            (true, false) => Some(unfinished),
            (false, false) => Some(format!("{missing}; {unfinished}")),
        }
    }
}

impl Accumulator {
    /// Which parts of the work it holds.
    pub(crate) fn shards(&self) -> Shards {
        let first = self.exposures().next();
        let passes = first.map_or(&[][..], |e| &e.passes);
        let of = passes.first().map_or(1, |p| p.shard.of);
        let given: BTreeSet<u64> = passes.iter().map(|p| p.shard.index).collect();
        let unfinished: BTreeSet<u64> =
            self.exposures().flat_map(Exposure::unfinished).map(|shard| shard.index).collect();
        Shards {
            given: given.len(),
            of,
            missing: (0..of).filter(|i| !given.contains(i)).collect(),
            unfinished: unfinished.into_iter().collect(),
        }
    }

    /// Whether every walk of its parts was walked.
    pub(crate) fn is_whole(&self) -> bool {
        self.exposures().flat_map(Exposure::unfinished).next().is_none()
    }

    fn exposures(&self) -> impl Iterator<Item = &Exposure> {
        let (picture, readings) = match &self.content {
            Content::Picture { plate, .. } => (Some(plate.exposures().iter().flatten()), None),
            Content::Readings { primal, dual, .. } => (None, Some(primal.iter().chain(dual))),
        };
        picture.into_iter().flatten().chain(readings.into_iter().flatten())
    }

    pub(crate) fn new(scene: &intrados_scene::Scene, content: Content) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            content,
        }
    }

    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        sealed::write(path, MARK, self)
    }

    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let accumulator: Self = sealed::read(path, MARK)?;
        if accumulator.is_consistent() {
            Ok(accumulator)
        } else {
            Err(Failure::BadInput(format!(
                "{}: is damaged: its parts do not fit together",
                path.display()
            )))
        }
    }

    /// A hash of all that is the same in every run: everything but CPU-seconds.
    pub(crate) fn digest(mut self) -> Result<String, Failure> {
        match &mut self.content {
            Content::Picture { plate, .. } => plate.forget_clock(),
            Content::Readings { primal, dual, training, .. } => {
                *training = 0.0;
                primal.iter_mut().chain(dual).for_each(|e| e.cpu_seconds = 0.0);
            }
        }
        let bytes = postcard::to_stdvec(&self)
            .map_err(|e| Failure::Internal(format!("cannot store the work: {e}")))?;
        Ok(blake3::hash(&bytes).to_hex().to_string())
    }

    fn is_consistent(&self) -> bool {
        match &self.content {
            Content::Picture { plate, .. } => plate.is_consistent(),
            Content::Readings { sensors, primal, dual, .. } => {
                let primal_fits = primal.is_empty() || primal.len() == sensors.len();
                let dual_fits = dual
                    .as_ref()
                    .is_none_or(|e| e.scores.len() == sensors.len() && e.is_consistent());
                !sensors.is_empty()
                    && primal_fits
                    && dual_fits
                    && (!primal.is_empty() || dual.is_some())
                    && primal.iter().all(|e| e.scores.len() == 1 && e.is_consistent())
            }
        }
    }

    /// Whether this is of the scene; says so in one line if not.
    pub(crate) fn check_scene(
        &self,
        path: &Path,
        scene: &intrados_scene::Scene,
    ) -> Result<(), Failure> {
        if self.scene_hash == scene.hash {
            return Ok(());
        }
        let (theirs, ours) = (short(&self.scene_hash), short(&scene.hash));
        Err(Failure::BadInput(format!(
            "{}: is of another scene, or of an older state of it ({} {theirs}, not {} {ours}): start again without it",
            path.display(),
            self.scene,
            scene.name
        )))
    }

    /// Adds the walks of another one of the same work.
    pub(crate) fn merge(&mut self, other: &Self) -> Result<(), String> {
        if self.scene_hash != other.scene_hash {
            return Err(format!(
                "it is of another scene ({} {})",
                other.scene,
                short(&other.scene_hash)
            ));
        }
        match (&mut self.content, &other.content) {
            (Content::Picture { plate, .. }, Content::Picture { plate: theirs, .. }) => {
                plate.merge(theirs).map_err(|mismatch| mismatch.to_string())
            }
            (
                Content::Readings { sensors, primal, dual, training },
                Content::Readings { sensors: s, primal: p, dual: d, training: t },
            ) => {
                if sensors != s || primal.len() != p.len() || dual.is_some() != d.is_some() {
                    return Err("the sensors or sides differ".into());
                }
                for (mine, theirs) in primal.iter_mut().zip(p).chain(dual.iter_mut().zip(d)) {
                    mine.merge(theirs).map_err(|mismatch| mismatch.to_string())?;
                }
                // Every shard has learnt the same for itself.
                *training += t;
                Ok(())
            }
            _ => Err("one is of a picture, the other of readings".into()),
        }
    }

    /// First shard that it holds.
    fn first_shard(&self) -> u64 {
        self.exposures()
            .next()
            .and_then(|e| e.passes.iter().map(|p| p.shard.index).min())
            .unwrap_or(0)
    }
}

/// The first digits of a hash.
fn short(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

/// Reads accumulators and adds them up, in the order of their shards, so that the order of the
/// files changes no bit.
pub(crate) fn merge(files: &[PathBuf]) -> Result<Accumulator, Failure> {
    let mut all = files
        .iter()
        .map(|f| Ok((f, Accumulator::read(f)?)))
        .collect::<Result<Vec<_>, Failure>>()?;
    all.sort_by_key(|(_, a)| a.first_shard());
    let mut all = all.into_iter();
    let Some((first, mut sum)) = all.next() else {
        return Err(Failure::Usage("name at least one accumulator".into()));
    };
    for (file, accumulator) in all {
        sum.merge(&accumulator).map_err(|why| {
            Failure::BadInput(format!(
                "{}: does not go together with {}: {why}",
                file.display(),
                first.display()
            ))
        })?;
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sealed::HEADER;
    use intrados_light::{LitScene, Render, RenderSettings};
    use std::sync::Arc;

    fn picture() -> Accumulator {
        let job = intrados_stage::Job::new("test");
        let scene = Arc::new(intrados_scene::Scene::load_bundled("room", &job).unwrap());
        let camera = intrados_scene::Camera { width: 8, height: 4, ..scene.cameras[0].clone() };
        let mut render = Render::new(
            Arc::new(LitScene::build(scene.clone(), &job).unwrap()),
            &camera,
            &RenderSettings::default(),
        );
        render.advance(2);
        Accumulator::new(
            &scene,
            Content::Picture {
                plate: render.plate().clone(),
                exposure: crate::args::Exposure::Auto,
            },
        )
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let (path, accumulator) = (folder.path().join("a.acc"), picture());
        accumulator.write(&path).unwrap();
        assert_eq!(Accumulator::read(&path).unwrap(), accumulator);
    }

    #[test]
    fn another_version_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.acc");
        Accumulator { version: "0.0.9".into(), ..picture() }.write(&path).unwrap();
        let refused = Accumulator::read(&path).unwrap_err().to_string();
        assert!(refused.contains("was made by version 0.0.9"), "{refused}");
    }

    /// Every cut, a changed bit anywhere, and content that lies behind a right checksum are refused
    /// in one line.
    #[test]
    fn damage_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.acc");
        picture().write(&path).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let refused = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            matches!(Accumulator::read(&path), Err(Failure::BadInput(line)) if !line.contains('\n'))
        };
        for cut in (0..whole.len()).step_by(997).chain(0..HEADER + 2) {
            assert!(refused(&whole[..cut]), "cut at {cut}");
        }
        for at in (0..whole.len()).step_by(499).chain(0..HEADER) {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << (at % 8);
            assert!(refused(&bytes), "bit at {at}");
        }
        // A right checksum over wrong content must not panic either; most of it cannot be read,
        // some can.
        for at in (HEADER..whole.len().min(HEADER + 3000)).step_by(5) {
            let mut bytes = whole.clone();
            bytes[at] = bytes[at].wrapping_add(0x55);
            let sum = *blake3::hash(&bytes[HEADER..]).as_bytes();
            bytes[20..HEADER].copy_from_slice(&sum);
            std::fs::write(&path, &bytes).unwrap();
            if let Ok(read) = Accumulator::read(&path) {
                let mut twice = read.clone();
                assert!(twice.merge(&read).is_err());
            }
        }
    }
}
