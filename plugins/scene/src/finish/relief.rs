//! What makes relief: boards, pores, joints, holes, grain. Heights in metres, outward.

use glam::{Vec2, vec2};
use intrados_stage::random::Key;

use super::noise::{bits, cell, octaves, octaves_slope, scattered, smooth, step, unit, visible};

/// One kind of relief.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Relief {
    Boards(Boards),
    Pores(Pores),
    Joints(Joints),
    Holes(Holes),
    Rough(Rough),
    Stones(Stones),
}

/// Boards of a form, their grain pressed into the paste, with steps and seams between them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Boards {
    /// Whether they lie along u.
    pub(super) lying: bool,
    /// m.
    pub(super) width: f32,
    /// m.
    pub(super) length: f32,
    /// Root mean square step between neighbours, m.
    pub(super) step: f32,
    /// Amplitude of the grain, m.
    pub(super) grain: f32,
    /// Height of the fins that leaked through seams, m; a groove where negative.
    pub(super) fin: f32,
    /// m.
    pub(super) seam: f32,
    /// How much boards differ in tone.
    pub(super) tone: f32,
    /// How dark their seams are.
    pub(super) dark: f32,
}

/// Bug-holes: air that stayed at the form.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pores {
    /// Radius of the largest, m; there are three sizes, each 2.7 times smaller.
    pub(super) largest: f32,
    /// Share of cells that have one.
    pub(super) share: f32,
}

/// Joints between panels, drawn or sawn.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Joints {
    /// Panels across and up, m.
    pub(super) panel: Vec2,
    /// m.
    pub(super) width: f32,
    /// Positive inward, m.
    pub(super) depth: f32,
    /// How much panels differ in tone.
    pub(super) tone: f32,
    /// How dark the joint is.
    pub(super) dark: f32,
}

/// Holes of the form's ties: open, or closed by a plug.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Holes {
    /// m.
    pub(super) spacing: Vec2,
    /// m.
    pub(super) radius: f32,
    /// m.
    pub(super) depth: f32,
    /// Tone of the plug; dark where open.
    pub(super) tone: f32,
}

/// Unevenness without a pattern.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rough {
    /// Longest wave along u and v, m.
    pub(super) size: Vec2,
    pub(super) octaves: u32,
    /// Strength of each octave over the one before.
    pub(super) gain: f32,
    /// m.
    pub(super) amplitude: f32,
    /// How much hollows are darker.
    pub(super) dark: f32,
}

/// Aggregate that shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stones {
    /// m.
    pub(super) size: f32,
    /// How far they stand out, m.
    pub(super) height: f32,
    /// How much they differ in tone.
    pub(super) tone: f32,
    /// How dark the matrix between them is.
    pub(super) dark: f32,
}

fn other(key: Key, number: u32) -> Key {
    Key(key.0.wrapping_add(number.wrapping_mul(0x51ed_270b)), key.1 ^ number)
}

/// A bell of height 1 about 0.
fn bell(x: f32) -> f32 {
    1.0 / (1.0 + x * x * x * x)
}

impl Relief {
    /// Height at a place, m.
    pub(super) fn height(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        match self {
            Self::Boards(boards) => boards.height(other(key, 1), at, footprint),
            Self::Pores(pores) => -pores.depth(other(key, 2), at, footprint),
            Self::Joints(joints) => {
                let seen = visible(joints.width, footprint);
                if seen > 0.0 { -seen * joints.depth * joints.mask(at) } else { 0.0 }
            }
            Self::Holes(holes) => holes.height(at, footprint),
            Self::Rough(rough) => rough.height(other(key, 5), at, footprint),
            Self::Stones(stones) => stones.height(other(key, 6), at, footprint),
        }
    }

    /// Slope at a place where it is known without differences.
    pub(super) fn slope(&self, key: Key, at: Vec2, footprint: f32) -> Option<Vec2> {
        let Self::Rough(rough) = self else { return None };
        Some(rough.slope(other(key, 5), at, footprint))
    }

    /// What the relief makes of the colour: a factor whose mean is about 1.
    pub(super) fn tone(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        match self {
            Self::Boards(boards) => boards.tone(other(key, 1), at, footprint),
            Self::Pores(pores) => pores.tone(other(key, 2), at, footprint),
            Self::Joints(joints) => joints.tone(other(key, 3), at, footprint),
            Self::Holes(holes) => holes.tone(at, footprint),
            Self::Rough(rough) if rough.dark > 0.0 => {
                let h = rough.height(other(key, 5), at, footprint) / rough.amplitude;
                (1.0 + rough.dark * h).clamp(0.3, 1.7)
            }
            Self::Rough(_) => 1.0,
            Self::Stones(stones) => stones.tone(other(key, 6), at, footprint),
        }
    }
}

