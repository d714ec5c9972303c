//! The photograph, or a face without the light on it, with what was picked and found.

use egui::{Color32, Pos2, Rect, Sense, TextureHandle, Ui, pos2, vec2};

use super::{Photos, Shot, model, work::Find};
use crate::{
    colours,
    lang::{fixed, term},
};

/// A click so many points beside a find still means it.
const REACH: f32 = 8.0;
pub(super) const FOUND: Color32 = Color32::from_rgb(213, 62, 0);

/// Draws what is looked at; a click picks the corner that is meant, or a find.
pub(super) fn show(ui: &mut Ui, photos: &mut Photos, rect: Rect) {
    let (strip, rect) = rect.split_top_bottom_at_y(rect.top() + 18.0);
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let Photos { shot: Some(Ok(shot)), zoom, armed, face, marked, .. } = photos else { return };
    let name = if face.is_some() { tr!("Face without its light") } else { tr!("Photograph") };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
    let (texture, size) = shown(shot, *face);
    let size = vec2(size[0], size[1]);
    if response.dragged() {
        zoom.pull(response.drag_delta(), rect, size);
    }
    zoom.hand(ui, &response, rect, size);
    let place = zoom.place(rect, size);
    let painter = ui.painter().with_clip_rect(rect);
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(texture.id(), place, whole, Color32::WHITE);
    let scale = place.width() / size.x;
    let to_screen = |[x, y]: [f64; 2]| place.min + scale * vec2(x as f32, y as f32);
    let faces = shot.faces.iter().enumerate();
    let finds: Vec<([usize; 2], &Find)> = faces
        .filter(|(k, _)| face.is_none_or(|face| face == *k))
        .flat_map(|(k, (f, _))| f.finds.iter().enumerate().map(move |(i, find)| ([k, i], find)))
        .collect();
    let course = |find: &Find| -> Vec<Pos2> {
        let points = if face.is_some() { &find.on_map } else { &find.in_photo };
        points.iter().map(|p| to_screen(*p)).collect()
    };
    for (which, find) in &finds {
        let is_marked = *marked == Some(*which);
        let (width, colour) = if is_marked { (3.0, colours::SELECTED) } else { (1.5, FOUND) };
        painter.line(course(find), egui::Stroke::new(width + 1.5, Color32::from_black_alpha(120)));
        painter.line(course(find), egui::Stroke::new(width, colour));
    }
    if face.is_none() {
        for picked in &shot.picks {
            let name = picked.corner.map_or_else(|| "·".to_owned(), |c| (c + 1).to_string());
            let is_armed = armed.is_some() && picked.corner == *armed;
            let colour = if is_armed { colours::SELECTED } else { model::PICKED };
            model::cross(&painter, to_screen(picked.pick.pixel), &name, colour);
        }
    }
    let pixel = |at: Pos2| [0, 1].map(|k| f64::from((at - place.min)[k] / scale));
    if response.clicked()
        && let Some(at) = response.interact_pointer_pos()
    {
        let far = |points: Vec<Pos2>| {
            points.into_iter().map(|p| p.distance(at)).fold(f32::INFINITY, f32::min)
        };
        let near = finds.iter().map(|(which, find)| (far(course(find)), *which));
        let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(d, _)| *d < REACH);
        let inside = place.contains(at);
        match (armed.take(), nearest) {
            (Some(corner), _) if face.is_none() && inside => shot.pick(corner, pixel(at)),
            (_, nearest) => *marked = nearest.map(|(_, which)| which),
        }
    }
    let under = response.hover_pos().filter(|at| place.contains(*at)).map(pixel);
    let text = caption(shot, *face, *armed, under);
    ui.scope_builder(egui::UiBuilder::new().max_rect(strip), |ui| {
        ui.add(egui::Label::new(egui::RichText::new(text).weak()).truncate());
    });
}

/// The texture, and how large what it shows is, pixels.
fn shown(shot: &Shot, face: Option<usize>) -> (&TextureHandle, [f32; 2]) {
    match face.and_then(|k| shot.faces.get(k)) {
        Some((face, texture)) => (texture, face.size),
        None => (&shot.texture, shot.opened.photograph.size.map(|n| n as f32)),
    }
}

/// What is under the pointer, or what to do.
fn caption(
    shot: &Shot,
    face: Option<usize>,
    armed: Option<usize>,
    under: Option<[f64; 2]>,
) -> String {
    if let Some((face, _)) = face.and_then(|k| shot.faces.get(k)) {
        let said = tr!(
            "{}: {} mm a pixel, {} % known",
            term(&face.name),
            fixed(face.mm_px, 2),
            fixed(100.0 * face.known, 0)
        );
        return match face.narrowest_mm {
            Some(mm) => {
                tr!("{}; of cracks narrower than {} mm nothing is said", said, fixed(mm, 2))
            }
            None => said,
        };
    }
    if let Some(corner) = armed {
        return tr!("Click where corner {} is in the photograph", corner + 1);
    }
    let sight = under.and_then(|at| {
        let located = shot.located()?;
        let sight = shot.opened.site.sights(&located.pose, &[at]).into_iter().next().flatten()?;
        let own = shot.opened.site.surface(sight.member)?;
        let face = sight
            .face
            .and_then(|k| own.faces.get(k))
            .map_or_else(|| tr!("end|of a member"), |f| term(&f.name));
        let [around, along] = sight.mm_px;
        Some(tr!(
            "{}, {} m along, {}°: {} × {} mm a pixel, {} m away",
            face,
            fixed(sight.along * own.length(), 3),
            fixed(sight.angle_deg, 0),
            fixed(around, 2),
            fixed(along, 2),
            fixed(sight.distance_m, 2)
        ))
    });
    sight.unwrap_or_else(|| {
        tr!("Click a corner of the drawing, then the same corner in the photograph")
    })
}
