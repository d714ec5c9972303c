//! The picture, its tools, and the hand on the camera.

use bevy_ecs::prelude::*;
use egui::{Color32, PointerButton, Pos2, Rect, RichText, Sense, Ui, pos2, vec2};
use glam::Vec3;
use intrados_light::{
    ORDERS, Render, Trust, View,
    plugin::{Learning, Lit},
};
use intrados_scene::{Camera, Ray};
use intrados_transport::Side;

use crate::{
    Action, Actions, Look, Quantity, Refine, Selection, Statistics, Viewpoint,
    border::Border,
    fields::{self, Fields},
    lang::{drag, fixed, slide, term},
    light_line::LightLine,
    meters,
    number::{count, duration, percent, plus_minus},
    one_line::{self, Piece},
    orbit,
    outline::Outline,
    picture::{self, Cursor, Picture, Under},
    reference::{self, Reference},
    scale::{self, Ranges},
    smooth::{self, Smoothed},
    statistics::Now,
    steering,
};

/// Radians per point dragged.
const TURN: f32 = 0.008;
/// Half the width of a normal 95 % interval, in standard errors.
const HALF_WIDTH: f64 = 1.96;

pub(crate) fn render(
    InMut(ui): InMut<Ui>,
    render: Option<Res<Render>>,
    lit: Option<Res<Lit>>,
    mut look: ResMut<Look>,
    mut refine: ResMut<Refine>,
    mut viewpoint: ResMut<Viewpoint>,
    mut picture: ResMut<Picture>,
    // A system takes no more parameters: what lies over the picture goes together.
    (mut smoothed, mut reference, mut line, mut border): (
        ResMut<Smoothed>,
        ResMut<Reference>,
        ResMut<LightLine>,
        ResMut<Border>,
    ),
    mut outline: ResMut<Outline>,
    mut learning: ResMut<Learning>,
    mut fields: ResMut<Fields>,
    mut cursor: ResMut<Cursor>,
    mut ranges: ResMut<Ranges>,
    selection: Res<Selection>,
    statistics: Res<Statistics>,
    mut actions: ResMut<Actions>,
) {
    let reference = reference.bypass_change_detection();
    let line = line.bypass_change_detection();
    let smoothed = smoothed.bypass_change_detection();
    let border = border.bypass_change_detection();
    let may_keep = render.is_some() && !viewpoint.is_preview() && !viewpoint.is_part();
    let mut new = *look;
    let framing = (&mut *border, &mut viewpoint, may_keep && !reference.is_kept());
    toolbar(ui, &mut new, &mut refine, (smoothed, line), framing, may_keep, &mut actions);
    steered(ui, &mut new, &mut learning, &fields, &mut ranges);
    look.set_if_neq(new);
    if reference.choice(ui) {
        actions.ask(Action::LetReferenceGo);
    }
    status(ui, &look, refine.bypass_change_detection(), &viewpoint, &statistics, render.as_deref());
    let (Some(render), Some(lit)) = (render, lit) else {
        cursor.set_if_neq(Cursor(None));
        ui.centered_and_justified(|ui| ui.spinner());
        return;
    };
    let legend = match look.quantity {
        Quantity::Radiance if reference.is_kept() => reference::FIGURES,
        Quantity::Radiance => 0.0,
        Quantity::Error | Quantity::Field(_) => 44.0,
    };
    let area = ui.available_rect_before_wrap();
    let (area, plot) = area.split_top_bottom_at_y(area.bottom() - line.height(area.height()));
    let camera = viewpoint.camera().unwrap_or(render.camera()).clone();
    let rect = fit(
        Rect::from_min_size(area.min, area.size() - vec2(0.0, legend)),
        camera.width as f32 / camera.height as f32,
    );
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    let name = match look.quantity {
        Quantity::Field(side) if fields.painted(side).is_some() => {
            tr!("Picture: {}", term(fields::name(side)))
        }
        _ => tr!("Picture"),
    };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
    let is_light = look.quantity == Quantity::Radiance;
    let picture = picture.bypass_change_detection();
    if border.is_on() {
        border.drag(ui, &response, rect, &mut viewpoint, picture);
    }
    // The film of a part is asked for, and not there at once.
    let has_film = viewpoint.has_sent(render.camera());
    let film = viewpoint.place_of_part(rect).filter(|_| has_film);
    let tools = (&mut *line, &mut *reference, &*border);
    hand(ui, &response, (rect, film), tools, is_light, &mut viewpoint);
    // Of a picture that is enlarged beside its reference, a part is seen.
    let all = if is_light { reference.place(rect) } else { rect };
    let place = film.unwrap_or(all);
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 0.0, Color32::BLACK);
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    if let Quantity::Field(side) = look.quantity {
        field(ui, place, side, &learning, &mut fields);
    } else {
        // Before a pixel has a walk, what was there is better than nothing.
        let is_seen = !viewpoint.is_part() || render.samples_per_pixel() >= 1.0;
        let is_there = has_film && is_seen && picture.is_of(render.camera());
        if is_there && !viewpoint.is_part() {
            border.forget();
        }
        let is_drawn = border.around(&painter, rect, is_there);
        if let Some(texture) = picture.texture(ui.ctx()).filter(|_| is_drawn) {
            painter.image(texture.id(), place, whole, Color32::WHITE);
        }
    }
    if is_light {
        // What is held against a reference is the picture as it is.
        if !reference.is_kept()
            && !viewpoint.is_part()
            && let Some(texture) = smoothed.texture(ui.ctx())
        {
            ui.painter().image(texture, rect, whole, Color32::WHITE);
            smooth::mark(ui, rect);
        }
        reference.draw(ui, [all, rect], &look);
    }
    if let Some(texture) = outline.bypass_change_detection().texture(ui.ctx()) {
        painter.image(texture.id(), all, whole, Color32::WHITE);
    }
    border.draw(&painter, rect, viewpoint.place_of_part(rect));
    line.draw(&painter, place);
    if is_light {
        reference.divider(ui, [all, rect]);
    }
    let under = response.hover_pos().map(|at| under(&lit, render.camera(), place, at));
    // Around a part nothing is read: what is seen there is of another film.
    let is_read = response.hover_pos().is_some_and(|at| place.contains(at));
    cursor.set_if_neq(Cursor(under.filter(|_| is_read)));
    if response.clicked() {
        if let Some(at) = response.interact_pointer_pos() {
            fields.pick((at - place.min) / place.size());
        }
        let member = under.and_then(|u| lit.0.scene.objects.get(u.hit?.0)?.member);
        actions.ask(Action::Select(member.filter(|m| selection.0 != Some(*m))));
    }
    if let Some(member) =
        under.and_then(|u| lit.0.scene.members.get(lit.0.scene.objects.get(u.hit?.0)?.member?))
    {
        response.on_hover_text_at_pointer(&member.name);
    }
    let below = Rect::from_min_max(
        pos2(rect.left(), rect.bottom() + 4.0),
        pos2(rect.right(), rect.bottom() + 42.0),
    );
    if line.is_on() && !viewpoint.is_preview() {
        let asked = line.show(ui, plot, &render, statistics.share(&render), &look, &fields);
        asked.into_iter().for_each(|action| actions.ask(action));
    }
    match look.quantity {
        // They may be wider than the picture.
        Quantity::Radiance => {
            let wide = below.with_min_x(area.left()).with_max_x(area.right());
            reference.figures(ui, wide);
        }
        Quantity::Error => {
            let (scale, caption) = (picture::error_scale(&look), picture::error_caption());
            scale::legend(ui, below, &scale, picture::error_share, &caption);
        }
        Quantity::Field(side) => {
            if let Some(painted) = fields.painted(side) {
                let caption = fields::caption(side);
                scale::legend(ui, below, &painted.scale, fields::written, &caption);
            }
        }
    }
}

