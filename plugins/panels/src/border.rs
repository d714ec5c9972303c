//! A part of the picture of light that alone is refined, in a rectangle that somebody draws. What lies
//! around it stays as it was.

use bevy_ecs::prelude::*;
use egui::{
    Button, Color32, Painter, PointerButton, Pos2, Rect, Response, Shape, StrokeKind,
    TextureHandle, Ui, Vec2, pos2,
};

use intrados_scene::plugin::SceneChanged;

use crate::{Viewpoint, line, picture::Picture};

/// Least side of the part, pixels.
const LEAST: u32 = 8;

/// The tool, the rectangle that is being drawn, and the picture around the part.
#[derive(Resource, Default)]
pub(crate) struct Border {
    is_on: bool,
    /// Shares of the picture's width and height.
    ends: Option<[Vec2; 2]>,
    /// All of the picture as it was when the part began.
    whole: Option<TextureHandle>,
}

/// Puts the tool away and refines all of the picture again; false if there was nothing of either.
pub(crate) fn end(world: &mut World) -> bool {
    let mut border = world.resource_mut::<Border>();
    border.ends = None;
    let was_on = std::mem::take(&mut border.is_on);
    world.resource_mut::<Viewpoint>().refine_all() || was_on
}

/// Another scene has no part of this one.
pub(crate) fn leave(mut changed: MessageReader<SceneChanged>, mut border: ResMut<Border>) {
    if changed.read().last().is_some() {
        border.forget();
    }
}

impl Border {
    pub(crate) fn is_on(&self) -> bool {
        self.is_on
    }

    pub(crate) fn button(&mut self, ui: &mut Ui, viewpoint: &mut ResMut<Viewpoint>, may: bool) {
        let hint = tr!(
            "Drag over the picture: what is in the rectangle is refined alone. Esc or a second click refines all of it again"
        );
        let button = Button::selectable(self.is_on, tr!("Border"));
        let button = ui.add_enabled(may || self.is_on, button);
        if button.on_hover_text(hint).clicked() {
            (self.is_on, self.ends) = (!self.is_on, None);
            viewpoint.refine_all();
        }
    }

    /// Follows the pointer over the picture in `rect`; once it lets go, what it has drawn is refined.
    pub(crate) fn drag(
        &mut self,
        ui: &Ui,
        response: &Response,
        rect: Rect,
        viewpoint: &mut ResMut<Viewpoint>,
        picture: &mut Picture,
    ) {
        if response.dragged_by(PointerButton::Primary) {
            self.ends = line::dragged(ui, rect).or(self.ends);
            return;
        }
        let Some(ends) = self.ends.take() else { return };
        let size = viewpoint.pixels().filter(|_| !viewpoint.is_preview());
        if let Some(part) = size.and_then(|size| part(ends, size)) {
            let whole = picture.lift();
            self.whole = self.whole.take().or(whole);
            viewpoint.refine_only(part);
        }
    }

    /// The picture around the part, where there is one; `is_there`: the picture is of what was asked
    /// for last. Whether the picture is to be drawn over it.
    pub(crate) fn around(&self, painter: &Painter, rect: Rect, is_there: bool) -> bool {
        let Some(whole) = &self.whole else { return true };
        let uv = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(whole.id(), rect, uv, Color32::WHITE);
        is_there
    }

    /// All of the picture is refined again, and there: nothing is kept any more.
    pub(crate) fn forget(&mut self) {
        self.whole = None;
    }

    /// The rectangle about the part, and the one that is being drawn.
    pub(crate) fn draw(&self, painter: &Painter, rect: Rect, part: Option<Rect>) {
        let drawn = self.ends.map(|ends| {
            let [a, b] = ends.map(|share| rect.min + share * rect.size());
            Rect::from_two_pos(a, b)
        });
        for part in drawn.into_iter().chain(part) {
            line::outline(painter, |stroke| {
                Shape::rect_stroke(part, 0.0, stroke, StrokeKind::Outside)
            });
        }
    }
}

/// The pixels between two places of a picture of so many: the first column and row, and the first
/// ones behind; none: too few.
fn part([a, b]: [Vec2; 2], size: [u32; 2]) -> Option<[[u32; 2]; 2]> {
    let pixel = |share: f32, side: u32| share.clamp(0.0, 1.0) * side as f32;
    let (low, high) = (a.min(b), a.max(b));
    let from = [pixel(low.x, size[0]), pixel(low.y, size[1])].map(|x| x.floor() as u32);
    let to = [pixel(high.x, size[0]), pixel(high.y, size[1])].map(|x| x.ceil() as u32);
    let is_large = from.iter().zip(&to).all(|(from, to)| to - from >= LEAST);
    is_large.then_some([from, to])
}

#[cfg(test)]
mod tests {
    use egui::vec2;

    use super::*;

    #[test]
    fn a_part_is_whole_pixels_whichever_corner_was_first() {
        let ends = [vec2(0.5, 0.75), vec2(0.25, 0.25)];
        assert_eq!(part(ends, [100, 80]), Some([[25, 20], [50, 60]]));
        assert_eq!(part([ends[1], ends[0]], [100, 80]), Some([[25, 20], [50, 60]]));
        assert_eq!(part([vec2(-1.0, -1.0), vec2(2.0, 2.0)], [100, 80]), Some([[0, 0], [100, 80]]));
        assert_eq!(part([vec2(0.5, 0.1), vec2(0.53, 0.9)], [100, 80]), None);
    }
}
