//! A member's surface laid flat, every defect where it is, and the defects one by one.

use egui::{Align2, Color32, Rect, Sense, Ui, pos2, vec2};
use intrados_damage::evidence::called;
use intrados_predict::{Defect, MemberPrediction};
use intrados_scene::Member;
use intrados_survey::photographed::FaceSeen;

use crate::{
    colours,
    lang::{fixed, local, measured, term},
};

/// Height of the map, points.
const HEIGHT: f32 = 150.0;
/// Room at the left for angles, and beneath for metres.
const MARGIN: [f32; 2] = [34.0, 30.0];
/// Most defects in the list.
const MOST: usize = 24;

pub(super) fn faces(ui: &mut Ui, member: &Member, told: &MemberPrediction) {
    if !told.defects.is_empty() {
        map(ui, member, told);
        ui.weak(tr!("unrolled: along it from left to right, once around from below to above"));
        for (number, defect) in told.defects.iter().enumerate().take(MOST) {
            row(ui, number, defect);
        }
        if told.defects.len() > MOST {
            ui.weak(tr!("and {} more, in the report", told.defects.len() - MOST));
        }
    }
    if !told.faces.is_empty() {
        ui.label(photographed(&told.faces));
    }
}

/// What photographs show of all faces and what they do not, one sentence.
fn photographed(faces: &[FaceSeen]) -> String {
    let (seen, hidden): (Vec<&FaceSeen>, Vec<&FaceSeen>) = faces.iter().partition(|f| f.is_seen());
    let share = |f: &&FaceSeen| {
        let (percent, face) = (fixed(100.0 * f.seen, 0), term(&f.face));
        match f.narrowest_mm {
            None => tr!("{} % of {}", percent, face),
            Some(mm) => tr!("{} % of {} (cracks from {} mm)", percent, face, fixed(mm, 2)),
        }
    };
    let mut told: Vec<String> = seen.iter().map(share).collect();
    told.extend(faces.iter().filter_map(|f| {
        let mm = fixed(f.unread_mm?, 1);
        Some(tr!("something dark on {}, {} mm wide, that was not read", term(&f.face), mm))
    }));
    if !hidden.is_empty() {
        let faces: Vec<String> = hidden.iter().map(|f| term(&f.face)).collect();
        told.push(tr!("nothing of {}: what is there is unknown", faces.join(", ")));
    }
    tr!("Photographs show {}.", told.join(", "))
}

/// How large a defect is. Of what the engines say, the words that sizes have are known.
fn sized(size: &str) -> String {
    if let Some((size, sections)) = size.split_once(", in ")
        && let Some((some, all)) =
            sections.strip_suffix(" sections").and_then(|s| s.split_once(" of "))
    {
        return tr!("{}, in {} of {} sections", sized(size), some, all);
    }
    let known = |end: &str| size.strip_suffix(end).map(|number| local(number.to_owned()));
    if let Some(mm) = known(" mm wide") {
        tr!("{} mm wide", mm)
    } else if let Some(mm) = known(" mm deep") {
        tr!("{} mm deep", mm)
    } else if let Some(percent) = known(" % of the section") {
        tr!("{} % of the section", percent)
    } else {
        size.to_owned()
    }
}

fn row(ui: &mut Ui, number: usize, defect: &Defect) {
    ui.horizontal_wrapped(|ui| {
        ui.strong(format!("{}", number + 1));
        ui.label(term(defect.kind));
        let extent = local(defect.quantity().unwrap_or_default());
        ui.label([sized(&defect.size), extent].join(" ").trim().to_owned());
        if let Some([from, to]) = defect.along {
            ui.weak(tr!("at {} % of the axis", fixed(50.0 * (from + to), 0)));
        }
        let when = defect.date.clone().unwrap_or_else(|| tr!("undated"));
        ui.weak(format!("{}, {when}", term(called(defect.source))));
    });
    if let Some(change) = defect.change() {
        ui.weak(measured(&change));
    }
    if let Some(picture) = &defect.picture {
        thumbnail(ui, number, picture);
    }
}

/// What a defect looks like.
fn thumbnail(ui: &mut Ui, number: usize, picture: &intrados_ct::Picture) {
    if picture.rgb.len() != 3 * picture.width * picture.height || picture.rgb.is_empty() {
        return;
    }
    let id = ui.scope_id().with(("thumbnail", number, picture.rgb.len(), &picture.caption));
    let kept: Option<egui::TextureHandle> = ui.data(|d| d.get_temp(id));
    let texture = kept.unwrap_or_else(|| {
        let image = egui::ColorImage::from_rgb([picture.width, picture.height], &picture.rgb);
        let texture = ui.ctx().load_texture("defect", image, egui::TextureOptions::LINEAR);
        ui.data_mut(|d| d.insert_temp(id, texture.clone()));
        texture
    });
    let size = texture.size_vec2();
    let scale = (ui.available_width().min(220.0) / size.x).min(120.0 / size.y).min(1.0);
    ui.image((texture.id(), scale * size)).on_hover_text(measured(&picture.caption));
}

