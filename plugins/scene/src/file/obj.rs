//! Wavefront OBJ files: `v` and `f` lines, `o` and `g` for what belongs together, `usemtl` for what
//! it is of. Coordinates are read in double precision, faces of any shape are cut into triangles
//! ([`crate::polygon`]), and what is passed over is named.

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet, HashMap},
};

use glam::DVec3;

use crate::{LoadError, Mesh, polygon};

/// Coordinates beyond are damage: millimetres on a national grid are 1e10.
const FARTHEST: f64 = 1e12;
/// Lines of which so many are named, the others counted.
const NAMED: usize = 3;
/// Most bodies of a part that are told apart.
const MOST_BODIES: usize = 4000;
/// Bodies of a part that are nearer than this share of its extent belong together.
const BESIDE: f64 = 1e-4;

/// What an OBJ file holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ObjFile {
    pub(crate) parts: Vec<ObjPart>,
    /// What a user should know of how it was read.
    pub(crate) notes: Vec<String>,
}

/// What belongs together in an OBJ file.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ObjPart {
    pub(crate) name: String,
    /// Other names that hold for it: those of its groups, or of its object.
    pub(crate) words: Vec<String>,
    pub(crate) materials: Vec<String>,
    /// In the file's unit.
    pub(crate) points: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Reads the mesh, and what a user should know of it.
pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<(Mesh, Vec<String>), LoadError> {
    let lines = Lines::read(name, bytes)?;
    let [low, high] = bounds(&lines.points);
    let far = low.abs().max(high.abs()).max_element();
    let resolved = f64::from(f32::EPSILON) * far;
    let mut notes = lines.notes;
    if resolved > 1e-4 * (high - low).max_element() {
        notes.push(format!(
            "{name}: its corners lie up to {far:.0} from the origin, where single precision resolves {resolved:.1e}: move it, or import it (`intrados import`), which does"
        ));
    }
    let mesh = Mesh {
        positions: lines.points.iter().map(|p| p.as_vec3()).collect(),
        triangles: lines.triangles,
        ..Mesh::default()
    };
    Ok((mesh, notes))
}

/// Reads what belongs together, each with its names and the vertices that it uses.
pub(crate) fn read_parts(name: &str, bytes: &[u8]) -> Result<ObjFile, LoadError> {
    let mut lines = Lines::read(name, bytes)?;
    let mut notes = std::mem::take(&mut lines.notes);
    let whole = lines.parts();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    whole.iter().for_each(|p| *counts.entry(p.name.as_str()).or_default() += 1);
    let several = counts.into_iter().filter(|(_, count)| *count > 1);
    let several: Vec<String> =
        several.map(|(name, count)| format!("\"{name}\" ({count} times)")).collect();
    let mut apart = Vec::new();
    let mut parts = Vec::with_capacity(whole.len());
    for part in &whole {
        let bodies = separated(part);
        if bodies.len() > 1 {
            apart.push(format!("\"{}\" ({} bodies)", part.name, bodies.len()));
        }
        parts.extend(bodies);
    }
    for (what, names) in
        [("objects or groups have one name", several), ("bodies under one name lie apart", apart)]
    {
        if !names.is_empty() {
            notes.push(format!(
                "{what}: {}; each is an element of its own, told apart by a number",
                listed(&names)
            ));
        }
    }
    Ok(ObjFile { parts, notes })
}

/// The first of a list, and how many more there are.
fn listed(all: &[String]) -> String {
    let first = all.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    match all.len().saturating_sub(NAMED) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

fn bounds(points: &[DVec3]) -> [DVec3; 2] {
    points.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)])
}