/// The field of a side, and the picked point in it.
fn field(ui: &Ui, rect: Rect, side: Side, learning: &Learning, fields: &mut Fields) {
    let painter = ui.painter();
    let Some(texture) = fields.texture(side, ui.ctx()) else {
        let text =
            if learning.guide().is_some() { tr!("painting…") } else { steering::state(learning) };
        let font = egui::TextStyle::Body.resolve(ui.style());
        painter.text(rect.center(), egui::Align2::CENTER_CENTER, text, font, Color32::LIGHT_GRAY);
        return;
    };
    painter.image(
        texture.id(),
        rect,
        Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)),
        Color32::WHITE,
    );
    let at = rect.min + fields.picked() * rect.size();
    for (width, colour) in [(4.0, Color32::BLACK), (2.0, Color32::WHITE)] {
        painter.circle_stroke(at, 6.0, (width, colour));
    }
}

/// The largest rectangle of this shape in the middle of `area`.
fn fit(area: Rect, aspect: f32) -> Rect {
    let size = area.size().max(vec2(1.0, 1.0));
    let size = if size.x / size.y > aspect {
        vec2(size.y * aspect, size.y)
    } else {
        vec2(size.x, size.x / aspect)
    };
    Rect::from_center_size(area.center(), size)
}

/// The place under the pointer, and what it shows.
fn under(lit: &Lit, camera: &Camera, rect: Rect, at: Pos2) -> Under {
    let share = (at - rect.min) / rect.size();
    let ray = Ray::new(
        camera.position,
        camera.direction(share.x * camera.width as f32, share.y * camera.height as f32),
        f32::INFINITY,
    );
    let hit: Option<(usize, Vec3)> = lit.0.pick(&ray);
    Under { at: share, hit }
}

