//! A flight of the camera along a member at a steady pace: through a tunnel along its axis, beside
//! anything else with the eye on its faces. It ends where it began.

use egui::{Slider, Ui, WidgetInfo};
use glam::{Vec2, Vec3};
use intrados_scene::{Camera, Frame, MemberKind, Scene};

use crate::lengths;

/// How long a flight along the whole of a member takes, s.
const WHOLE: f32 = 20.0;
/// Where a frame took longer, s, the flight goes on from where it was and does not leap.
const LONGEST: f64 = 0.5;
/// Full fields of view across the picture: in a tunnel, and beside a member, degrees.
const INSIDE: f32 = 72.0;
const BESIDE: f32 = 32.0;
/// Radius of the narrowest opening that is flown through, m.
const NARROWEST: f32 = 0.05;
/// How far ahead one looks in a tunnel, radii of its opening.
const AHEAD: f32 = 3.0;
/// How far from the axis one flies beside a member, in distances of its farthest corner from there:
/// its section then fills some three quarters of a picture's height.
const AWAY: f32 = 8.0;
/// A member that is shorter, m, is not flown along.
const SHORTEST: f32 = 0.01;
/// Cosine to the vertical from which on nobody knows what is up.
const STEEP: f32 = 0.99;
/// Width of the slider, points.
const WIDTH: f32 = 240.0;

/// Whether such a member is looked at from inside, where there is room around its axis.
pub(super) fn is_tunnel(kind: MemberKind) -> bool {
    matches!(kind, MemberKind::Lining | MemberKind::Segment | MemberKind::Pipe)
}

/// Where one looks from, at what, and what is up in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sight {
    eye: Vec3,
    target: Vec3,
    up: Vec3,
    /// Degrees, across.
    fov: f32,
}

/// What is flown along.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Course {
    frame: Frame,
    /// Unit, along the member.
    axis: Vec3,
    /// m.
    length: f32,
    way: Way,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Along the axis, which lies in an opening of this radius, m.
    Inside(f32),
    /// So far beside the axis, m.
    Beside(Vec3),
}

impl Course {
    /// Along a member with these triangles, looked at `from` here so far: it is the side on which
    /// one stays. None where there is nothing to fly along.
    fn of(kind: MemberKind, frame: Frame, triangles: &[[Vec3; 3]], from: Vec3) -> Option<Self> {
        let (length, axis) = (frame.axis.length(), frame.axis.normalize_or_zero());
        if triangles.is_empty() || !(length > SHORTEST && length.is_finite()) {
            return None;
        }
        let open = clearance(frame.start, axis, triangles);
        let way = if is_tunnel(kind) && open > NARROWEST && open.is_finite() {
            Way::Inside(open)
        } else {
            let across = |p: Vec3| (p - frame.start).reject_from_normalized(axis);
            let corners = triangles.iter().flatten();
            let reach = corners.map(|p| across(*p).length()).fold(NARROWEST, f32::max);
            Way::Beside(AWAY * reach * across(from).normalize_or(frame.zero))
        };
        Some(Self { frame, axis, length, way })
    }

    /// At so many metres from the start of the member.
    fn at(&self, chainage: f32) -> Sight {
        let place = self.frame.start + chainage.clamp(0.0, self.length) * self.axis;
        match self.way {
            Way::Inside(open) => Sight {
                eye: place,
                target: place + AHEAD * open * self.axis,
                up: upwards(self.axis, self.frame.zero),
                fov: INSIDE,
            },
            // Of what is seen from above or below, the axis lies across the picture, too.
            Way::Beside(off) => Sight {
                eye: place + off,
                target: place,
                up: upwards(off.normalize_or_zero(), off.cross(self.axis)),
                fov: BESIDE,
            },
        }
    }
}

/// What is up for one who looks along this unit vector or against it; `other` where that is nearly
/// the vertical itself.
fn upwards(sight: Vec3, other: Vec3) -> Vec3 {
    if sight.y.abs() < STEEP { Vec3::Y } else { other }
}

/// Distance of a line from the nearest of the triangles. Looked at along the line, it is a point and
/// they are triangles of the plane.
fn clearance(start: Vec3, axis: Vec3, triangles: &[[Vec3; 3]]) -> f32 {
    let right = axis.any_orthonormal_vector();
    let up = axis.cross(right);
    let flat = |p: Vec3| Vec2::new((p - start).dot(right), (p - start).dot(up));
    triangles.iter().map(|t| distance(t.map(flat))).fold(f32::INFINITY, f32::min)
}

