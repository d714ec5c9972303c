//! CT slices on disk: patterns to files, images to their masks.

use std::path::{Path, PathBuf};

use intrados_stage::Job;

use super::mhd;
use crate::{LoadError, load::Sources, problem::Problem};

/// Most slices of one core.
const MAX_SLICES: usize = 100_000;

/// Images that the patterns of a file in `base` name, sorted, and the masks of each:
/// `STEM_mask-*.EXT` beside it. All of them go into the hash.
pub(crate) fn find(
    sources: &mut Sources,
    base: &Path,
    patterns: &[String],
    job: &Job,
) -> Result<(Vec<PathBuf>, Vec<Vec<PathBuf>>), LoadError> {
    let mut images = Vec::new();
    let mut masks = Vec::new();
    for pattern in patterns {
        let path = sources.path_from(base, pattern)?;
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        sources.enter(&folder)?;
        let files = listing(&folder)?;
        let mut found: Vec<&String> =
            files.iter().filter(|f| matches(&name, f) && is_image(f)).collect();
        if name.contains(['*', '?']) {
            found.retain(|f| !f.contains("_mask-"));
        }
        if found.is_empty() {
            return Err(none(&path, files.iter().find(|f| matches(&name, f))));
        }
        for file in found {
            if images.len() >= MAX_SLICES {
                return Err(LoadError::bad(
                    path.display().to_string(),
                    "TOO_MANY",
                    format!("more than {MAX_SLICES} slices: narrow the pattern"),
                ));
            }
            let image = folder.join(file);
            sources.hash_file(&image, job)?;
            if mhd::is_header(&image) {
                let bad =
                    |why: String| LoadError::bad(image.display().to_string(), "NOT_A_SLICE", why);
                let data = mhd::VoxelHeader::read(&image).map_err(bad)?.data;
                let name = data.to_string_lossy().into_owned();
                sources.hash_file(&sources.path_from(Path::new(""), &name)?, job)?;
            }
            let prefix = format!(
                "{}_mask-",
                Path::new(file).file_stem().unwrap_or_default().to_string_lossy()
            );
            // Names are sorted, so the masks stand together.
            let first = files.partition_point(|f| *f < prefix);
            let own: Vec<PathBuf> = files
                .iter()
                .skip(first)
                .take_while(|f| f.starts_with(&prefix))
                .map(|f| folder.join(f))
                .collect();
            for mask in &own {
                sources.hash_file(mask, job)?;
            }
            images.push(image);
            masks.push(own);
        }
    }
    Ok((images, masks))
}

/// Why a pattern names no slice, although a file of that name may be there.
fn none(path: &Path, other: Option<&String>) -> LoadError {
    let place = path.display().to_string();
    match other {
        Some(file) if matches!(extension(file).as_deref(), Some("jpg" | "jpeg")) => {
            let lost = "a JPEG has lost the grey values that pores are told by: give the TIFF or \
                        PNG that it was made of";
            LoadError::bad(place, "NOT_A_SLICE", lost)
        }
        Some(_) => {
            let message =
                "is neither TIFF, PNG, MetaImage (.mha, .mhd) nor DICOM (.dcm): convert it";
            LoadError::bad(place, "NOT_A_SLICE", message)
        }
        None => {
            let message = "no image (.tif, .png, .mha, .mhd, .dcm) has this name: check the path";
            LoadError::NoInput(Problem::error(place, "NO_INPUT", message))
        }
    }
}

pub(crate) fn is_image(file: &str) -> bool {
    matches!(extension(file).as_deref(), Some("tif" | "tiff" | "png" | "mha" | "mhd" | "dcm"))
}

pub(crate) fn extension(file: &str) -> Option<String> {
    Path::new(file).extension().map(|e| e.to_string_lossy().to_ascii_lowercase())
}

/// Names of the files in a folder, sorted.
pub(crate) fn listing(folder: &Path) -> Result<Vec<String>, LoadError> {
    let place = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(place).map_err(|_| {
        LoadError::NoInput(Problem::error(
            place.display().to_string(),
            "NO_INPUT",
            "there is no such folder: check the path",
        ))
    })?;
    let mut files: Vec<String> =
        entries.filter_map(|e| e.ok()?.file_name().into_string().ok()).collect();
    files.sort_unstable();
    Ok(files)
}

/// Whether `*` (any run) and `?` (any one character) of `pattern` fit `text`. Linear memory, no
/// recursion.
pub(crate) fn matches(pattern: &str, text: &str) -> bool {
    let (pattern, text): (Vec<char>, Vec<char>) =
        (pattern.chars().collect(), text.chars().collect());
    let (mut p, mut t) = (0, 0);
    let mut star: Option<(usize, usize)> = None;
    while let Some(&c) = text.get(t) {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p, t));
                p += 1;
            }
            Some(&q) if q == '?' || q == c => {
                p += 1;
                t += 1;
            }
            _ => match star.as_mut() {
                Some((at, from)) => {
                    *from += 1;
                    (p, t) = (*at + 1, *from);
                }
                None => return false,
            },
        }
    }
    pattern.iter().skip(p).all(|&c| c == '*')
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn patterns_fit() {
        for (pattern, text, fits) in [
            ("a*.tif", "a12.tif", true),
            ("a*.tif", "b12.tif", false),
            ("*_???.tif", "D1_097.tif", true),
            ("*_???.tif", "D1_97.tif", false),
            ("*a*b", "xaxxbab", true),
            ("", "", true),
            ("*", "", true),
            ("a", "", false),
        ] {
            assert_eq!(matches(pattern, text), fits, "{pattern} {text}");
        }
    }
}