/// Drag to orbit, or to draw where the tool is out; Shift or middle or right drag to pan, wheel to
/// come nearer. Beside its reference the picture of light is enlarged instead.
fn hand(
    ui: &Ui,
    response: &egui::Response,
    (rect, film): (Rect, Option<Rect>),
    (line, reference, border): (&mut LightLine, &mut Reference, &Border),
    is_light: bool,
    viewpoint: &mut ResMut<Viewpoint>,
) {
    let frames = border.is_on() && response.dragged_by(PointerButton::Primary);
    let draws = line.is_on()
        && !frames
        && response.dragged_by(PointerButton::Primary)
        && !ui.input(|i| i.modifiers.shift);
    if draws {
        let all = if is_light { reference.place(rect) } else { rect };
        line.drag(ui, film.unwrap_or(all));
    }
    let is_dragged = response.dragged() && !draws && !frames;
    let enlarges = is_light && reference.hand(ui, response, rect, is_dragged);
    let held = is_dragged && !enlarges;
    if viewpoint.dragged != held {
        viewpoint.dragged = held;
    }
    if enlarges {
        return;
    }
    let Some(camera) = viewpoint.camera().cloned() else { return };
    let delta = response.drag_delta();
    let pans = ui.input(|i| i.modifiers.shift)
        || response.dragged_by(PointerButton::Middle)
        || response.dragged_by(PointerButton::Secondary);
    if held && delta != egui::Vec2::ZERO {
        viewpoint.go(match pans {
            true => orbit::pan(&camera, delta.x / rect.width(), delta.y / rect.width()),
            false => orbit::orbit(&camera, delta.x * TURN, delta.y * TURN),
        });
        return;
    }
    let scroll = if response.hovered() { ui.input(|i| i.smooth_scroll_delta().y) } else { 0.0 };
    if scroll != 0.0 {
        viewpoint.go(orbit::dolly(&camera, (-scroll * 0.003).exp()));
    }
}