/// Distance of the origin from a triangle; 0 within.
fn distance([a, b, c]: [Vec2; 3]) -> f32 {
    let edges = [(a, b), (b, c), (c, a)];
    let sides = edges.map(|(p, q)| (q - p).perp_dot(-p));
    if sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0) {
        return 0.0;
    }
    let from = edges.map(|(p, q)| {
        let along = q - p;
        let share = -p.dot(along) / along.length_squared().max(f32::MIN_POSITIVE);
        (p + share.clamp(0.0, 1.0) * along).length()
    });
    from.into_iter().fold(f32::INFINITY, f32::min)
}

/// A flight, and how far it has come.
pub(super) struct Flight {
    course: Course,
    /// Hash of the scene that it is in.
    scene: String,
    /// Where it began, and where it ends.
    home: Camera,
    /// m from the start of the member.
    chainage: f32,
    pub(super) plays: bool,
    /// When it went on last, s by the clock of the frames; none: it has rested since.
    since: Option<f64>,
    /// Whether somebody has put it elsewhere.
    is_moved: bool,
}

impl Flight {
    /// Along the member of this index, from where one is at `home`; none: it has no surface.
    pub(super) fn along(
        scene: &Scene,
        member: usize,
        triangles: &[[Vec3; 3]],
        home: &Camera,
    ) -> Option<Self> {
        let member = scene.members.get(member)?;
        let course = Course::of(member.kind, member.frame, triangles, home.position)?;
        Some(Self {
            course,
            scene: scene.hash.clone(),
            home: home.clone(),
            chainage: 0.0,
            plays: true,
            since: None,
            is_moved: true,
        })
    }

    /// Goes on until `now`, s by the clock of the frames.
    pub(super) fn go_on(&mut self, now: f64) {
        if self.plays {
            let passed = self.since.replace(now).map_or(0.0, |since| now - since);
            let pace = self.course.length / WHOLE;
            self.chainage += pace * passed.clamp(0.0, LONGEST) as f32;
        }
    }

    /// Whether it has come to its end, or the scene is another one.
    pub(super) fn is_over(&self, scene: &Scene) -> bool {
        self.plays && self.chainage >= self.course.length || self.scene != scene.hash
    }

    /// Stays where it is.
    pub(super) fn rest(&mut self) {
        (self.plays, self.since) = (false, None);
    }

    /// Halts, or goes on from where it was, wherever one has looked since.
    pub(super) fn halt(&mut self) {
        (self.plays, self.since, self.is_moved) = (!self.plays, None, true);
    }

    /// Where the camera has to be; none: it is free.
    pub(super) fn camera(&mut self) -> Option<Camera> {
        let is_moved = std::mem::take(&mut self.is_moved);
        (self.plays || is_moved).then(|| {
            let Sight { eye, target, up, fov } = self.course.at(self.chainage);
            let home = self.home.clone();
            Camera { position: eye, target, up, fov_deg: fov, lens: None, ..home }
        })
    }

    /// Where it began.
    pub(super) fn home(&self) -> &Camera {
        &self.home
    }

