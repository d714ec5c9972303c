//! The picture as a file.

use std::{
    error::Error,
    path::{Path, PathBuf},
    sync::Arc,
};

use bevy_ecs::prelude::*;
use egui::{ColorImage, Ui};
use intrados_light::Render;
use intrados_stage::{
    Jobs, Task,
    file::{Unfinished, file_name},
};
use intrados_transport::Side;

use crate::{
    Action, Actions, Banners, Log, Look, Quantity,
    destination::Destination,
    fields::{self, Fields, Painted},
    lang::{local, term},
    leaf::{Drawing, Leaf},
    legend::{Legend, put_under},
    number::{count, plus_minus, significant},
    picture,
    toast::Toasts,
};

/// Writes a film to a file, or says why it cannot.
type Write = dyn Fn(&Render, &Path) -> Result<(), Box<dyn Error + Send + Sync>> + Send + Sync;

/// Writes a film with all its data (EXR); put there by who knows the format. Runs off the frame.
#[derive(Resource, Clone)]
pub struct Exporter(pub Arc<Write>);

/// The sheet that asks for a file name, and the write that runs.
#[derive(Resource, Default)]
pub(crate) struct Export {
    pub(crate) shown: bool,
    pub(crate) to: Destination,
    task: Option<Task<Result<Written, String>>>,
}

/// Where a picture was written, and what it shows.
struct Written {
    path: String,
    what: String,
}

impl Export {
    pub(crate) fn toggle(&mut self, scene: &str) {
        self.shown = !self.shown;
        if self.to.path.is_empty() {
            self.to.path = format!("{}.png", file_name(scene));
        }
        self.to.take_keyboard();
    }

    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some()
    }
}

/// The sheet.
pub(crate) fn sheet(
    InMut(ui): InMut<Ui>,
    mut export: ResMut<Export>,
    render: Option<Res<Render>>,
    look: Res<Look>,
    fields: Res<Fields>,
    exporter: Option<Res<Exporter>>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
) {
    ui.label(tr!(
        "PNG: the picture as it is shown now. EXR: linear radiance with its variance, samples and \
         orders."
    ));
    let is_entered = ui.horizontal(|ui| {
        let is_entered = export.to.field(ui, tr!("File name"), 280.0);
        if ui.button(tr!("Browse…")).clicked() {
            actions.ask(Action::ChooseExport);
        }
        is_entered
    });
    let is_entered = is_entered.inner;
    let path = PathBuf::from(export.to.path.trim());
    let kind =
        path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let problem = match (kind.as_str(), &render, &exporter) {
        (_, None, _) => Some(tr!("There is no picture yet.")),
        ("png", ..) if matches!(look.quantity, Quantity::Field(side) if fields.painted(side).is_none()) => {
            Some(tr!("The field is not known yet."))
        }
        ("png", ..) => None,
        ("exr", _, Some(_)) => None,
        ("exr", _, None) => Some(tr!("This build writes no EXR; use `intrados render`.")),
        _ => Some(tr!("The name must end in .png or .exr.")),
    };
    let is_writing = export.task.is_some().then(|| tr!("Another file is being written."));
    let problem = problem.or(is_writing);
    if is_entered && problem.is_some() {
        export.to.take_keyboard();
    }
    ui.horizontal(|ui| {
        let button = ui.add_enabled(problem.is_none(), egui::Button::new(tr!("Save")));
        if (button.clicked() || is_entered && problem.is_none())
            && let Some(render) = render
        {
            export.shown = false;
            export.task = Some(save(
                ui,
                &mut jobs,
                &render,
                &look,
                &fields,
                exporter.filter(|_| kind == "exr").as_deref(),
                path,
            ));
        }
        if let Some(problem) = problem {
            ui.weak(problem);
        }
    });
}

fn save(
    ui: &Ui,
    jobs: &mut Jobs,
    render: &Render,
    look: &Look,
    fields: &Fields,
    exporter: Option<&Exporter>,
    path: PathBuf,
) -> Task<Result<Written, String>> {
    let label = tr!("writing {}", path.display());
    match exporter.cloned() {
        Some(exporter) => {
            let render = render.clone();
            Task::spawn(jobs, label, move |_| {
                (exporter.0)(&render, &path).map_err(|e| e.to_string())?;
                Ok(Written { path: path.display().to_string(), what: String::new() })
            })
        }
        None => {
            let painted =
                if let Quantity::Field(side) = look.quantity { fields.painted(side) } else { None };
            let film = || {
                picture::pixels(
                    render,
                    look,
                    render.share(),
                    None,
                    0..render.camera().height as usize,
                )
            };
            let image = painted.map_or_else(film, |painted| painted.image.clone());
            let legend = legend(look, painted).map(|legend| legend.drawn(ui, image.width()));
            let what = describe(render, look, painted.map(|painted| painted.scale.range));
            Task::spawn(jobs, label, move |_| {
                let image = match &legend {
                    Some(legend) => put_under(&image, legend),
                    None => image,
                };
                write_png(&image, &path, &what).map_err(|e| e.to_string())?;
                Ok(Written { path: path.display().to_string(), what })
            })
        }
    }
}