/// The surface laid flat. What has no side lies in a row of its own beneath.
fn map(ui: &mut Ui, member: &Member, told: &MemberPrediction) {
    let width = ui.available_width().min(640.0);
    let (whole, response) = ui.allocate_exact_size(vec2(width, HEIGHT), Sense::hover());
    response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Image, true, tr!("Faces with defects"))
    });
    let length = f64::from(member.frame.axis.length()).max(1e-3);
    let area =
        Rect::from_min_max(whole.min + vec2(MARGIN[0], 4.0), whole.max - vec2(6.0, MARGIN[1]));
    let x = |along: f64| area.left() + area.width() * along.clamp(0.0, 1.0) as f32;
    let y = |angle: f64| area.bottom() - area.height() * (angle.rem_euclid(360.0) / 360.0) as f32;
    frame(ui, area, length);
    let ink = ui.visuals().strong_text_color();
    let font = egui::TextStyle::Small.resolve(ui.style());
    let metre = f64::from(area.width()) / length;
    for (number, defect) in told.defects.iter().enumerate() {
        let Some([from, to]) = defect.along else { continue };
        let middle = pos2(x(0.5 * (from + to)), defect.angle_deg.map_or(area.bottom() + 7.0, y));
        let half = 0.5 * (x(to) - x(from));
        match defect.area_m2 {
            Some(m2) => {
                let side = (m2.max(0.0).sqrt() * metre) as f32;
                let size = vec2((2.0 * half).max(side).max(5.0), side.clamp(5.0, 40.0));
                let patch = Rect::from_center_size(middle, size).intersect(whole);
                ui.painter().rect_filled(patch, 1.0, colours::SELECTED.gamma_multiply(0.35));
                ui.painter().rect_stroke(patch, 1.0, (1.0, ink), egui::StrokeKind::Inside);
            }
            None => {
                let long = (0.5 * defect.length_m.unwrap_or(0.3) * metre) as f32;
                let way = match defect.kind {
                    "crack along" => vec2(half.max(long), 0.0),
                    "diagonal crack" => vec2(0.7 * long, 0.7 * long).min(vec2(60.0, 30.0)),
                    _ => vec2(half, long.clamp(6.0, 40.0)),
                };
                let way = vec2(way.x, -way.y);
                let clipped = ui.painter().with_clip_rect(whole);
                clipped.line_segment([middle - way, middle + way], (2.0, ink));
            }
        }
        let at = middle + vec2(half.min(20.0) + 4.0, 0.0);
        let back = Rect::from_center_size(at + vec2(4.0, 0.0), vec2(13.0, 13.0));
        ui.painter().rect_filled(back, 6.0, ui.visuals().panel_fill.gamma_multiply(0.8));
        let number = (number + 1).to_string();
        ui.painter().text(back.center(), Align2::CENTER_CENTER, number, font.clone(), ink);
    }
}

/// Ground, angles and metres.
fn frame(ui: &Ui, area: Rect, length: f64) {
    let painter = ui.painter();
    let font = egui::TextStyle::Small.resolve(ui.style());
    let weak = ui.visuals().weak_text_color();
    painter.rect_filled(area, 1.0, ui.visuals().extreme_bg_color);
    for angle in [0.0_f32, 90.0, 180.0, 270.0, 360.0] {
        let at = area.bottom() - area.height() * angle / 360.0;
        let line: Color32 = weak.gamma_multiply(0.4);
        painter.hline(area.x_range(), at, (1.0, line));
        let text = format!("{angle}°");
        painter.text(pos2(area.left() - 4.0, at), Align2::RIGHT_CENTER, text, font.clone(), weak);
    }
    for quarter in 0..=4 {
        let share = quarter as f32 / 4.0;
        let at = pos2(area.left() + area.width() * share, area.bottom() + 14.0);
        let unit = if quarter == 4 { " m" } else { "" };
        let text = format!("{}{unit}", fixed(length * f64::from(share), 1));
        let align = match quarter {
            0 => Align2::LEFT_TOP,
            4 => Align2::RIGHT_TOP,
            _ => Align2::CENTER_TOP,
        };
        painter.text(at, align, text, font.clone(), weak);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Language, lang::speak};

    /// The command line has its own sentence, in English: nothing of it may be missing here.
    #[test]
    fn photographs_are_said_as_the_command_line_says_them() {
        let of = |face: &str, seen, narrowest_mm, unread_mm| FaceSeen {
            face: face.into(),
            seen,
            narrowest_mm,
            unread_mm,
        };
        let faces = [
            of("Front", 0.93, Some(0.24), None),
            of("Left", 0.5, None, Some(7.25)),
            of("Back", 0.0, None, None),
        ];
        assert_eq!(photographed(&faces), FaceSeen::told(&faces));
        speak(Language::German);
        let said = photographed(&faces);
        speak(Language::English);
        for part in ["7,2 mm", "93 %", "Vorderseite", "0,24 mm", "50 %", "Rückseite"] {
            assert!(said.contains(part), "{part}: {said}");
        }
        assert!(!said.contains("cracks") && !said.contains("nothing"), "{said}");
    }
}
