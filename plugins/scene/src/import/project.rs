//! The project folder: written beside its place, opened as a scene, then put there whole.

use std::{
    collections::BTreeMap,
    fmt::Write,
    fs,
    path::Path,
    time::{SystemTime, UNIX_EPOCH},
};

use glam::Vec3;
use intrados_stage::{
    Job,
    file::{self, AsideFolder},
};

use super::{
    ImportError, Imported, MaterialUse, Told,
    ask::questions,
    assume::{self, Carrying, Measures, STEEL, YEARS},
    build::{Built, Found},
    georeference::words,
    grade::Concrete,
    ground::{Standing, is_blinding, on_ground, reaches},
    source::{Source, Surface},
};
use crate::{
    Camera, MemberKind, Scene,
    file::{Assumed, concrete_class, evidence},
    gltf,
    structure::{Bars, Georeference, MapOrigin, Matter, Reinforcement},
};

/// The geometry's name in the folder.
const MODEL: &str = "model.glb";

/// Writes the folder.
pub(super) fn write(
    path: &Path,
    folder: &Path,
    source: &Source,
    built: &Built,
    told: &Told,
    job: &Job,
) -> Result<Imported, ImportError> {
    let year = told.year.or(source.year);
    let mut members: Vec<Detail> = (built.found.iter().zip(&built.surfaces))
        .map(|(found, surface)| detail(found, surface, year, told))
        .collect();
    let carried = carry(&mut members, &standing(built), told);
    let failed = |e: std::io::Error| ImportError::write(folder, &e);
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !parent.is_dir() {
        fs::create_dir_all(parent).map_err(failed)?;
    }
    let aside = AsideFolder::begin(parent, ".import-").map_err(failed)?;
    let place = aside.path();
    gltf::write_glb(&place.join(MODEL), &built.model).map_err(failed)?;
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let text = scene(&name, source, built, &members, told);
    let put = |file_name: &str, text: &str| {
        file::put(&place.join(file_name), |out| std::io::Write::write_all(out, text.as_bytes()))
    };
    put("scene.ron", &text).map_err(failed)?;
    put(evidence::NAME, &evidence(&name, built)).map_err(failed)?;
    // What was written must be a scene like any other.
    let scene = Scene::load(&place.join("scene.ron"), job).map_err(|e| unfit(path, place, e))?;
    let imported = summary(folder, source, built, &members, carried);
    put("README.md", &readme(&name, source, built, &members, &imported, &scene, told))
        .map_err(failed)?;
    if folder.is_dir() {
        fs::remove_dir(folder).map_err(failed)?;
    }
    aside.settle(folder).map_err(failed)?;
    Ok(imported)
}

/// Why what was made of a model is no scene, without the name of the folder in which it was made.
fn unfit(path: &Path, aside: &Path, error: crate::LoadError) -> ImportError {
    if error == crate::LoadError::Cancelled {
        return ImportError::Cancelled;
    }
    let aside = format!("{}/", aside.display());
    ImportError::bad(
        path,
        format!(
            "what would be written of it is no scene ({}): mend the model there",
            error.to_string().replace(&aside, "")
        ),
    )
}

/// A member with what is said of it in the scene.
struct Detail<'a> {
    found: &'a Found,
    concrete: String,
    /// Of a class that is none of Eurocode 2.
    strength: Option<f32>,
    exposure: String,
    years: f32,
    reinforcement: Option<Reinforcement>,
    /// Why it has none.
    bare: Option<Bare>,
    assumed: Vec<Assumed>,
}

/// Why no bars were assumed for a member of concrete of which none are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Bare {
    /// Its surface is open.
    Open,
    /// It is too thin.
    Thin,
    /// They would lie outside of it.
    Outside,
    /// Its material is not known.
    Unknown,
}

impl Bare {
    fn why(self) -> &'static str {
        match self {
            Self::Open => "nobody knows what lies in an open surface",
            Self::Unknown => "its material may be no concrete",
            Self::Thin => "there is no room for bars with their cover",
            Self::Outside => {
                "straight bars along the axis would lie outside of what is bent, or has a bent section"
            }
        }
    }
}