    /// Its row of tools; whether it is to end.
    pub(super) fn tools(&mut self, ui: &mut Ui) -> bool {
        let name = if self.plays { tr!("⏸ Pause the flight") } else { tr!("▶ Fly on") };
        let is_halted = ui.button(name).on_hover_text("Space").clicked();
        if is_halted {
            self.halt();
        }
        ui.spacing_mut().slider_width = WIDTH;
        let mut chainage = self.chainage;
        let slider = Slider::new(&mut chainage, 0.0..=self.course.length).show_value(false);
        let slider = ui.add(slider);
        slider.widget_info(|| WidgetInfo::slider(true, f64::from(chainage), tr!("Chainage")));
        // Whoever takes the slider wants to stay where it is put.
        if slider.changed() {
            self.rest();
            (self.chainage, self.is_moved) = (chainage, true);
        }
        let [at, of] = [self.chainage, self.course.length].map(lengths::chainage);
        ui.strong(tr!("chainage {} of {}", at, of));
        let ends = ui.button(tr!("⏹ End the flight")).on_hover_text("Esc").clicked();
        if ends || is_halted || slider.changed() {
            ui.ctx().request_repaint();
        }
        ends
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS: f32 = 2.75;
    const SIDES: usize = 48;

    /// A round tunnel along +z, from z = −6 on.
    fn frame() -> Frame {
        Frame { start: Vec3::NEG_Z * 6.0, axis: Vec3::Z * 12.0, zero: Vec3::X }
    }

    /// A quadrangle as two triangles.
    fn halves([a, b, c, d]: [Vec3; 4]) -> [[Vec3; 3]; 2] {
        [[a, b, c], [a, c, d]]
    }

    /// Its inner and outer faces and its ends.
    fn tunnel() -> Vec<[Vec3; 3]> {
        let at = |k: usize, r: f32, z: f32| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / SIDES as f32).sin_cos();
            Vec3::new(r * cos, r * sin, z)
        };
        let strip = |k: usize| {
            let round = |[r0, z0]: [f32; 2], [r1, z1]: [f32; 2]| {
                halves([at(k, r0, z0), at(k + 1, r0, z0), at(k + 1, r1, z1), at(k, r1, z1)])
            };
            let outer = RADIUS + 0.4;
            let rims = [[RADIUS, -6.0], [RADIUS, 6.0], [outer, 6.0], [outer, -6.0]];
            (0..4).flat_map(|i| round(rims[i], rims[(i + 1) % 4])).collect::<Vec<_>>()
        };
        (0..SIDES).flat_map(strip).collect()
    }

    /// A beam of 0.4 m by 0.6 m and 8 m along +x.
    fn beam() -> (Frame, Vec<[Vec3; 3]>) {
        let at = |y: f32, z: f32, x: f32| Vec3::new(8.0 * x, 0.6 * (y - 0.5), 0.4 * (z - 0.5));
        let rim = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let side = |i: usize| {
            let ([y0, z0], [y1, z1]) = (rim[i], rim[(i + 1) % 4]);
            halves([at(y0, z0, 0.0), at(y1, z1, 0.0), at(y1, z1, 1.0), at(y0, z0, 1.0)])
        };
        let frame = Frame { start: Vec3::ZERO, axis: Vec3::X * 8.0, zero: Vec3::Y };
        (frame, (0..4).flat_map(side).collect())
    }

    /// All of a course in steps of a thousandth.
    fn flown(course: &Course) -> Vec<Sight> {
        (0..=1000).map(|k| course.at(course.length * k as f32 / 1000.0)).collect()
    }

    fn is_even(course: &Course, sights: &[Sight]) -> bool {
        sights.windows(2).all(|pair| {
            let step = pair[1].eye.distance(pair[0].eye) - course.length / 1000.0;
            let turn = (pair[1].target - pair[1].eye).distance(pair[0].target - pair[0].eye);
            step.abs() < 1e-4 && turn < 1e-4 && pair[1].up == pair[0].up
        })
    }

    #[test]
    fn through_a_tunnel_one_stays_in_its_opening_and_looks_along_its_axis() {
        let course = Course::of(MemberKind::Lining, frame(), &tunnel(), Vec3::ONE).unwrap();
        let Way::Inside(open) = course.way else { panic!("beside it: {course:?}") };
        // The opening of a polygon of so many sides is its inner circle.
        let inner = RADIUS * (std::f32::consts::PI / SIDES as f32).cos();
        assert!((open - inner).abs() < 1e-4, "{open} {inner}");
        let sights = flown(&course);
        for sight in &sights {
            assert!(sight.eye.truncate().length() < open && sight.eye.z.abs() <= 6.0 + 1e-4);
            let ahead = (sight.target - sight.eye).normalize();
            assert!(ahead.distance(Vec3::Z) < 1e-6 && ahead.dot(sight.up).abs() < 1e-6);
        }
        assert!(is_even(&course, &sights));
        let ends = [sights[0].eye, sights[1000].eye];
        assert!(
            ends[0].distance(frame().start) < 1e-5 && ends[1].distance(frame().point(1.0)) < 1e-4
        );
    }

    #[test]
    fn beside_a_beam_one_stays_on_the_side_where_one_was_and_looks_at_it() {
        let (frame, triangles) = beam();
        for from in [Vec3::new(3.0, 2.0, 9.0), Vec3::new(1.0, -5.0, -2.0), Vec3::new(4.0, 9.0, 0.0)]
        {
            let course = Course::of(MemberKind::Beam, frame, &triangles, from).unwrap();
            let sights = flown(&course);
            let side = Vec3::new(0.0, from.y, from.z).normalize();
            for sight in &sights {
                let off = sight.eye - sight.target;
                assert!(off.length() > 4.0 * 0.36 && off.normalize().distance(side) < 1e-5);
                assert!(sight.target.with_x(0.0).length() < 1e-5, "{sight:?}");
                let across = off.normalize().cross(sight.up).length();
                assert!(across > 0.1, "nobody knows what is up: {sight:?}");
            }
            assert!(is_even(&course, &sights), "{from}");
        }
        // From above, the picture goes to the right.
        let course = Course::of(MemberKind::Beam, frame, &triangles, Vec3::Y * 9.0).unwrap();
        let Sight { eye, target, up, .. } = course.at(1.0);
        assert!((target - eye).cross(up).normalize().distance(Vec3::X) < 1e-5);
    }

    #[test]
    fn what_has_no_opening_is_flown_along_from_beside_and_what_has_no_length_not_at_all() {
        let (frame, triangles) = beam();
        let course = Course::of(MemberKind::Lining, frame, &[triangles[0]], Vec3::Y).unwrap();
        assert!(matches!(course.way, Way::Inside(_)), "one face leaves the axis free");
        let plug =
            [[Vec3::new(4.0, -1.0, -1.0), Vec3::new(4.0, 1.0, -1.0), Vec3::new(4.0, 0.0, 1.0)]];
        let course = Course::of(MemberKind::Lining, frame, &plug, Vec3::Y).unwrap();
        assert!(matches!(course.way, Way::Beside(_)), "the axis is walled up");
        let dot = Frame { axis: Vec3::ZERO, ..frame };
        assert_eq!(Course::of(MemberKind::Beam, dot, &triangles, Vec3::Y), None);
        assert_eq!(Course::of(MemberKind::Beam, frame, &[], Vec3::Y), None);
    }

    #[test]
    fn in_a_shaft_something_else_than_the_vertical_is_up() {
        let shaft = Frame { start: Vec3::ZERO, axis: Vec3::Y * 20.0, zero: Vec3::X };
        let ring: Vec<[Vec3; 3]> =
            tunnel().iter().map(|t| t.map(|p| Vec3::new(p.y, p.z + 6.0, p.x))).collect();
        let course = Course::of(MemberKind::Lining, shaft, &ring, Vec3::ONE).unwrap();
        let Sight { eye, target, up, .. } = course.at(3.0);
        assert!((target - eye).normalize().dot(up).abs() < 1e-6 && up == Vec3::X);
    }

    fn flight() -> Flight {
        let course = Course::of(MemberKind::Lining, frame(), &tunnel(), Vec3::ONE).unwrap();
        let home = Camera::overview([Vec3::ZERO, Vec3::ONE]);
        let scene = Scene::default().hash;
        Flight { course, scene, home, chainage: 0.0, plays: true, since: None, is_moved: true }
    }

    #[test]
    fn a_flight_takes_twenty_seconds_whatever_the_frames() {
        for frame in [0.016, 0.25] {
            let (mut flight, mut now) = (flight(), 100.0);
            while !flight.is_over(&Scene::default()) {
                now += frame;
                flight.go_on(now);
            }
            // The first frame begins it.
            assert!((now - 100.0 - frame - 20.0).abs() < 2.0 * frame, "{now}");
        }
    }

    #[test]
    fn a_flight_that_halts_stays_where_it_is_and_goes_on_from_there() {
        let mut flight = flight();
        [0.0, 0.2, 0.4].into_iter().for_each(|now| flight.go_on(now));
        let here = flight.chainage;
        assert!((here - 0.4 * 12.0 / 20.0).abs() < 1e-5 && flight.camera().is_some());
        flight.halt();
        assert!(flight.camera().is_some_and(|c| c.position.z > -6.0));
        flight.go_on(5.0);
        assert!(flight.chainage == here && flight.camera().is_none(), "the camera is free");
        flight.halt();
        flight.go_on(60.0);
        assert_eq!(flight.chainage, here, "what has passed meanwhile does not count");
        flight.go_on(90.0);
        assert!(flight.chainage - here < 0.6 * 12.0 / 20.0, "a long frame is no leap");
    }
}
