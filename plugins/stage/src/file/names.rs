//! Names of files that come from names of things.

use std::collections::BTreeMap;

/// Longest name made here, bytes: systems take 255, and callers add places, numbers and extensions.
const LONGEST: usize = 120;

/// For each id the part of a file's name that stands for it, no two alike, not even where letters'
/// case does not count.
///
/// Letters of any script, digits, `-`, `_` and `.` stay, everything else becomes `_`. Where that
/// takes from an id what told it from another, a hash follows after `~`, which no other name has:
/// `P/1` beside `P_1` is `P_1~3f1d…`. So a name depends on the ids alone, in whatever order.
#[must_use]
pub fn file_names<S: AsRef<str>>(ids: &[S]) -> Vec<String> {
    let mut alike: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for id in ids.iter().map(AsRef::as_ref) {
        let all = alike.entry(file_name(id).to_lowercase()).or_default();
        if !all.contains(&id) {
            all.push(id);
        }
    }
    let name = |id: &S| {
        let (id, name) = (id.as_ref(), file_name(id.as_ref()));
        let alike = alike.get(&name.to_lowercase()).map_or(&[][..], Vec::as_slice);
        // The one that needed no change keeps its name; of several that differ by case, the first
        // in order of the alphabet.
        let keeps = alike
            .iter()
            .filter(|other| file_name(other) == **other)
            .min()
            .is_some_and(|kept| *kept == id);
        if alike.len() < 2 || keeps { name } else { format!("{name}~{:016x}", hash(id)) }
    };
    ids.iter().map(name).collect()
}

/// The part of a file's name that stands for one thing alone, such as a scene.
#[must_use]
pub fn file_name(id: &str) -> String {
    let mut name = String::new();
    for c in id.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }) {
        if name.len() + c.len_utf8() > LONGEST {
            break;
        }
        // A dot at the beginning hides a file, and two of them are the folder above.
        name.push(if name.is_empty() && c == '.' { '_' } else { c });
    }
    if name.chars().all(|c| "._".contains(c)) { "unnamed".into() } else { name }
}

/// FNV-1a (Fowler, Noll, Vo), the same on every machine.
pub(super) fn hash(id: &str) -> u64 {
    id.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe_and_unique() {
        let long = "桥".repeat(10_000);
        let longer = long.clone() + "x";
        let ids = [
            "P_1",
            "P/1",
            "P 1",
            "p_1",
            "Stütze 1",
            "../../x",
            "-rf",
            "..",
            "a\nb",
            "\"'\"",
            "🌉",
            "💥",
            "",
            &long,
            &longer,
            "P/1",
            ".",
        ];
        let names = file_names(&ids);
        for (i, (name, id)) in names.iter().zip(ids).enumerate() {
            assert!(!name.is_empty() && name.len() < 200 && !name.starts_with('.'), "{name}");
            assert!(name.chars().all(|c| c.is_alphanumeric() || "-_.~".contains(c)), "{name}");
            for (other, of) in names.iter().zip(ids).skip(i + 1) {
                assert_eq!(
                    name.to_lowercase() == other.to_lowercase(),
                    id == of,
                    "{id} and {of}: {name} and {other}"
                );
            }
        }
        assert_eq!([&*names[0], &names[4], &names[6]], ["P_1", "Stütze_1", "-rf"]);
        assert!(names[1].starts_with("P_1~"));
        // Their order changes no name.
        let mut turned = ids;
        turned.reverse();
        assert!(file_names(&turned).iter().rev().eq(&names));
    }
}