fn detail<'a>(found: &'a Found, surface: &Surface, year: Option<i32>, told: &Told) -> Detail<'a> {
    let mut assumed = Vec::new();
    let (concrete, strength) = match &found.concrete {
        Some(Concrete::Class(class)) => (class.clone(), None),
        Some(Concrete::Strength(mpa)) => (format!("fck {mpa} MPa"), Some(*mpa)),
        None => {
            assumed.push(Assumed::Concrete);
            (assume::concrete(year).to_owned(), None)
        }
    };
    let exposure = found.exposure.clone().or(told.exposure.clone()).unwrap_or_else(|| {
        assumed.push(Assumed::Exposure);
        assume::exposure(found.kind).to_owned()
    });
    let years = year.and_then(|y| {
        (i32::try_from(this_year()).ok()? >= y).then_some(this_year() as f32 - y as f32)
    });
    if years.is_none() {
        assumed.push(Assumed::Age);
    }
    let fck = strength.or(concrete_class(&concrete)).unwrap_or(30.0);
    let unknown = found.steel == 0 && (found.other.is_none() || found.is_lightweight);
    let cover_mm = found.cover_mm.unwrap_or_else(|| assume::cover_mm(&exposure));
    let (mut reinforcement, mut bare) = (None, None);
    if unknown && found.tube.is_none() {
        let least = assume::reinforcement(&measures(found), f64::from(fck), cover_mm);
        match least {
            _ if found.is_unknown => bare = Some(Bare::Unknown),
            _ if found.volume <= 0.0 => bare = Some(Bare::Open),
            None => bare = Some(Bare::Thin),
            Some(least) if !assume::fits(&least, found.frame, surface) => {
                bare = Some(Bare::Outside);
            }
            least => reinforcement = least,
        }
    }
    if reinforcement.is_some() || (unknown && found.tube.is_some() && found.volume > 0.0) {
        assumed.push(Assumed::Reinforcement);
    }
    Detail {
        found,
        concrete,
        strength,
        exposure,
        years: years.unwrap_or(YEARS),
        reinforcement,
        bare,
        assumed,
    }
}

/// Gives members that lie more than the least bars where these would not carry them, as anything
/// that stands is carried; and says so.
fn carry(members: &mut [Detail], standing: &[Standing], told: &Told) -> Vec<String> {
    let (mut more, mut nothing) = (Vec::new(), Vec::new());
    for i in 0..members.len() {
        let span = span(members, standing, i);
        let Detail { found, reinforcement: Some(least), strength, concrete, .. } = &mut members[i]
        else {
            continue;
        };
        let lies = matches!(found.kind, MemberKind::Beam | MemberKind::Slab) && is_level(found);
        if !lies || found.lies_on_ground {
            continue;
        }
        let fck = f64::from(strength.or(concrete_class(concrete)).unwrap_or(30.0));
        let imposed = told.imposed_kpa.filter(|_| found.kind == MemberKind::Slab).unwrap_or(0.0);
        let imposed = 1e3 * f64::from(imposed);
        let name = format!("\"{}\" over {span:.1} m", crate::file::shorten(&found.name));
        match assume::carrying(&measures(found), least, span, fck, imposed) {
            Carrying::Least => {}
            Carrying::More(row) => {
                let is_below = |b: &&mut Bars| matches!(b, Bars::Row { side_deg: 180.0, .. });
                if let Some(below) = least.bars.iter_mut().find(is_below) {
                    *below = row;
                }
                more.push(name);
            }
            Carrying::Nothing => nothing.push(name),
        }
    }
    let listed = |names: &[String]| match names.len() {
        0..=3 => names.join(", "),
        n => format!("{} and {} more", names[..3].join(", "), n - 3),
    };
    let mut notes = Vec::new();
    if !more.is_empty() {
        notes.push(format!(
            "the least bars would not carry the own weight of {}: as many are assumed as EN 1992-1-1 asks for; they say nothing of the bars that are there",
            listed(&more)
        ));
    }
    if !nothing.is_empty() {
        notes.push(format!(
            "no bars carry the own weight of {} in its section: it is prestressed, or held by what the model lacks, or no simple beam; that its life ends by the assumed bars is an assumption and no damage: give reinforcement or supports in scene.ron",
            listed(&nothing)
        ));
    }
    notes
}