impl Boards {
    /// The board there, its place across (−½ to ½ of a width) and along (m).
    fn board(&self, key: Key, at: Vec2) -> ([i32; 2], f32, f32) {
        let (along, across) = if self.lying { (at.x, at.y) } else { (at.y, at.x) };
        let row = (across / self.width).floor();
        let shift = unit(key, [row as i32, 0], 7) * self.length;
        let column = ((along + shift) / self.length).floor();
        let end = along + shift - (column + 0.5) * self.length;
        ([row as i32, column as i32], across / self.width - row - 0.5, end)
    }

    fn height(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        let (board, across, along) = self.board(key, at);
        let raised = (unit(key, board, 8) + unit(key, board, 9) - 1.0) * 2.4 * self.step;
        let tilt = (unit(key, board, 10) - 0.5) * self.step * across;
        let edge = self.edge(across, along);
        let seam = visible(self.seam, footprint);
        let fin = if seam > 0.0 && edge < 4.0 * self.seam {
            seam * self.fin * bell(edge / self.seam) * self.leak(key, at, board)
        } else {
            0.0
        };
        // A step is a slope over some footprints where it would be none at all.
        let soft = step(0.0, 2.0 * footprint.max(1e-3), edge);
        (raised + tilt) * soft
            + fin
            + self.grain * self.grain_at(key, board, across, along, footprint)
    }

    /// Years of the wood: stretched noise that a slow wave bends, with here and there a knot.
    fn grain_at(&self, key: Key, board: [i32; 2], across: f32, along: f32, footprint: f32) -> f32 {
        let key = Key(key.0 ^ bits(key, board, 11), key.1);
        let across = across * self.width;
        if visible(0.012, footprint) <= 0.0 {
            return 0.0;
        }
        let bend = 0.012 * smooth(key, vec2(along / 0.5, across / 0.1));
        octaves(key, vec2(along * 0.03, across + bend), 0.014, 3, 0.6, footprint)
    }

    /// Distance to the board's nearest edge, m.
    fn edge(&self, across: f32, along: f32) -> f32 {
        ((0.5 - across.abs()) * self.width).min(0.5 * self.length - along.abs())
    }

    /// How much leaked through a seam: here more, there nothing.
    fn leak(&self, key: Key, at: Vec2, board: [i32; 2]) -> f32 {
        let along = if self.lying { at.x } else { at.y };
        let key = Key(key.0 ^ bits(key, board, 12), key.1);
        step(
            -0.3,
            0.4,
            smooth(key, vec2(along / 0.09, 0.5)) + 0.5 * smooth(key, vec2(along / 0.02, 1.5)),
        )
    }

    fn tone(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        let (board, across, along) = self.board(key, at);
        let seen = visible(self.width, footprint);
        let own = 1.0 + seen * self.tone * (unit(key, board, 13) - 0.5);
        let edge = self.edge(across, along);
        let seam = visible(self.seam, footprint);
        let mut tone = own;
        if seam > 0.0 && edge < 4.0 * self.seam {
            tone *= 1.0 - seam * self.dark * bell(edge / self.seam) * self.leak(key, at, board);
        }
        let grain = self.grain_at(key, board, across, along, footprint);
        tone * (1.0 + 0.12 * grain)
    }
}

impl Pores {
    /// Depth at a place, m, and how deep within its pore, [0, 1].
    fn find(&self, key: Key, at: Vec2, footprint: f32) -> (f32, f32) {
        let (mut depth, mut inside) = (0.0_f32, 0.0_f32);
        for size in 0..3_u32 {
            let largest = self.largest * 0.37_f32.powi(size as i32);
            let seen = visible(largest, footprint);
            if seen <= 0.0 {
                break;
            }
            let key = other(key, 20 + size);
            let side = 5.0 * largest;
            // They crowd in some places and leave others.
            let crowd = 0.5 + 1.6 * smooth(key, at / 0.35);
            let (of, f) = cell(at / side);
            if unit(key, of, 3) > self.share * crowd {
                continue;
            }
            let radius = 0.2 * (0.35 + 0.65 * unit(key, of, 4) * unit(key, of, 5));
            let room = 1.0 - 2.4 * radius;
            let centre = vec2(unit(key, of, 6), unit(key, of, 7)) * room + 1.2 * radius;
            let from = f - centre;
            let turn = std::f32::consts::TAU * unit(key, of, 8);
            let (sin, cos) = turn.sin_cos();
            let long = vec2(cos * from.x + sin * from.y, cos * from.y - sin * from.x);
            let stretch = 0.65 + 0.35 * unit(key, of, 9);
            let uneven = 1.0 + 0.15 * smooth(key, from * 9.0);
            let d = vec2(long.x, long.y / stretch).length() / (radius * uneven);
            if d < 1.0 {
                let bowl = (1.0 - d * d).sqrt();
                depth = depth.max(seen * bowl * 0.7 * radius * side * stretch);
                inside = inside.max(seen * bowl);
            }
        }
        (depth, inside)
    }

