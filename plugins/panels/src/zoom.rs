//! A picture that is enlarged under the pointer and pulled about.

use egui::{Rect, Response, Ui, Vec2, vec2};

/// Largest magnification over all of the picture.
const CLOSEST: f32 = 64.0;

/// Which part of a picture is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Zoom {
    /// Over the size at which all of it is seen.
    times: f32,
    /// What is in the middle, as a share of the picture.
    centre: [f32; 2],
}

impl Default for Zoom {
    fn default() -> Self {
        Self { times: 1.0, centre: [0.5; 2] }
    }
}

impl Zoom {
    /// Whether not all of the picture is seen.
    pub(crate) fn is_near(&self) -> bool {
        self.times > 1.0
    }

    /// Goes to a place (pixels) where not all of the picture is seen.
    pub(crate) fn reveal(&mut self, at: [f32; 2], size: [f32; 2]) {
        if self.times > 1.05 {
            self.centre = [at[0] / size[0], at[1] / size[1]];
            self.hold();
        }
    }

    /// Keeps the picture in sight.
    fn hold(&mut self) {
        self.times = self.times.clamp(1.0, CLOSEST);
        let margin = 0.5 / self.times;
        self.centre = self.centre.map(|c| c.clamp(margin, 1.0 - margin));
    }

    /// Where the whole picture would be drawn.
    pub(crate) fn place(&self, rect: Rect, size: Vec2) -> Rect {
        let scale = (rect.width() / size.x).min(rect.height() / size.y) * self.times;
        let shown = size * scale;
        Rect::from_min_size(
            rect.center() - vec2(self.centre[0] * shown.x, self.centre[1] * shown.y),
            shown,
        )
    }

    /// Pulls the picture along with a drag.
    pub(crate) fn pull(&mut self, delta: Vec2, rect: Rect, size: Vec2) {
        let shown = self.place(rect, size).size();
        self.centre = [self.centre[0] - delta.x / shown.x, self.centre[1] - delta.y / shown.y];
        self.hold();
    }

    /// The wheel enlarges what is under the pointer, a double click shows all.
    pub(crate) fn hand(&mut self, ui: &Ui, response: &Response, rect: Rect, size: Vec2) {
        let scroll = if response.hovered() { ui.input(|i| i.smooth_scroll_delta().y) } else { 0.0 };
        if scroll != 0.0
            && let Some(at) = response.hover_pos()
        {
            let place = self.place(rect, size);
            let before = (at - place.min) / place.size();
            self.times = (self.times * (0.004 * scroll).exp()).clamp(1.0, CLOSEST);
            let after = self.place(rect, size);
            let now = (at - after.min) / after.size();
            self.centre = [self.centre[0] + before.x - now.x, self.centre[1] + before.y - now.y];
        }
        if response.double_clicked() {
            *self = Self::default();
        }
        self.hold();
    }
}

#[cfg(test)]
mod tests {
    use egui::pos2;

    use super::*;

    #[test]
    fn what_is_enlarged_is_pulled_along_and_never_out_of_sight() {
        let rect = Rect::from_min_max(pos2(10.0, 20.0), pos2(110.0, 70.0));
        let mut zoom = Zoom::default();
        assert!(!zoom.is_near() && zoom.place(rect, rect.size()) == rect);
        zoom.pull(vec2(30.0, 0.0), rect, rect.size());
        assert_eq!(zoom, Zoom::default(), "all of it is seen already");
        zoom.times = 4.0;
        zoom.pull(vec2(30.0, 0.0), rect, rect.size());
        let place = zoom.place(rect, rect.size());
        assert!(zoom.is_near() && (place.width() - 400.0).abs() < 1e-3);
        assert!((place.center().x - rect.center().x - 30.0).abs() < 1e-3, "{place}");
        zoom.pull(vec2(9e3, 9e3), rect, rect.size());
        assert!((zoom.place(rect, rect.size()).min - rect.min).length() < 1e-3);
    }
}