/// The longest way between what a member that lies rests on, m: its ends, and members that reach up
/// to it.
fn span(members: &[Detail], standing: &[Standing], i: usize) -> f64 {
    let frame = members[i].found.frame;
    let (length, along) = (frame.axis.length(), frame.axis.normalize_or_zero());
    let below = standing.iter().enumerate();
    let below = below.filter(|(k, other)| *k != i && reaches(other, &standing[i]));
    let held = below.map(|(_, other)| {
        let [low, high] = other.bounds;
        let middle = (0.5 * (low + high) - frame.start).dot(along);
        let half = 0.5 * (high - low).dot(along.abs());
        [middle - half, middle + half].map(|s| s.clamp(0.0, length))
    });
    let mut held: Vec<[f32; 2]> = held.chain([[0.0; 2], [length; 2]]).collect();
    held.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut longest, mut to) = (0.0_f32, 0.0_f32);
    for [from, end] in held {
        longest = longest.max(from - to);
        to = to.max(end);
    }
    f64::from(longest)
}

fn measures(found: &Found) -> Measures {
    let length = f64::from(found.frame.axis.length());
    Measures {
        kind: found.kind,
        length,
        across: found.across,
        is_round: found.is_round,
        area: found.volume / length.max(1e-9),
    }
}

pub(super) fn this_year() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    1970 + since / 31_556_952
}

/// A text as RON takes it.
fn quoted(text: &str) -> String {
    let plain: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!("\"{}\"", plain.replace('\\', "\\\\").replace('"', "\\\""))
}