/// Rows that wrap: in a narrow panel what is at their ends would be out of reach.
fn toolbar(
    ui: &mut Ui,
    look: &mut Look,
    refine: &mut ResMut<Refine>,
    (smoothed, line): (&mut Smoothed, &mut LightLine),
    (border, viewpoint, may_frame): (&mut Border, &mut ResMut<Viewpoint>, bool),
    may_keep: bool,
    actions: &mut Actions,
) {
    ui.horizontal_wrapped(|ui| {
        let pause = if refine.paused { tr!("▶ Continue") } else { tr!("⏸ Pause") };
        if ui.button(pause).on_hover_text("Space").clicked() {
            actions.ask(Action::Pause);
        }
        let hint = tr!("Begins the picture anew with the same seed (R)");
        if ui.button(tr!("⟲ Restart")).on_hover_text(hint).clicked() {
            actions.ask(Action::Restart);
        }
        ui.separator();
        for (view, name, hint) in [
            (View::Combined, tr!("Combined"), tr!("Both sides, weighted by their variances (3)")),
            (View::Primal, tr!("Primal"), tr!("Walks from the camera to the lamps (1)")),
            (View::Dual, tr!("Dual"), tr!("Walks from the lamps to the camera (2)")),
        ] {
            ui.selectable_value(&mut look.view, view, name).on_hover_text(hint);
        }
        ui.separator();
        bounces(ui, look);
        ui.separator();
        ui.selectable_value(&mut look.quantity, Quantity::Radiance, tr!("Light"));
        ui.selectable_value(&mut look.quantity, Quantity::Error, tr!("Error"))
            .on_hover_text(tr!("Relative standard error of every pixel (E)"));
    });
    ui.horizontal_wrapped(|ui| {
        let label = ui.label(tr!("Exposure|photo"));
        let slider = slide(&mut look.exposure, -10.0..=10.0).suffix(" EV").fixed_decimals(1);
        ui.add(slider)
            .labelled_by(label.id)
            .on_hover_text(tr!("Develops the picture anew, and does not restart it"));
        ui.separator();
        let label = ui.label(tr!("Target error")).on_hover_text(tr!(
            "Relative standard error of the picture's mean at which refining rests"
        ));
        let mut target = 100.0 * refine.target;
        let field = drag(&mut target).range(0.0001..=50.0).speed(0.001).max_decimals(4);
        if ui.add(field.suffix(" %")).labelled_by(label.id).changed() {
            refine.target = target / 100.0;
        }
        ui.separator();
        if reference::button(ui, may_keep) {
            actions.ask(Action::KeepReference);
        }
        line.button(ui);
        border.button(ui, viewpoint, may_frame);
        smooth::switch(ui, smoothed);
    });
}

/// What walks are steered by, and how it is looked at.
fn steered(
    ui: &mut Ui,
    look: &mut Look,
    learning: &mut ResMut<Learning>,
    fields: &Fields,
    ranges: &mut Ranges,
) {
    ui.horizontal_wrapped(|ui| {
        steering::choice(ui, learning);
        ui.separator();
        field_choice(ui, look);
        if let Quantity::Field(side) = look.quantity
            && let Some(painted) = fields.painted(side)
        {
            let (seen, unit) = (painted.scale.range, fields::meaning(side)[1]);
            scale::lock(ui, ranges, fields::name(side), seen, unit, true);
        }
        one_line::put(ui, vec![Piece::new(RichText::new(steering::state(learning)).weak())]);
    });
}

/// Which field to look at.
fn field_choice(ui: &mut Ui, look: &mut Look) {
    for side in Side::BOTH {
        let ([what, unit], walks) = (fields::meaning(side), steering::side_name(side));
        let hint = tr!(
            "What steers the {} walks: {}, {}. It is learnt while steering is on",
            walks,
            term(what),
            unit
        );
        let name = term(fields::name(side));
        ui.selectable_value(&mut look.quantity, Quantity::Field(side), name).on_hover_text(hint);
    }
}

fn bounces(ui: &mut Ui, look: &mut Look) {
    let name = |order: Option<usize>| match order {
        None => tr!("all bounces"),
        Some(0) => tr!("0: lamps seen"),
        Some(k) if k + 1 == ORDERS => tr!("{} and more", k),
        Some(1) => tr!("1 bounce"),
        Some(k) => tr!("{} bounces", k),
    };
    let combo =
        egui::ComboBox::from_id_salt("bounces").width(104.0).selected_text(name(look.order));
    let combo = combo.show_ui(ui, |ui| {
        for order in std::iter::once(None).chain((0..ORDERS).map(Some)) {
            ui.selectable_value(&mut look.order, order, name(order));
        }
    });
    combo
        .response
        .on_hover_text(tr!("One term of the Neumann series alone: light after so many bounces"));
}

