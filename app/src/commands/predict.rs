//! `intrados predict`: all evidence, damage per member, report.

use std::{
    path::Path,
    sync::Arc,
    time::{SystemTime, UNIX_EPOCH},
};

use glam::Vec3;
use intrados_damage::{
    Picture, Prediction, detect, forecast,
    grading::{Profile, ProfileError},
    ledger::Group,
    predict::{MemberPrediction, Settings, predict},
    projected::projected,
    report::{Provenance, write},
    shown::{Sensor, shown},
    surface::{coloured, facets},
};
use intrados_light::{LitScene, Render, RenderSettings, Sides, View, plugin::framing, scene_rule, tone::Tone};
use intrados_scene::{Camera, Scene, gltf::Model};

use super::{
    info::kind_name,
    render::MapRows,
    walks::{self, Opened},
};
use crate::{
    args,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// Pictures of members in a report; the worst ones.
const MOST_PICTURES: usize = 12;
/// Their size, pixels.
const SIZE: [u32; 2] = [640, 440];

pub(crate) fn run(session: &Session, args: &args::Predict) -> Result<Outcome, Failure> {
    let opened = walks::open(session, &args.scene)?;
    let scene = &opened.scene;
    let settings = Settings {
        detect: detect::Settings { method: args.method.into(), ..detect::Settings::default() },
        profile: profile(scene, args.profile.as_deref())?,
        forecast: (!args.no_forecast).then_some(forecast::Settings { ahead_years: args.ahead, element_m: args.element }),
    };
    output::folder(&args.out)?;
    output::may_write(&args.out.join("report.html"))?;
    let mut prediction = {
        let _progress = session.watch(format!("the evidence of {}", scene.name));
        predict(scene, settings, &[], &session.job)?
    };
    let pictures = if args.spp > 0 { pictures(session, &opened, &prediction, args)? } else { Vec::new() };
    if args.spp > 0 {
        let _progress = session.watch("what a photograph would show");
        for camera in &scene.cameras {
            prediction.shown.extend(shown(&opened.lit, camera, Sensor::default(), args.seed, &session.job)?);
        }
    }
    if !scene.file.scanners.is_empty() {
        let _progress = session.watch("what a projection would show");
        prediction.projected = projected(scene, args.seed, &session.job)?;
    }
    let provenance = Provenance {
        date: today(),
        command: std::env::args().collect::<Vec<_>>().join(" "),
        seed: (!pictures.is_empty()).then_some(args.seed),
        samples: (!pictures.is_empty()).then_some(args.spp),
    };
    write(&args.out, scene, &mut prediction, &pictures, &provenance)?;
    session.print(&prediction, || table(&prediction))?;
    Ok(Outcome::Done)
}

/// The profile of the command line, a file or the name of one that is built in; or the scene's.
fn profile(scene: &Scene, asked: Option<&Path>) -> Result<Profile, Failure> {
    let profile = match asked {
        None => Profile::of(scene).map(Option::unwrap_or_default),
        Some(path) => match path.to_str().and_then(Profile::built_in).filter(|_| !path.is_file()) {
            Some(built_in) => Ok(built_in),
            None => Profile::read(path),
        },
    };
    profile.map_err(|why| match why {
        ProfileError::Unread { path, why } => Failure::denied(&path, &why),
        other => Failure::BadInput(other.to_string()),
    })
}

/// The whole scene as it looks; then, coloured by damage, the whole and the worst members that there is evidence for.
fn pictures(session: &Session, opened: &Opened, prediction: &Prediction, args: &args::Predict) -> Result<Vec<Picture>, Failure> {
    let scene = &opened.scene;
    let overview = scene.cameras.first().cloned().unwrap_or_else(|| framing(scene));
    // A segment that is foretold to be sound needs no portrait.
    let shows =
        |m: &MemberPrediction| m.evidence.values().any(|e| e.measured) || m.damage.is_some_and(|d| d >= prediction.profile.damaged_from());
    let mut members: Vec<(usize, &MemberPrediction)> = prediction.members.iter().enumerate().filter(|(_, m)| shows(m)).collect();
    members.sort_by(|(_, a), (_, b)| b.damage.partial_cmp(&a.damage).unwrap_or(std::cmp::Ordering::Equal));
    let mut shots = vec![(&opened.lit, overview.clone(), format!("{}, camera {}", scene.name, overview.name))];
    let _progress = session.watch("rendering the report's pictures");
    let known = prediction.members.iter().any(|m| m.damage.is_some());
    let painted = if known { Some(painted(session, scene, prediction)?) } else { None };
    if let Some(painted) = &painted {
        const LEGEND: &str = "violet: sound (d = 0), green: half of the strength lost, yellow: all of it; grey: nothing known";
        shots.push((painted, overview.clone(), format!("The same, members coloured by damage; {LEGEND}")));
        for (index, member) in members.into_iter().take(MOST_PICTURES) {
            // From within a lining its camera sees it best.
            if let Some(camera) = portrait(scene, index, &overview) {
                shots.push((painted, camera, format!("{}: {}, coloured by damage", member.name, member.state)));
            }
        }
    }
    let mut pictures = Vec::new();
    for (n, (lit, camera, caption)) in shots.iter().enumerate() {
        session.job.step(n, shots.len())?;
        pictures.push(shot(session, Arc::clone(lit), camera, caption, args)?);
    }
    Ok(pictures)
}

/// The scene with its members coloured by damage, ready for light.
fn painted(session: &Session, scene: &Scene, prediction: &Prediction) -> Result<Arc<LitScene>, Failure> {
    let Model { meshes, objects, materials, .. } = coloured(scene, &facets(scene), prediction);
    let painted = Scene { meshes, objects, materials, ..scene.clone() };
    Ok(Arc::new(LitScene::build(Arc::new(painted), &session.job)?))
}

/// A camera that shows one member from where the overview stands; `None` where that is inside the member.
fn portrait(scene: &Scene, member: usize, overview: &Camera) -> Option<Camera> {
    let [low, high] = scene.members.get(member)?.bounds;
    let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let inside = overview.position.cmpge(low).all() && overview.position.cmple(high).all();
    if inside || radius <= 0.0 {
        return None;
    }
    let way = (overview.position - centre).normalize_or(Vec3::Z);
    // Just far enough that the member's sphere fills the narrower side of the picture; never farther than the overview, where walls may be.
    let half = (0.5 * overview.fov_deg.to_radians()).tan() * SIZE[1] as f32 / SIZE[0] as f32;
    let distance = (radius * (1.0 + 1.0 / (half * half)).sqrt()).min((overview.position - centre).length());
    Some(Camera { name: "portrait".into(), position: centre + way * distance, target: centre, ..overview.clone() })
}

fn shot(session: &Session, lit: Arc<LitScene>, camera: &Camera, caption: &str, args: &args::Predict) -> Result<Picture, Failure> {
    let camera = Camera { width: SIZE[0], height: SIZE[1], ..camera.clone() };
    let settings = RenderSettings {
        sides: Sides::Primal,
        rule: scene_rule(&lit.scene),
        seed: args.seed,
        samples: Some(args.spp),
        orders: false,
        ..RenderSettings::default()
    };
    let mut render = Render::new(lit, &camera, &settings);
    while render.advance(8) {
        if session.job.is_cancelled() {
            return Err(Failure::Interrupted);
        }
    }
    let tone = Tone { exposure: camera.exposure, ..Tone::default() };
    let rgb = render.image(View::Combined, None).mean.into_iter().flat_map(|radiance| tone.encode(radiance)).collect();
    Ok(Picture { width: SIZE[0] as usize, height: SIZE[1] as usize, rgb, caption: caption.to_owned() })
}

/// Date and time in UTC (days to civil date: Hinnant, "chrono-compatible low-level date algorithms").
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let days = seconds / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    let (hour, minute) = (seconds / 3600 % 24, seconds / 60 % 60);
    format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02} UTC")
}