/// Light, its error, and what is known of the fields, as pictures for files.
pub(crate) fn leaves(ui: &Ui, render: &Render, look: &Look, fields: &Fields) -> Vec<Leaf> {
    if render.samples_per_pixel() <= 0.0 {
        return Vec::new();
    }
    let (film, share) = (Arc::new(render.clone()), render.share());
    let [width, height] = [render.camera().width, render.camera().height].map(|n| n as usize);
    let leaf = |(name, quantity): (&str, Quantity)| {
        let look = Look { quantity, ..*look };
        let painted = match quantity {
            Quantity::Field(side) => Some(fields.painted(side)?),
            Quantity::Radiance | Quantity::Error => None,
        };
        let width = painted.map_or(width, |painted| painted.image.width());
        let draw: Drawing = match painted {
            Some(painted) => {
                let image = painted.image.clone();
                Box::new(move || image)
            }
            None => {
                let film = Arc::clone(&film);
                Box::new(move || picture::pixels(&film, &look, share, None, 0..height))
            }
        };
        let what = describe(render, &look, painted.map(|painted| painted.scale.range));
        let legend = legend(&look, painted).map(|legend| legend.drawn(ui, width));
        Some(Leaf { name: name.into(), what, legend, draw })
    };
    let all = [
        ("light", Quantity::Radiance),
        ("light-error", Quantity::Error),
        ("field-primal", Quantity::Field(Side::Primal)),
        ("field-dual", Quantity::Field(Side::Dual)),
    ];
    all.into_iter().filter_map(leaf).collect()
}

/// What goes under the picture, where it is in false colour.
fn legend(look: &Look, painted: Option<&Painted>) -> Option<Legend> {
    match look.quantity {
        Quantity::Radiance => None,
        Quantity::Error => Some(picture::error_legend(look)),
        Quantity::Field(side) => painted.map(|painted| painted.legend(side)),
    }
}

fn describe(render: &Render, look: &Look, range: Option<[f32; 2]>) -> String {
    let scene = &render.lit().scene;
    if let (Quantity::Field(side), Some([from, to])) =
        (look.quantity, range.map(|r| r.map(|x| significant(f64::from(x), 3))))
    {
        let [what, unit] = fields::meaning(side);
        return tr!(
            "{}: {}, {}, {}, logarithmic from {} to {} {}; scene hash {}; Intrados {}",
            scene.name,
            term(&fields::name(side).to_lowercase()),
            term(what),
            look.colours.said(),
            from,
            to,
            unit,
            scene.hash,
            env!("CARGO_PKG_VERSION")
        );
    }
    let what = match look.quantity {
        Quantity::Radiance | Quantity::Field(_) => {
            tr!("radiance at exposure {} EV", local(format!("{:+.2}", look.exposure)))
        }
        Quantity::Error => {
            let [from, to] = picture::ERRORS.map(|x| local(x.to_string()));
            tr!(
                "relative standard error of each pixel, {}, logarithmic from {} to {}",
                look.colours.said(),
                from,
                to
            )
        }
    };
    let order = look.order.map_or_else(|| tr!("all bounces"), |order| tr!("bounce {}", order));
    let mean = render.summary().combined;
    tr!(
        "{}: {}, {}, {} view; {} samples a pixel, seed {}, mean of the picture {}; scene hash {}; Intrados {}",
        scene.name,
        what,
        order,
        term(&format!("{:?}", look.view)),
        count(render.samples_per_pixel()),
        render.exposures().iter().flatten().next().map_or(0, |exposure| exposure.seed),
        plus_minus(mean.mean, mean.std_error, "W/(m² sr)"),
        scene.hash,
        env!("CARGO_PKG_VERSION")
    )
}

/// Writes a picture, and in it by what it was made and `what` it shows: a picture that is sent on
/// has no other page to say so.
pub(crate) fn write_png(
    pixels: &ColorImage,
    path: &Path,
    what: &str,
) -> Result<(), Box<dyn Error>> {
    let rgb: Vec<u8> = pixels.pixels.iter().flat_map(|c| [c.r(), c.g(), c.b()]).collect();
    let (w, h) = (u32::try_from(pixels.width())?, u32::try_from(pixels.height())?);
    let mut file = Unfinished::begin(path)?;
    let mut encoder = png::Encoder::new(&mut file, w, h);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let by = concat!("Intrados ", env!("CARGO_PKG_VERSION"));
    encoder.add_itxt_chunk("Software".into(), by.into())?;
    encoder.add_itxt_chunk("Description".into(), what.into())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&rgb)?;
    writer.finish()?;
    Ok(file.finish()?)
}

/// Says how a write ended: what could not be written must not be overlooked.
pub(crate) fn take(
    mut export: ResMut<Export>,
    mut banners: ResMut<Banners>,
    mut toasts: ResMut<Toasts>,
    mut log: ResMut<Log>,
) {
    let Some(done) = Task::take(&mut export.task) else { return };
    match done {
        Ok(Ok(Written { path, what })) => {
            let separator = if what.is_empty() { "" } else { ": " };
            log.say(tr!("wrote {}", format!("{path}{separator}{what}")));
            toasts.say(tr!("Saved {}", path));
        }
        Ok(Err(why)) => {
            log.say(tr!("the picture was not written: {}", term(&why)));
            banners.cannot(&tr!("Not saved"), &why);
        }
        // What a panic said is told with all others.
        Err(_) => log.say(tr!("the picture was not written: the writer broke off")),
    }
}