/// Text of a file in any of the encodings in which programs write it, and which it is where it is
/// not UTF-8.
fn decoded<'a>(
    name: &str,
    bytes: &'a [u8],
) -> Result<(Cow<'a, str>, Option<&'static str>), LoadError> {
    let not_text = || LoadError::bad(name, "NOT_TEXT", "is not text: is it an OBJ file?");
    let wide = |of: fn([u8; 2]) -> u16| {
        let units: Vec<u16> =
            bytes.get(2..).unwrap_or_default().chunks_exact(2).map(|c| of([c[0], c[1]])).collect();
        String::from_utf16(&units).map(Cow::Owned).map_err(|_| not_text())
    };
    match bytes {
        [0xff, 0xfe, ..] => return Ok((wide(u16::from_le_bytes)?, Some("UTF-16"))),
        [0xfe, 0xff, ..] => return Ok((wide(u16::from_be_bytes)?, Some("UTF-16"))),
        _ => {}
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.contains(&0) {
        return Err(not_text());
    }
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => (text.into(), None),
        // Each byte is the character of its number.
        Err(_) => {
            (bytes.iter().map(|&b| char::from(b)).collect::<String>().into(), Some("Latin-1"))
        }
    })
}

/// Lines, those that a backslash at their end continues put together, each with its number.
fn logical(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let ending = if text.contains('\n') { '\n' } else { '\r' };
    let mut lines = text.split(ending).enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut line = Cow::Borrowed(first);
        while let Some(part) = line.trim_end().strip_suffix('\\') {
            let (_, next) = lines.next().unwrap_or_default();
            line = Cow::Owned(format!("{part} {next}"));
        }
        Some((number + 1, line))
    })
}

/// Faces that lie between two names.
#[derive(Debug, Clone, Default)]
struct Run {
    object: Option<usize>,
    group: Option<String>,
    materials: BTreeSet<String>,
    /// From the first of its triangles to before the last.
    triangles: [usize; 2],
}

/// A file line by line.
#[derive(Default)]
struct Lines {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    objects: Vec<String>,
    runs: Vec<Run>,
    notes: Vec<String>,
}

/// What a comment says of the file's unit, as exporters write it: no part of OBJ, and not metres.
fn unit_said(name: &str, comment: &str) -> Option<String> {
    const UNITS: [&str; 9] =
        ["inch", "feet", "foot", "millimet", "centimet", "decimet", " mm", " cm", "=mm"];
    let low = comment.to_lowercase();
    let is_said = low.contains("unit") && UNITS.iter().any(|unit| low.contains(unit));
    is_said.then(|| {
        format!(
            "{name}: a comment says \"{}\", which no reader of OBJ heeds: metres are taken, give --unit if it is right",
            super::shorten(comment.trim_start_matches('#').trim())
        )
    })
}

/// A face as it is written: the line, and the vertices, negative ones counted already.
struct Face {
    line: usize,
    run: usize,
    corners: Vec<i64>,
}

