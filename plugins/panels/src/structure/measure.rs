//! The distance between two places that were clicked.

use egui::{Align2, Color32, Rect, Ui, vec2};
use glam::Vec3;
use intrados_scene::Camera;

use crate::{colours, lengths::length, surface::place};

/// The tape, and the places that it lies between.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Tape {
    pub(super) is_on: bool,
    ends: Vec<Vec3>,
}

impl Tape {
    /// Puts an end down; of a tape that has both, a new first one.
    pub(super) fn put(&mut self, at: Vec3) {
        if self.ends.len() >= 2 {
            self.ends.clear();
        }
        self.ends.push(at);
    }

    pub(super) fn clear(&mut self) {
        self.ends.clear();
    }

    /// What it reads, or what to do.
    pub(super) fn said(&self) -> String {
        match self.ends[..] {
            [a, b, ..] => reading(a, b),
            [_] => tr!("and to where? Click the other place."),
            [] => tr!("Click the first place on a member."),
        }
    }

    pub(super) fn draw(&self, ui: &Ui, rect: Rect, camera: &Camera) {
        let painter = ui.painter().with_clip_rect(rect);
        let forward = camera.target - camera.position;
        let is_before = |p: &&Vec3| (**p - camera.position).dot(forward) > 0.0;
        let seen: Vec<egui::Pos2> =
            self.ends.iter().filter(is_before).map(|p| place(camera, rect, *p)).collect();
        if let ([from, to], [a, b]) = (&seen[..], &self.ends[..]) {
            painter.line_segment([*from, *to], (4.0, Color32::from_black_alpha(150)));
            painter.line_segment([*from, *to], (2.0, colours::SELECTED));
            let length = length((*b - *a).length());
            let font = egui::TextStyle::Body.resolve(ui.style());
            let galley = painter.layout_no_wrap(length, font, Color32::WHITE);
            let middle = from.lerp(*to, 0.5);
            let back = Align2::CENTER_BOTTOM.anchor_size(middle, galley.size() + vec2(8.0, 4.0));
            painter.rect_filled(back, 3.0, Color32::from_black_alpha(190));
            painter.galley(back.min + vec2(4.0, 2.0), galley, Color32::WHITE);
        }
        self.ends.iter().for_each(|at| end(ui, rect, camera, *at));
    }
}

/// Marks a place.
pub(super) fn end(ui: &Ui, rect: Rect, camera: &Camera, at: Vec3) {
    if (at - camera.position).dot(camera.target - camera.position) > 0.0 {
        let at = place(camera, rect, at);
        let painter = ui.painter().with_clip_rect(rect);
        painter.circle(at, 4.0, colours::SELECTED, (1.0, Color32::BLACK));
    }
}

/// A distance, and how far it goes sideways and up.
fn reading(a: Vec3, b: Vec3) -> String {
    let d = b - a;
    let level = vec2(d.x, d.z).length();
    tr!("{} ({} level, {} upright)", length(d.length()), length(level), length(d.y.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tape_reads_the_distance_with_its_unit() {
        let mut tape = Tape::default();
        tape.put(Vec3::new(1.0, 0.0, 0.0));
        assert!(tape.said().starts_with("and to where?"));
        tape.put(Vec3::new(1.0, 4.0, 3.0));
        assert_eq!(tape.said(), "5.000 m (3.000 m level, 4.000 m upright)");
        tape.put(Vec3::ZERO);
        tape.put(Vec3::new(0.25, 0.0, 0.0));
        assert_eq!(tape.said(), "250 mm (250 mm level, 0 mm upright)");
    }
}