/// Two lines, however much there is to be said: the picture stays where it is.
fn status(
    ui: &mut Ui,
    look: &Look,
    refine: &Refine,
    viewpoint: &Viewpoint,
    statistics: &Statistics,
    render: Option<&Render>,
) {
    let now = statistics.now().filter(|_| !viewpoint.is_preview());
    let Some(now) = now else {
        let why = if viewpoint.is_preview() { tr!("Preview") } else { "…".into() };
        one_line::say(ui, vec![Piece::new(RichText::new(why).weak())]);
        one_line::say(ui, vec![Piece::new(" ")]);
        return;
    };
    one_line::say(ui, going(now, refine, refine.is_there(statistics), render));
    one_line::say(ui, known(now, look));
}

/// How far the picture is, and what that took.
fn going(now: &Now, refine: &Refine, there: bool, render: Option<&Render>) -> Vec<Piece> {
    let state = match () {
        () if refine.paused => tr!("⏸ Paused"),
        () if there => tr!("✔ Target of the mean reached"),
        () => tr!("Refining"),
    };
    let mut pieces = vec![Piece::new(RichText::new(state).strong())];
    if !there && now.error() <= refine.target {
        let but = tr!("target reached, but by an error bar that may not be trusted");
        pieces.push(Piece::new(but).hint(term(&now.trust.words())));
    } else if !there && now.error().is_finite() {
        let left = duration(refine.seconds_left(now.error()));
        let hint = tr!("By the law of large numbers: the error falls with the root of the time");
        pieces.push(Piece::new(tr!("target in {}", left)).hint(hint));
    }
    let samples = count(now.samples_per_pixel);
    let size = match render.map(|r| r.camera()) {
        Some(c) => tr!("{} × {} pixels, {} samples each", c.width, c.height, samples),
        None => tr!("{} samples each", samples),
    };
    let work = fixed(now.cpu_seconds, 1);
    let took = format!("{}, {work} CPU-s", duration(refine.seconds));
    pieces.extend([size, took].map(|text| Piece::new(text).apart()));
    pieces
}

/// What is known of the picture. Whether that may be trusted stands first, and is elided last.
fn known(now: &Now, look: &Look) -> Vec<Piece> {
    let mut pieces = vec![convergence(&now.trust)];
    if now.pixel_noise().is_finite() {
        let noise = tr!("pixels ± {}", percent(now.pixel_noise()));
        pieces.push(Piece::new(noise).hint(tr!(
            "Relative standard error of a single pixel, about. The mean of all pixels converges long before the picture does."
        )));
    }
    if let Some(reading) = now.reading(look.view) {
        let mean = plus_minus(reading.mean, reading.std_error, "W/(m² sr)");
        let mean = Piece::new(tr!("Mean {}", mean)).hint(tr!("Mean luminance of the picture"));
        pieces.push(mean.apart());
        if reading.rel_error().is_finite() {
            let [error, half] = [1.0, HALF_WIDTH].map(|k| percent(k * reading.rel_error()));
            let hint = tr!(
                "Relative standard error of the mean, and half the width of its 95 % interval. A single pixel's error is about {}.",
                percent(now.pixel_noise())
            );
            pieces.push(Piece::new(tr!("({}; 95 %: ± {})", error, half)).hint(hint));
        }
        if look.view == View::Combined {
            pieces.push(Piece::new(RichText::new(now.mixture()).weak()));
        }
    }
    if let Some(z) = now.z {
        let (gap, what) = meters::gap(z, now.both_converged);
        pieces.push(Piece::new(tr!("Gap")).apart());
        pieces.push(Piece::new(gap).hint(what));
    }
    pieces
}

fn convergence(trust: &Trust) -> Piece {
    if trust.is_certified() {
        Piece::new(tr!("✔ Mean converged")).hint(tr!(
            "No walk dominates, the halves agree, the tail of the scores is light, and the other \
             side has met no light that is missing: the error bar may be trusted"
        ))
    } else if trust.is_settled() {
        Piece::new(tr!("Mean converged, not checked")).hint(term(&trust.words()))
    } else {
        Piece::new(tr!("⚠ Mean not converged"))
            .hint(tr!("The error bar may be too small: {}", term(&trust.words())))
    }
}