impl Lines {
    fn read(name: &str, bytes: &[u8]) -> Result<Self, LoadError> {
        let (text, encoding) = decoded(name, bytes)?;
        let mut all = Self { runs: vec![Run::default()], ..Self::default() };
        if let Some(encoding) = encoding {
            all.notes.push(format!("{name} is not UTF-8: its names are read as {encoding}"));
        }
        let (mut faces, mut commas) = (Vec::new(), 0);
        let mut passed: BTreeMap<&'static str, usize> = BTreeMap::new();
        let mut material = None;
        for (number, line) in logical(&text) {
            let bad =
                |message: &str| LoadError::bad(format!("{name}:{number}:1"), "BAD_OBJ", message);
            let line = line.trim();
            let (word, rest) =
                line.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((line, ""));
            let numbers = rest.split('#').next().unwrap_or_default();
            match word {
                _ if word.starts_with('#') => all.notes.extend(unit_said(name, line)),
                "v" => {
                    let mut read = numbers.split_ascii_whitespace();
                    let mut number = || coordinate(read.next()?, &mut commas);
                    let (Some(x), Some(y), Some(z)) = (number(), number(), number()) else {
                        return Err(bad("a vertex needs three finite numbers"));
                    };
                    all.points.push(DVec3::new(x, y, z));
                }
                "f" | "fo" => {
                    let corners: Option<Vec<i64>> = numbers
                        .split_ascii_whitespace()
                        .map(|word| vertex(word, all.points.len()))
                        .collect();
                    let corners = corners.filter(|c| c.len() >= 3).ok_or_else(|| {
                        bad("a face needs three or more vertices, each by its number")
                    })?;
                    all.of_material(material.as_ref());
                    faces.push(Face { line: number, run: all.runs.len() - 1, corners });
                }
                "o" => {
                    // A tab within a name is a space.
                    all.objects.push(rest.trim().replace(char::is_control, " "));
                    let object = Some(all.objects.len() - 1);
                    all.runs.push(Run { object, ..Run::default() });
                }
                "g" => {
                    let object = all.runs.last().and_then(|run| run.object);
                    let words: Vec<&str> = rest.split_ascii_whitespace().collect();
                    let group = Some(words.join(" ")).filter(|g| !g.is_empty());
                    all.runs.push(Run { object, group, ..Run::default() });
                }
                "usemtl" => material = Some(rest.trim().to_owned()),
                "l" | "p" => *passed.entry("lines and points").or_default() += 1,
                "surf" | "curv" | "curv2" => *passed.entry("free-form surfaces").or_default() += 1,
                "call" => *passed.entry("calls of other files").or_default() += 1,
                _ => {}
            }
        }
        all.cut(name, faces)?;
        if commas > 0 {
            all.notes.push(format!(
                "{name}: {commas} numbers have a comma, which is read as a decimal comma"
            ));
        }
        let passed = passed.into_iter().map(|(what, count)| format!("{count} {what}"));
        let passed = passed.collect::<Vec<_>>().join(", ");
        if !passed.is_empty() {
            all.notes.push(format!("{name}: {passed} are not read"));
        }
        if all.triangles.is_empty() {
            return Err(LoadError::bad(name, "EMPTY", "has no faces: is it an OBJ file?"));
        }
        Ok(all)
    }

    fn of_material(&mut self, material: Option<&String>) {
        if let (Some(run), Some(material)) = (self.runs.last_mut(), material)
            && !run.materials.contains(material)
        {
            run.materials.insert(material.clone());
        }
    }

    /// Cuts faces into triangles, once all vertices are known.
    fn cut(&mut self, name: &str, faces: Vec<Face>) -> Result<(), LoadError> {
        let mut crossed = Vec::new();
        for Face { line, run, corners } in faces {
            let place = || format!("{name}:{line}:1");
            let count = self.points.len() as i64;
            let valid = |i: &i64| (0..count).contains(i);
            if let Some(wrong) = corners.iter().find(|i| !valid(i)) {
                let message = format!("there is no vertex {}: the file has {count}", wrong + 1);
                return Err(LoadError::bad(place(), "BAD_OBJ", message));
            }
            let mut corners: Vec<u32> = corners.into_iter().map(|i| i as u32).collect();
            corners.dedup();
            if corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            let at: Vec<DVec3> =
                corners.iter().filter_map(|&i| self.points.get(i as usize).copied()).collect();
            let Some(found) = polygon::triangulate(&at) else {
                let message = format!(
                    "a face of {} corners is too tangled to be cut into triangles: export it triangulated",
                    corners.len()
                );
                return Err(LoadError::bad(place(), "BAD_OBJ", message));
            };
            if !found.is_simple {
                crossed.push(line.to_string());
            }
            if let Some(run) = self.runs.get_mut(run) {
                if run.triangles[1] == 0 {
                    run.triangles[0] = self.triangles.len();
                }
                run.triangles[1] = self.triangles.len() + found.triangles.len();
            }
            self.triangles.extend(found.triangles.into_iter().map(|t| t.map(|k| corners[k])));
        }
        if !crossed.is_empty() {
            self.notes.push(format!(
                "{name}: faces cross themselves (lines {}): their surface is a guess; export them triangulated",
                listed(&crossed)
            ));
        }
        Ok(())
    }