fn table(prediction: &Prediction) -> String {
    let mut rows = vec![["member", "kind", "damage", "std error", "state", "truth", "evidence"].map(String::from)];
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.3}"));
    for m in &prediction.members {
        rows.push([
            m.name.clone(),
            kind_name(m.kind),
            number(m.damage),
            number(m.damage_std_error),
            m.state.clone(),
            number(m.truth.as_ref().map(|t| t.damage)),
            m.evidence.values().map(|e| format!("{} {:.2}", e.source, e.damage)).collect::<Vec<_>>().join(", "),
        ]);
    }
    let mut text = output::table(&rows.map_rows());
    text += &ledger(prediction);
    for m in &prediction.members {
        m.conflicts.iter().for_each(|c| text += &format!("conflict {}, {c}\n", m.name));
        if let Some(check) = m.crack_check.as_ref().filter(|c| c.exceeded) {
            text += &format!(
                "crack {}: {:.2} mm ({}), limit {} mm in {}\n",
                m.name, check.width_mm, check.source, check.limit_mm, check.exposure
            );
        }
    }
    prediction.limits.iter().for_each(|l| text += &format!("note: {l}\n"));
    prediction.files.iter().for_each(|f| text += &format!("file {f}\n"));
    text
}

/// Every item of evidence and what became of it; items alike share a line.
fn ledger(prediction: &Prediction) -> String {
    let mut rows = vec![["member", "source", "evidence", "used"].map(String::from)];
    for group in Group::all(&prediction.items) {
        let first = group.first();
        rows.push([first.member.clone(), first.source.to_owned(), group.name(), first.verdict()]);
    }
    if rows.len() > 1 { format!("\n{}\n", output::table(&rows.map_rows())) } else { String::new() }
}