    fn depth(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        self.find(key, at, footprint).0
    }

    fn tone(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        1.0 - 0.62 * step(0.15, 0.75, self.find(key, at, footprint).1)
    }
}

impl Joints {
    /// 1 in the joint, 0 outside.
    fn mask(&self, at: Vec2) -> f32 {
        let part = at / self.panel;
        let d = ((part - part.floor() - 0.5).abs() - 0.5).abs() * self.panel;
        bell(2.0 * d.min_element() / self.width)
    }

    fn tone(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        let (panel, _) = cell(at / self.panel);
        let own = 1.0 + self.tone * (unit(key, panel, 1) - 0.5);
        let seen = visible(self.width, footprint);
        if seen <= 0.0 {
            return own;
        }
        let broken = 0.6 + 0.7 * smooth(key, at / 0.15);
        own * (1.0 - seen * self.dark * self.mask(at) * broken.clamp(0.0, 1.0))
    }
}

impl Holes {
    /// Distance from the nearest hole's middle over its radius.
    fn distance(&self, at: Vec2) -> f32 {
        let part = at / self.spacing;
        ((part - part.floor() - 0.5) * self.spacing).length() / self.radius
    }

    fn height(&self, at: Vec2, footprint: f32) -> f32 {
        let seen = visible(self.radius, footprint);
        if seen <= 0.0 { 0.0 } else { -seen * self.depth * step(1.05, 0.85, self.distance(at)) }
    }

    fn tone(&self, at: Vec2, footprint: f32) -> f32 {
        let seen = visible(self.radius, footprint);
        if seen <= 0.0 {
            return 1.0;
        }
        let d = self.distance(at);
        let plug = 1.0 - seen * (1.0 - self.tone) * step(1.05, 0.85, d);
        // Grout that left its paste about the cone.
        plug * (1.0 - 0.25 * seen * bell((d - 1.0) / 0.12))
    }
}

impl Rough {
    fn slope(&self, key: Key, at: Vec2, footprint: f32) -> Vec2 {
        let longest = self.size.max_element();
        let stretch = longest / self.size;
        let at = at * stretch;
        let slope = octaves_slope(key, at, longest, self.octaves, self.gain, footprint);
        self.amplitude * stretch * slope
    }

    fn height(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        let longest = self.size.max_element();
        let at = at * (longest / self.size);
        self.amplitude * octaves(key, at, longest, self.octaves, self.gain, footprint)
    }
}

/// Share of a face of stones that is matrix.
const BETWEEN: f32 = 0.42;

impl Stones {
    /// How far from the border to the next stone, and whose place it is.
    fn stone(&self, key: Key, at: Vec2) -> (f32, [i32; 2]) {
        let ([near, next], stone) = scattered(key, at / self.size);
        (next.sqrt() - near.sqrt(), stone)
    }

    fn height(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        let seen = visible(self.size, footprint);
        if seen <= 0.0 {
            return 0.0;
        }
        let (border, stone) = self.stone(key, at);
        let own = 0.3 + 0.7 * unit(key, stone, 2);
        seen * self.height * own * step(0.0, 0.5, border)
    }

    fn tone(&self, key: Key, at: Vec2, footprint: f32) -> f32 {
        let seen = visible(self.size, footprint);
        if seen <= 0.0 {
            return 1.0 - BETWEEN * self.dark;
        }
        let (border, stone) = self.stone(key, at);
        // Most stones are of one kind, a few are bright.
        let u = unit(key, stone, 3);
        let own = 1.0 + self.tone * (u * u * u * u - 0.2);
        let matrix = 1.0 - self.dark * (1.0 - step(0.02, 0.3, border));
        1.0 - BETWEEN * self.dark + seen * (own * matrix - 1.0 + BETWEEN * self.dark)
    }
}