/// A comment must not end its line.
fn comment(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn vector(v: Vec3) -> String {
    format!("({:.3}, {:.3}, {:.3})", v.x, v.y, v.z)
}

/// The word of a kind in JSON.
pub(super) fn word(kind: MemberKind) -> String {
    let value = serde_json::to_value(kind).ok();
    value.and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

fn scene(name: &str, source: &Source, built: &Built, members: &[Detail], told: &Told) -> String {
    let mut text = String::new();
    // What is of no member may lie far off: a house on the hill, a north arrow.
    let of_members = built.model.objects.iter().filter(|o| o.member.is_some());
    let seen: Vec<_> = match built.found.is_empty() {
        true => built.model.objects.clone(),
        false => of_members.cloned().collect(),
    };
    let bounds =
        Scene { meshes: built.model.meshes.clone(), objects: seen, ..Scene::default() }.bounds();
    let camera = Camera::overview(bounds);
    let title = if source.project.trim().is_empty() { name } else { &source.project };
    let _ = write!(
        text,
        "// Imported from {} ({}). README.md says what was assumed, by which rule. Edit what you know\n// better: what is in `assumed` is marked so wherever it is used, until you take it out.\n(\n    schema: \"intrados.scene/1\",\n    title: {},\n    models: [(file: \"{MODEL}\")],\n",
        comment(name),
        comment(&source.format),
        quoted(title)
    );
    text += &concretes(members);
    text += "    details: [\n";
    for member in members {
        text += &detail_text(member);
    }
    text += "    ],\n";
    if !built.model.lamps.iter().any(|l| matches!(l.kind, crate::LampKind::Environment { .. })) {
        text += "    lamps: [\n        Environment(name: \"sky\", radiance: (0.8, 1, 1.3)),\n        Directional(name: \"sun\", direction: (-0.5, -0.7, -0.5), strength: WattPerSquareMetre(3), colour: (1, 0.9, 0.75)),\n    ],\n";
    }
    if built.model.cameras.is_empty() {
        let _ = writeln!(
            text,
            "    cameras: [(name: \"overview\", position: {}, target: {}, fov_deg: {}, width: {}, height: {})],",
            vector(camera.position),
            vector(camera.target),
            camera.fov_deg,
            camera.width,
            camera.height
        );
    }
    text += &supports(members, &standing(built));
    text += &loads(members, told);
    text += &georeference(source, built);
    text += ")\n";
    text
}

/// Self weight, and what somebody said that slabs carry: from the day on which concrete has the
/// strength of its class.
fn loads(members: &[Detail], told: &Told) -> String {
    let mut all =
        vec!["(name: \"self weight\", action: SelfWeight, history: [(0, 0), (1, 1)])".into()];
    let slabs: Vec<String> = members
        .iter()
        .filter(|m| m.found.kind == MemberKind::Slab)
        .map(|m| format!("{:?}", m.found.id))
        .collect();
    if let (Some(kpa), false) = (told.imposed_kpa, slabs.is_empty()) {
        all.push(format!(
            "(name: \"imposed load\", members: [{}], action: Pressure(place: Top, pressure_kpa: {kpa}), history: [(28, 0), (29, 1)])",
            slabs.join(", ")
        ));
    }
    format!("    loads: [\n        {},\n    ],\n", all.join(",\n        "))
}

fn concretes(members: &[Detail]) -> String {
    let own: BTreeMap<&str, f32> =
        members.iter().filter_map(|m| Some((m.concrete.as_str(), m.strength?))).collect();
    if own.is_empty() {
        return String::new();
    }
    let list: Vec<String> =
        own.iter().map(|(name, mpa)| format!("(name: {}, fck_mpa: {mpa})", quoted(name))).collect();
    format!("    concretes: [{}],\n", list.join(", "))
}

fn detail_text(member: &Detail) -> String {
    let found = member.found;
    let mut text = format!(
        "        // {} {}{}: {:.2} m, {:.2} by {:.2} m across, {:.3} m³{}{}\n",
        word(found.kind),
        comment(&quoted(&found.name)),
        if found.class.is_empty() { String::new() } else { format!(" ({})", found.class) },
        found.frame.axis.length(),
        found.across[0],
        found.across[1],
        found.volume,
        if found.steel > 0 { format!(", {} bars", found.steel) } else { String::new() },
        of_segments(found)
    );
    let _ = write!(
        text,
        "        (member: {}, concrete: {}, exposure: (class: {}, years: {})",
        quoted(&found.id),
        quoted(&member.concrete),
        quoted(&member.exposure),
        member.years
    );
    if let Some(matter) = &found.other {
        let _ = write!(
            text,
            ",\n            matter: (name: {}, modulus_gpa: {}, poisson: {}, density_kg_m3: {}, expansion_1e6_k: {}{})",
            quoted(&matter.name),
            matter.modulus_gpa,
            matter.poisson,
            matter.density_kg_m3,
            matter.expansion_1e6_k,
            matter.strength_mpa.map_or_else(String::new, |mpa| format!(", strength_mpa: {mpa}"))
        );
    }
    if let Some(tube) = &found.tube {
        let (thickness, length) = (tube.outer - tube.inner, tube.axis.length());
        let laid =
            if found.steel == 0 { lining(member, tube.inner, thickness) } else { String::new() };
        let _ = write!(
            text,
            ",\n            body: Tunnel(radius_m: {:.4}, length_m: {length:.4}, inner_lining: (thickness_m: {thickness:.4}{laid}), ground: (model: Springs(radial_mpa_m: 40, tangential_mpa_m: 13)))",
            tube.inner
        );
    }
    if let Some(r) = &member.reinforcement {
        let _ = write!(text, ",\n            reinforcement: {}", reinforcement(r));
    }
    if !member.assumed.is_empty() {
        let _ = write!(text, ",\n            assumed: [{}]", assume::listed(&member.assumed));
    }
    text + "),\n"
}

/// The segments of a ring that they close.
fn of_segments(found: &Found) -> String {
    match &found.segments[..] {
        [] => String::new(),
        some => format!(", of the segments {}", comment(&some.join(", "))),
    }
}

/// Hoops and bars of a lining: at each face half of .002 A_c around and half of .001 A_c along
/// (EN 1992-1-1, 9.6, the ring being what bears), in whole centimetres and whole bars.
fn lining(member: &Detail, radius: f64, thickness: f64) -> String {
    let cover = assume::cover_mm(&member.exposure);
    let bar = |diameter: f64| std::f64::consts::FRAC_PI_4 * (diameter * 1e-3).powi(2);
    let (around, along) = (0.001 * thickness, 0.0005 * thickness);
    let fits = |d: &f64, area: f64| bar(*d) / area >= 0.1;
    let choose = |area: f64| {
        [8.0, 10.0, 12.0, 16.0, 20.0, 25.0].into_iter().find(|d| fits(d, area)).unwrap_or(28.0)
    };
    let (hoop, straight) = (choose(around), choose(along));
    let spacing = ((bar(hoop) / around).min(0.3) * 100.0).floor() * 10.0;
    let way = std::f64::consts::TAU * radius;
    let count = (way / (bar(straight) / along).min(0.4)).ceil();
    format!(
        ", cover_mm: {cover}, steel: \"{STEEL}\", hoops: (diameter_mm: {hoop}, spacing_mm: {spacing}), bars: (count: {count}, diameter_mm: {straight})"
    )
}

fn reinforcement(r: &Reinforcement) -> String {
    let bars: Vec<String> = r
        .bars
        .iter()
        .map(|b| match b {
            Bars::Around { count, diameter_mm, .. } => {
                format!("Around(count: {count}, diameter_mm: {diameter_mm})")
            }
            Bars::Row { side_deg, count, diameter_mm, .. } => {
                format!("Row(side_deg: {side_deg}, count: {count}, diameter_mm: {diameter_mm})")
            }
        })
        .collect();
    let stirrups = r.stirrups.as_ref().map_or(String::new(), |s| {
        format!(", stirrups: (diameter_mm: {}, spacing_mm: {})", s.diameter_mm, s.spacing_mm)
    });
    format!(
        "(cover_mm: {}, steel: {}, bars: [{}]{stirrups})",
        r.cover_mm,
        quoted(&r.steel),
        bars.join(", ")
    )
}

/// Every member as the ground sees it.
fn standing(built: &Built) -> Vec<Standing> {
    let bounds = |id: &str| {
        let member = built.model.members.iter().find(|m| m.id == id);
        member.map_or([Vec3::ZERO; 2], |m| m.bounds)
    };
    let one = |found: &Found| Standing {
        kind: found.kind,
        bounds: bounds(&found.id),
        is_level: is_level(found),
        is_tube: found.tube.is_some(),
        is_grounded: found.lies_on_ground,
    };
    built.found.iter().map(one).collect()
}

fn is_level(found: &Found) -> bool {
    found.frame.axis.normalize_or_zero().y.abs() < 0.7
}

/// What the ground holds, and for each other member what stands for those that carry it: what
/// stands is held at its foot, what lies on a bearing under each end.
fn supports(members: &[Detail], standing: &[Standing]) -> String {
    let mut text = String::from(
        "    // The ground holds what stands on it. The others are carried: their supports, `alone`, hold them only\n    // where each is computed by itself; `analyze --whole` leaves those out and follows the loads down.\n    supports: [\n",
    );
    let on_ground = on_ground(standing);
    for ((Detail { found, .. }, on_ground), stands) in members.iter().zip(on_ground).zip(standing) {
        let id = quoted(&found.id);
        let alone = if on_ground { "" } else { ", alone: true" };
        let mut hold = |place: &str, how: &str| {
            let _ = writeln!(text, "        (member: {id}, place: {place}, hold: {how}{alone}),");
        };
        let level = is_level(found);
        if found.tube.is_some() {
            let how = along_axis(found.frame.axis.normalize_or_zero());
            for end in ["Start", "End"] {
                hold(end, &how);
            }
        } else if found.kind == MemberKind::Footing
            || found.lies_on_ground
            || is_blinding(standing, stands)
        {
            hold("Bottom", "Springs(stiffness_mpa_m: (20, 50, 20), lifts: true)");
        } else if level {
            // Bearings: lines across, which let the ends turn; one end alone holds it along.
            hold("Surface(from: 0, to: 0, side_deg: 180)", "Fixed");
            hold(
                "Surface(from: 1, to: 1, side_deg: 180)",
                "Directions(x: false, y: true, z: false)",
            );
        } else {
            hold("Bottom", "Fixed");
        }
    }
    text + "    ],\n"
}

/// What holds a tunnel along its axis and leaves its rings free: a direction of the world where it
/// runs along one, else springs.
fn along_axis(axis: Vec3) -> String {
    let [x, y, z] = axis.abs().to_array().map(|c| c > 0.999);
    if x || y || z {
        return format!("Directions(x: {x}, y: {y}, z: {z})");
    }
    let stiffness = 100.0 * axis * axis;
    format!("Springs(stiffness_mpa_m: {})", vector(stiffness))
}

/// Where the model lies on earth, for who puts results back on it or on a map.
fn place(source: &Source, built: &Built) -> Georeference {
    let found = &source.georeference;
    Georeference {
        offset_m: built.offset.to_array(),
        map: found.map.as_ref().map(|map| MapOrigin {
            crs: map.crs.clone(),
            eastings: map.eastings,
            northings: map.northings,
            height: map.height,
            x_axis: [map.abscissa.unwrap_or(1.0), map.ordinate.unwrap_or(0.0)],
            scale: map.scale.unwrap_or(1.0),
        }),
        latitude_deg: found.latitude,
        longitude_deg: found.longitude,
        elevation_m: found.elevation,
    }
}

/// The field of the scene that says so; nothing where nothing is known.
fn georeference(source: &Source, built: &Built) -> String {
    let place = place(source, built);
    if place == Georeference::default() {
        return String::new();
    }
    let mut fields = vec![format!("offset_m: {}", numbers(&place.offset_m))];
    if let Some(map) = &place.map {
        fields.push(format!(
            "map: (crs: {:?}, eastings: {}, northings: {}, height: {}, x_axis: {}, scale: {})",
            map.crs,
            map.eastings,
            map.northings,
            map.height,
            numbers(&map.x_axis),
            map.scale
        ));
    }
    let rest = [
        ("latitude_deg", place.latitude_deg),
        ("longitude_deg", place.longitude_deg),
        ("elevation_m", place.elevation_m),
    ];
    fields.extend(rest.iter().filter_map(|(name, v)| Some(format!("{name}: {}", (*v)?))));
    format!("    georeference: ({}),\n", fields.join(", "))
}

/// A tuple of RON.
fn numbers(values: &[f64]) -> String {
    format!("({})", values.iter().map(f64::to_string).collect::<Vec<_>>().join(", "))
}

/// Where the model lies on earth, in sentences.
fn whereabouts(source: &Source, built: &Built) -> Vec<String> {
    let (place, mut lines) = (place(source, built), Vec::new());
    if place.offset_m != [0.0; 3] {
        let offset = numbers(&place.offset_m);
        lines.push(format!("coordinates here are those of the file (y up) less {offset} m"));
    }
    if let Some(map) = &place.map {
        let crs = if map.crs.is_empty() { "an unnamed reference system" } else { &map.crs };
        lines.push(format!(
            "the file's origin is at {:.3} E, {:.3} N, {:.3} m in {crs}, its x axis along {}",
            map.eastings,
            map.northings,
            map.height,
            numbers(&map.x_axis)
        ));
    }
    if let (Some(latitude), Some(longitude)) = (place.latitude_deg, place.longitude_deg) {
        let height = place.elevation_m.map_or(String::new(), |e| format!(", {e} m"));
        lines.push(format!("the site is at {}{height}", words(latitude, longitude)));
    }
    lines
}

/// A file for evidence that is still to come; its examples are of the first member.
fn evidence(name: &str, built: &Built) -> String {
    let id = quoted(built.found.first().map_or("C1", |f| f.id.as_str()));
    evidence::skeleton(&comment(name), id.get(1..id.len() - 1).unwrap_or_default())
}

fn summary(
    folder: &Path,
    source: &Source,
    built: &Built,
    members: &[Detail],
    carried: Vec<String>,
) -> Imported {
    let mut kinds: BTreeMap<MemberKind, usize> = BTreeMap::new();
    let mut volumes: BTreeMap<MemberKind, f64> = BTreeMap::new();
    for found in &built.found {
        *kinds.entry(found.kind).or_default() += 1;
        *volumes.entry(found.kind).or_default() += found.volume;
    }
    let count = |what: Assumed| members.iter().filter(|m| m.assumed.contains(&what)).count();
    let mut notes: Vec<String> = source.notes.iter().chain(&built.notes).cloned().collect();
    let standing = standing(built);
    notes.extend(questions(built, &standing, &on_ground(&standing)));
    let others: BTreeMap<&str, (usize, &Matter)> =
        built.found.iter().filter(|f| !f.is_lightweight).filter_map(|f| f.other.as_ref()).fold(
            BTreeMap::new(),
            |mut m, o| {
                m.entry(o.name.as_str()).or_insert((0, o)).0 += 1;
                m
            },
        );
    for (count, matter) in others.into_values() {
        notes.push(format!(
            "{count} members are of {} (E some {} GPa, {} kg/m³), which is no concrete: {}",
            matter.name,
            matter.modulus_gpa,
            matter.density_kg_m3,
            match matter.strength_mpa {
                Some(mpa) => format!(
                    "they are computed as elastic up to {mpa} MPa, which is assumed where the name says no class"
                ),
                None => "they are computed as concrete all the same".into(),
            }
        ));
    }
    notes.extend(bare(members));
    notes.extend(carried);
    if built.steel.loose > 0 {
        let first = built.loose.first().map_or("", String::as_str);
        notes.push(format!(
            "{} bars and tendons, such as \"{first}\", lie in no member and are shown alone: they reinforce nothing",
            built.steel.loose
        ));
    }
    // A glTF file's own reader may have said it.
    let is_told = notes.iter().any(|note| note.contains("no structural members"));
    if built.found.is_empty() && !is_told {
        notes.push(no_members(source, built));
    }
    Imported {
        folder: folder.into(),
        format: source.format.clone(),
        members: kinds,
        volume_m3: volumes,
        steel_lines: built.steel.laid,
        loose_steel: built.steel.loose,
        scenery: built.scenery.clone(),
        concrete_assumed: count(Assumed::Concrete),
        reinforcement_assumed: count(Assumed::Reinforcement),
        materials: (built.materials.iter())
            .map(|((name, taken_for), elements)| MaterialUse {
                name: name.clone(),
                elements: *elements,
                taken_for: taken_for.clone(),
            })
            .collect(),
        offset_m: built.offset.to_array(),
        notes,
    }
}

/// What a file of its format needs so that members are found in it.
fn no_members(source: &Source, built: &Built) -> String {
    if source.is_ifc {
        return format!(
            "no structural members were found among {}: IFC says them by class (IfcColumn, IfcBeam, IfcSlab, IfcWall, IfcFooting …): export with these, or say what a body is by --kind \"NAME=beam\"",
            listed(&built.scenery)
        );
    }
    let needs = match source.format.as_str() {
        "OBJ" => {
            "name its objects or groups for what they are (o Column_1, g Beam_2, o Slab_EG, Wall, Footing, Lining)"
        }
        _ => {
            "name nodes for what they are (Column_1, COL_2, BEAM_…, SLAB_…, WALL_…, FOOTING_…, LINING_…), give them extras.intrados, or put a .props.json beside the file"
        }
    };
    let named = source.elements.iter().map(|e| e.name.as_str()).filter(|n| !n.is_empty());
    let named: Vec<String> =
        named.take(3).map(|n| format!("\"{}\"", crate::file::shorten(n))).collect();
    let found = if named.is_empty() { "nothing has a name".into() } else { named.join(", ") };
    format!("no structural members were found (there are {found}): {needs}")
}

/// Which members have no bars, and why.
fn bare(members: &[Detail]) -> Vec<String> {
    let mut of: BTreeMap<Bare, Vec<&str>> = BTreeMap::new();
    for member in members {
        // Of unknown materials another note says it.
        if let Some(why) = member.bare.filter(|why| *why != Bare::Unknown) {
            of.entry(why).or_default().push(&member.found.name);
        }
    }
    let said = |(why, names): (Bare, Vec<&str>)| {
        let named = names.iter().take(3).map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ");
        let more = match names.len() {
            0..=3 => String::new(),
            n => format!(" and {} more", n - 3),
        };
        let count = match names.len() {
            1 => "one member".to_owned(),
            n => format!("{n} members"),
        };
        format!(
            "no bars are assumed for {count}: {} ({named}{more}); give reinforcement in details of scene.ron",
            why.why()
        )
    };
    of.into_iter().map(said).collect()
}

fn readme(
    name: &str,
    source: &Source,
    built: &Built,
    members: &[Detail],
    imported: &Imported,
    scene: &Scene,
    told: &Told,
) -> String {
    let mut text = format!(
        "# {}\n\nImported from `{name}` ({}) by Intrados {}.\n\n    intrados validate scene.ron\n    intrados analyze scene.ron --member ID --out stress\n    intrados predict scene.ron --out report\n\n## What was read\n\n| kind | members | m³ | told by |\n|---|---:|---:|---|\n",
        if source.project.trim().is_empty() { name } else { &source.project },
        source.format,
        env!("CARGO_PKG_VERSION")
    );
    for (kind, count) in &imported.members {
        let by: std::collections::BTreeSet<_> =
            built.found.iter().filter(|f| f.kind == *kind).map(|f| f.by).collect();
        let by: Vec<&str> = by.into_iter().map(super::kind::By::name).collect();
        let volume = imported.volume_m3.get(kind).copied().unwrap_or(0.0);
        let _ = writeln!(text, "| {} | {count} | {volume:.3} | {} |", word(*kind), by.join(", "));
    }
    let _ = writeln!(
        text,
        "\nSteel: {} bars, stirrups and tendons lie in members, {} in none. Scenery: {}.\n",
        imported.steel_lines,
        imported.loose_steel,
        listed(&imported.scenery)
    );
    text += &materials(&imported.materials);
    text += &rules(source, built, members, imported, told.year.or(source.year), told);
    text += "\n## Place\n\n";
    let place = whereabouts(source, built);
    if place.is_empty() {
        text += "The file says nothing of where it lies on earth.\n";
    }
    for line in place {
        let _ = writeln!(text, "- {}", comment(&line));
    }
    text += "\n## Remarks\n\n";
    for note in imported.notes.iter().chain(&scene.warnings) {
        let _ = writeln!(text, "- {}", comment(note));
    }
    text
}

/// Each material with what was made of it, as a table.
fn materials(all: &[MaterialUse]) -> String {
    if all.is_empty() {
        return "The file names no material.\n\n".into();
    }
    let cell = |text: &str| comment(text).replace('|', "\\|");
    let rows = all
        .iter()
        .map(|m| format!("| {} | {} | {} |\n", cell(&m.name), m.elements, cell(&m.taken_for)));
    let rows: String = rows.collect();
    format!("| material | elements | taken for |\n|---|---:|---|\n{rows}\n")
}

fn listed(counts: &BTreeMap<String, usize>) -> String {
    let list: Vec<String> = counts.iter().map(|(name, n)| format!("{n} {name}")).collect();
    if list.is_empty() { "none".into() } else { list.join(", ") }
}

/// What was taken for unit and direction of a file that says neither.
fn orientation(source: &Source, told: &Told) -> String {
    let unit = told.metres.is_none() && source.format == "OBJ";
    let up = told.up.is_none() && source.format == "OBJ";
    match (unit, up) {
        (true, true) => {
            "- **Unit and direction**: metres, y up; OBJ says neither: give `--unit` and `--up`.\n"
        }
        (true, false) => "- **Unit**: metres; OBJ says none: give `--unit`.\n",
        (false, true) => "- **Direction**: y up; OBJ says none: give `--up`.\n",
        (false, false) => "",
    }
    .into()
}

/// The rules by which what nobody stated was assumed, and for how many members.
fn rules(
    source: &Source,
    built: &Built,
    members: &[Detail],
    imported: &Imported,
    year: Option<i32>,
    told: &Told,
) -> String {
    let count = |what: Assumed| members.iter().filter(|m| m.assumed.contains(&what)).count();
    let known = year.map_or("no year of building is known".into(), |y| format!("built in {y}"));
    let all = members.len();
    format!(
        "## What was assumed\n\nWhat is assumed is listed in `assumed` of each member in scene.ron, marked so wherever it is used, and widens the error bars of the forecast. State it, and take it out of the list.\n\n\
- **Concrete** of {} of {all} members ({known}): C12/15 before 1950, C20/25 before 1972, C25/30 before 2001, C30/37 since and where no year is known. This is a rule of Intrados, of no code.\n\
- **Exposure** of {}: XC4 (wet and dry in turn), XC2 for footings and piles (EN 206, table 1). Salt is not assumed: give `--exposure \"XC4, XD3\"` where it comes.\n\
- **Age** of {}: {YEARS} years.\n\
- **Reinforcement** of {}: the least that EN 1992-1-1 allows, {STEEL}: beams §9.2.1.1 and §9.2.2, slabs and footings §9.3.1.1, columns §9.5.2 and §9.5.3, walls and linings §9.6, piles §9.8.5; cover of table 4.4N (structural class S4) and Δc_dev = 10 mm. Beams and slabs whose least bars would not carry their own weight over the longest way between what they rest on have as many below as §6.1 asks for, and Remarks say so. Bars are straight, and slant as their member tapers; where they would not lie in it, as in an arch, none are assumed, and Remarks say so. Real members have more: their bars are what to look for first.\n\
- **Steel grade** of {} bars: {STEEL}.\n\
- **Supports**: the ground holds footings, approach and base slabs by predefined type or name (springs of 50 MPa/m), tunnels (springs of 40 MPa/m), columns and walls that nothing reaches up to, slabs right below a footing, and the lowest slabs (at their ends: a deck that is modelled alone lies on none). Every other member is held for itself, `alone`, what stands at its foot, what lies under both ends; the whole (`analyze --whole`) leaves those supports out. What lies rests on a line across its soffit at each end, of which one holds it along, so that its ends turn freely.\n{}- **Loads**: {}.\n",
        imported.concrete_assumed,
        count(Assumed::Exposure),
        count(Assumed::Age),
        imported.reinforcement_assumed,
        built.steel.assumed,
        orientation(source, told),
        match told.imposed_kpa {
            Some(kpa) => format!("self weight, and {kpa} kN/m² on slabs, as was said"),
            None => "self weight alone: give `--imposed` for what slabs carry".into(),
        },
    )
}