    /// Runs that belong together, in their order: those of one object where they are closed only
    /// together, and those of one name that share an edge and are open.
    fn parts(&self) -> Vec<ObjPart> {
        let runs: Vec<&Run> =
            self.runs.iter().filter(|r| r.triangles[1] > r.triangles[0]).collect();
        let places = self.places();
        let is_open: Vec<bool> = runs.iter().map(|r| !self.is_closed(r, &places)).collect();
        let mut root: Vec<usize> = (0..runs.len()).collect();
        let mut keys: HashMap<String, u32> = HashMap::new();
        let mut seen: HashMap<(u32, u32), usize> = HashMap::new();
        for (i, run) in runs.iter().enumerate().filter(|(i, _)| is_open[*i]) {
            let own: BTreeSet<u32> = self.triangles[run.triangles[0]..run.triangles[1]]
                .iter()
                .flatten()
                .filter_map(|&p| places.get(p as usize).copied())
                .collect();
            // A run is part of its object, and of all of its name.
            let object = run.object.map(|o| format!("o {o}"));
            for key in object.into_iter().chain([format!("n {}", self.name(run))]) {
                let next = keys.len() as u32;
                let key = *keys.entry(key).or_insert(next);
                for &place in &own {
                    let other = *seen.entry((place, key)).or_insert(i);
                    let [a, b] = [top(&mut root, other), top(&mut root, i)];
                    root[a.max(b)] = a.min(b);
                }
            }
        }
        let mut of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for i in 0..runs.len() {
            of.entry(top(&mut root, i)).or_default().push(i);
        }
        let runs_of = |members: &Vec<usize>| members.iter().map(|&i| runs[i]).collect::<Vec<_>>();
        of.values().map(|members| self.part(&runs_of(members))).collect()
    }

    /// A number for each place, the same for vertices that lie at one.
    fn places(&self) -> Vec<u32> {
        let mut known: HashMap<[u64; 3], u32> = HashMap::new();
        let place = |p: &DVec3| {
            let next = known.len() as u32;
            *known.entry((*p + 0.0).to_array().map(f64::to_bits)).or_insert(next)
        };
        self.points.iter().map(place).collect()
    }

    /// Whether each edge of a run is walked as often one way as the other.
    fn is_closed(&self, run: &Run, places: &[u32]) -> bool {
        let mut walked: HashMap<[u32; 2], i32> = HashMap::new();
        let place = |i: u32| places.get(i as usize).copied().unwrap_or(0);
        for t in &self.triangles[run.triangles[0]..run.triangles[1]] {
            let [a, b, c] = t.map(place);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let way = if from < to { 1 } else { -1 };
                *walked.entry([from.min(to), from.max(to)]).or_default() += way;
            }
        }
        walked.into_iter().all(|([a, b], times)| a == b || times == 0)
    }

    /// The name of a run: of its object where the file has several, else of its group.
    fn name(&self, run: &Run) -> String {
        let object = run.object.and_then(|o| self.objects.get(o)).filter(|o| !o.is_empty());
        let group = run.group.as_ref();
        let name = if self.objects.len() > 1 { object.or(group) } else { group.or(object) };
        name.cloned().unwrap_or_else(|| "object".into())
    }

    fn part(&self, runs: &[&Run]) -> ObjPart {
        let name = runs.first().map_or_else(String::new, |run| self.name(run));
        let objects = runs.iter().filter_map(|r| self.objects.get(r.object?)).cloned();
        let groups = runs.iter().filter_map(|r| r.group.clone());
        let mut words: Vec<String> = Vec::new();
        for word in objects.chain(groups).filter(|w| !w.is_empty() && *w != name) {
            if !words.contains(&word) {
                words.push(word);
            }
        }
        let materials: BTreeSet<String> =
            runs.iter().flat_map(|run| &run.materials).filter(|m| !m.is_empty()).cloned().collect();
        let all: Vec<[u32; 3]> = runs
            .iter()
            .flat_map(|r| &self.triangles[r.triangles[0]..r.triangles[1]])
            .copied()
            .collect();
        let (points, triangles) = used(&self.points, &all);
        ObjPart { name, words, materials: materials.into_iter().collect(), points, triangles }
    }
}

/// Points that triangles use, in their order, and the triangles of these.
fn used(points: &[DVec3], triangles: &[[u32; 3]]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut places: Vec<u32> = triangles.iter().flatten().copied().collect();
    places.sort_unstable();
    places.dedup();
    let own = |i: u32| places.binary_search(&i).unwrap_or(0) as u32;
    let triangles = triangles.iter().map(|t| t.map(own)).collect();
    (places.iter().filter_map(|&i| points.get(i as usize).copied()).collect(), triangles)
}

fn top(root: &mut [usize], mut i: usize) -> usize {
    while root[i] != i {
        root[i] = root[root[i]];
        i = root[i];
    }
    i
}

/// The bodies of a part that lie apart: those whose boxes do not touch.
fn separated(part: &ObjPart) -> Vec<ObjPart> {
    let mut known: HashMap<[u64; 3], usize> = HashMap::new();
    let mut root: Vec<usize> = (0..part.points.len()).collect();
    for (i, p) in part.points.iter().enumerate() {
        let first = *known.entry((*p + 0.0).to_array().map(f64::to_bits)).or_insert(i);
        root[i] = first;
    }
    for &[a, b, c] in &part.triangles {
        for other in [b, c] {
            let [a, b] = [top(&mut root, a as usize), top(&mut root, other as usize)];
            root[a.max(b)] = a.min(b);
        }
    }
    let [low, high] = bounds(&part.points);
    let slack = BESIDE * (high - low).max_element();
    let mut boxes: BTreeMap<usize, [DVec3; 2]> = BTreeMap::new();
    for i in 0..part.points.len() {
        let p = part.points[i];
        let own = boxes.entry(top(&mut root, i)).or_insert([p; 2]);
        *own = [own[0].min(p), own[1].max(p)];
    }
    if boxes.len() < 2 || boxes.len() > MOST_BODIES {
        return vec![part.clone()];
    }
    let all: Vec<(usize, [DVec3; 2])> = boxes.into_iter().collect();
    for (k, (one, [l, h])) in all.iter().enumerate() {
        for (other, [m, n]) in &all[k + 1..] {
            if (*l - slack).cmple(*n).all() && (*m - slack).cmple(*h).all() {
                let [a, b] = [top(&mut root, *one), top(&mut root, *other)];
                root[a.max(b)] = a.min(b);
            }
        }
    }
    let mut of: BTreeMap<usize, Vec<[u32; 3]>> = BTreeMap::new();
    for triangle in &part.triangles {
        of.entry(top(&mut root, triangle[0] as usize)).or_default().push(*triangle);
    }
    let body = |triangles: &Vec<[u32; 3]>| {
        let (points, triangles) = used(&part.points, triangles);
        ObjPart { points, triangles, ..part.clone() }
    };
    if of.len() < 2 { vec![part.clone()] } else { of.values().map(body).collect() }
}

/// A number, with a decimal point or comma.
fn coordinate(word: &str, commas: &mut usize) -> Option<f64> {
    let number = match word.split_once(',') {
        Some((whole, rest)) if !rest.contains([',', '.']) && !whole.contains('.') => {
            *commas += 1;
            format!("{whole}.{rest}").parse::<f64>()
        }
        _ => word.parse::<f64>(),
    };
    number.ok().filter(|x| x.abs() <= FARTHEST)
}

/// `7`, `7/1`, `7//3`, `7/1/3`, from 0; negative ones count from the last vertex so far.
fn vertex(word: &str, count: usize) -> Option<i64> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    match index {
        0 => None,
        1.. => Some(index - 1),
        _ => (count as i64).checked_add(index).filter(|i| *i >= 0),
    }
}
