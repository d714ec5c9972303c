//! Recipes: what is drawn of a finish, with ranges of what is seen on real members.

use glam::{Vec2, Vec3, vec2};
use intrados_stage::random::{Draw, Key};

use super::{
    Finish, FinishKind, StainKind,
    relief::{Boards, Holes, Joints, Pores, Relief, Rough, Stones},
    tone::{Band, Base, Cover, Lifts, Mark, Matter, Patches, Repairs, Runs, Strokes, Trail},
};

impl Finish {
    /// The finish of a kind with everything drawn by `key`. `worn` from 0 (as struck) to 1 (dirty,
    /// stained, written upon) says how many marks there are.
    #[must_use]
    pub fn new(kind: FinishKind, key: Key, worn: f32) -> Self {
        let mut draw = Dice(Draw::new(key.split(1, kind as u32)));
        let reliefs = match kind {
            FinishKind::Board => boards(&mut draw),
            FinishKind::Panel => panels(&mut draw),
            FinishKind::Shotcrete => {
                vec![rough(&mut draw, 0.09, 5, [2e-3, 5e-3], 0.12), sand(&mut draw)]
            }
            FinishKind::Plaster => plaster(&mut draw),
            FinishKind::Asphalt => asphalt(&mut draw),
            FinishKind::Brushed => brushed(&mut draw),
            FinishKind::Broken => broken(&mut draw),
        };
        let base = base(kind, &mut draw);
        Self { kind, key, base, reliefs, marks: marks(kind, worn, &mut draw) }
    }

    /// The same with rust running down its face, or with efflorescence, as strong as they come.
    #[must_use]
    pub fn stained(mut self, rust: bool, efflorescence: bool) -> Self {
        let mut draw = Dice(Draw::new(self.key.split(2, 0)));
        if efflorescence {
            self.marks.push(salt_patches(&mut draw));
            self.marks.push(runs(&mut draw, salt(), 0.25, 0.035, 0.6, 0.5));
        }
        if rust {
            self.marks.push(rust_patches(&mut draw));
            self.marks.push(runs(
                &mut draw,
                iron(&mut Dice(Draw::new(self.key))),
                0.22,
                0.03,
                0.7,
                0.5,
            ));
        }
        self
    }

    /// The same with a stain that begins at a place of the face and runs down from it, at most so
    /// wide and long, m.
    #[must_use]
    pub fn stained_at(mut self, kind: StainKind, from: Vec2, width: f32, length: f32) -> Self {
        let cover = match kind {
            // Where it stands in the open rust is brown, and darker than on the steel itself.
            StainKind::Rust => Cover {
                matter: Matter::Rust,
                colour: Vec3::new(0.24, 0.115, 0.045),
                replaces: true,
                strength: 0.75,
            },
            StainKind::Efflorescence => salt(),
        };
        self.marks.push(Mark::Trail(Trail { cover, from, width, length }));
        self
    }
}

impl Finish {
    /// The same with lines that are no cracks, as whoever looks for cracks must learn to leave
    /// alone: narrow seams, pencil and chalk, scratches, thin runs, specks, rims of covers. They
    /// are as fine as a picture of so many metres a pixel can show.
    #[must_use]
    pub fn lined(mut self, pixel: f32) -> Self {
        let mut draw = Dice(Draw::new(self.key.split(3, 0)));
        for share in [0.45, 0.2] {
            if draw.chance(share) {
                self.reliefs.push(seams(&mut draw, pixel));
            }
        }
        if draw.chance(0.45) {
            self.reliefs.push(coarse(&mut draw, pixel));
        }
        if draw.chance(0.4) {
            self.reliefs.push(pinholes(&mut draw, pixel));
        }
        if draw.chance(0.08) {
            self.reliefs.push(covers(&mut draw, pixel));
        }
        for share in [0.5, 0.3] {
            if draw.chance(share) {
                self.marks.push(specks(&mut draw, pixel));
            }
        }
        if draw.chance(0.3) {
            self.marks.push(thin_runs(&mut draw, pixel));
        }
        for share in [0.35, 0.15] {
            if draw.chance(share) {
                self.marks.push(long_lines(&mut draw, pixel));
            }
        }
        self
    }
}

/// Draws in single precision.
struct Dice(Draw);

impl Dice {
    fn between(&mut self, low: f32, high: f32) -> f32 {
        self.0.between(f64::from(low), f64::from(high)) as f32
    }

    fn log(&mut self, low: f32, high: f32) -> f32 {
        self.0.log_between(f64::from(low), f64::from(high)) as f32
    }

    fn chance(&mut self, share: f32) -> bool {
        self.0.chance(f64::from(share))
    }
}

fn boards(draw: &mut Dice) -> Vec<Relief> {
    let fin = draw.log(0.3e-3, 2.5e-3);
    let board = Boards {
        lying: draw.chance(0.5),
        width: draw.between(0.08, 0.2),
        length: draw.between(1.2, 4.0),
        step: draw.log(0.2e-3, 1.2e-3),
        grain: draw.log(0.08e-3, 0.6e-3),
        fin: if draw.chance(0.3) { -fin } else { fin },
        seam: draw.log(0.7e-3, 3e-3),
        tone: draw.between(0.05, 0.35),
        dark: draw.between(0.05, 0.55),
    };
    let mut reliefs = vec![Relief::Boards(board), pores(draw), sand(draw)];
    if draw.chance(0.3) {
        reliefs.push(holes(draw));
    }
    reliefs
}

fn panels(draw: &mut Dice) -> Vec<Relief> {
    let joints = Joints {
        panel: vec2(draw.between(0.6, 2.7), draw.between(0.5, 1.5)),
        width: draw.log(1.5e-3, 10e-3),
        depth: draw.between(-1.5e-3, 3e-3),
        tone: draw.between(0.02, 0.2),
        dark: draw.between(0.1, 0.6),
    };
    let wave = rough(draw, 0.4, 3, [0.1e-3, 0.5e-3], 0.0);
    vec![wave, Relief::Joints(joints), holes(draw), pores(draw), sand(draw)]
}

fn plaster(draw: &mut Dice) -> Vec<Relief> {
    let size = draw.log(4e-3, 40e-3);
    vec![rough(draw, size, 4, [0.03 * size, 0.09 * size], 0.08), sand(draw)]
}

fn asphalt(draw: &mut Dice) -> Vec<Relief> {
    let size = draw.log(3.5e-3, 9e-3);
    let mut stones = |size: f32, share: f32| {
        Relief::Stones(Stones {
            size,
            height: draw.between(0.03, 0.1) * size,
            tone: share * draw.between(0.3, 1.1),
            dark: share * draw.between(0.1, 0.3),
        })
    };
    let [coarse, fine] = [stones(size, 1.0), stones(0.37 * size, 0.8)];
    vec![coarse, fine, rough(draw, 6e-3, 4, [0.3e-3, 0.9e-3], 0.2)]
}

fn brushed(draw: &mut Dice) -> Vec<Relief> {
    let pitch = draw.log(2e-3, 8e-3);
    let lines = Rough {
        size: if draw.chance(0.5) { vec2(60.0 * pitch, pitch) } else { vec2(pitch, 60.0 * pitch) },
        octaves: 3,
        gain: 0.6,
        amplitude: draw.log(0.02, 0.08) * pitch,
        dark: 0.1,
    };
    let mut reliefs = vec![Relief::Rough(lines), sand(draw)];
    if draw.chance(0.35) {
        // Sawn or formed joints of slabs, some of them sealed.
        reliefs.push(Relief::Joints(Joints {
            panel: vec2(draw.between(0.8, 4.0), draw.between(0.8, 4.0)),
            width: draw.log(3e-3, 15e-3),
            depth: draw.between(0.0, 5e-3),
            tone: draw.between(0.02, 0.2),
            dark: draw.between(0.2, 0.8),
        }));
    }
    if draw.chance(0.4) {
        reliefs.push(pores(draw));
    }
    reliefs
}

fn broken(draw: &mut Dice) -> Vec<Relief> {
    let size = draw.log(7e-3, 18e-3);
    let stones = Stones {
        size,
        height: 0.12 * size,
        tone: draw.between(0.15, 0.5),
        dark: draw.between(-0.1, 0.1),
    };
    vec![
        rough(draw, 0.04, 4, [3e-3, 6e-3], 0.15),
        Relief::Stones(stones),
        rough(draw, 5e-3, 3, [0.4e-3, 0.8e-3], 0.1),
    ]
}

fn pores(draw: &mut Dice) -> Relief {
    Relief::Pores(Pores { largest: draw.log(2e-3, 9e-3), share: draw.between(0.05, 0.6) })
}

fn holes(draw: &mut Dice) -> Relief {
    let spacing = draw.between(0.5, 1.3);
    Relief::Holes(Holes {
        spacing: vec2(spacing, spacing * draw.between(0.6, 1.4)),
        radius: draw.between(9e-3, 28e-3),
        depth: draw.log(1e-3, 15e-3),
        tone: if draw.chance(0.5) { draw.between(0.2, 0.6) } else { draw.between(0.75, 1.15) },
    })
}

fn rough(draw: &mut Dice, size: f32, octaves: u32, [low, high]: [f32; 2], dark: f32) -> Relief {
    Relief::Rough(Rough {
        size: Vec2::splat(size),
        octaves,
        gain: draw.between(0.4, 0.55),
        amplitude: draw.log(low, high),
        dark,
    })
}

/// The roughness of the paste itself.
fn sand(draw: &mut Dice) -> Relief {
    Relief::Rough(Rough {
        size: Vec2::splat(8e-3),
        octaves: 4,
        gain: draw.between(0.55, 0.75),
        amplitude: draw.log(0.05e-3, 0.25e-3),
        dark: 0.0,
    })
}

fn base(kind: FinishKind, draw: &mut Dice) -> Base {
    let warm = draw.between(-0.04, 0.07);
    let mut tint = Vec3::new(1.0 + warm, 1.0, 1.0 - 1.4 * warm) * draw.between(0.75, 1.15);
    match kind {
        FinishKind::Asphalt => tint *= draw.between(0.25, 0.6),
        // Its material is already the member's own.
        FinishKind::Broken => tint = Vec3::splat(draw.between(0.85, 1.1)),
        FinishKind::Plaster if draw.chance(0.4) => {
            tint *= Vec3::new(1.25, draw.between(1.08, 1.22), draw.between(0.75, 1.1));
        }
        _ => {}
    }
    Base {
        tint,
        blotch: draw.log(0.08, 0.6),
        contrast: draw.between(0.1, 0.5),
        grain: draw.between(0.06, 0.25),
    }
}

fn marks(kind: FinishKind, worn: f32, draw: &mut Dice) -> Vec<Mark> {
    let mut marks = Vec::new();
    let upright = !matches!(kind, FinishKind::Asphalt | FinishKind::Brushed | FinishKind::Broken);
    if upright && kind != FinishKind::Plaster && draw.chance(0.5) {
        marks.push(Mark::Lifts(Lifts {
            height: draw.between(0.4, 1.8),
            contrast: draw.between(0.03, 0.2),
            dark: draw.between(0.05, 0.4),
            line: draw.log(2e-3, 12e-3),
        }));
    }
    if draw.chance(0.3 * worn) {
        let tint = Vec3::ONE * draw.between(0.7, 1.25);
        marks.push(Mark::Repairs(Repairs { spacing: draw.log(0.2, 1.5), share: 0.3, tint }));
    }
    if draw.chance(0.2 * worn) {
        marks.push(paint(kind, draw));
    }
    if draw.chance(0.4 + 0.6 * worn) {
        marks.push(damp(draw));
    }
    if draw.chance(0.3 + 0.7 * worn) {
        marks.push(streaks(kind, draw));
    }
    if upright && draw.chance(0.85 * worn) {
        let cover = Cover {
            matter: Matter::Dirt,
            colour: Vec3::new(0.5, 0.48, 0.44) * draw.between(0.5, 1.3),
            replaces: false,
            strength: draw.between(0.3, 0.9),
        };
        marks.push(runs(draw, cover, 0.16, 0.07, 1.2, 0.5));
        marks.push(runs(draw, cover, 0.045, 0.018, 0.5, 0.4));
    }
    if draw.chance(0.25 * worn) {
        marks.push(moss(draw));
    }
    if upright && draw.chance(0.25 * worn) {
        // Little lime, as on most members: no efflorescence that one would report.
        let cover = Cover { matter: Matter::Dirt, strength: draw.between(0.1, 0.3), ..salt() };
        marks.push(runs(draw, cover, 0.1, 0.03, 0.8, 0.35));
    }
    if draw.chance(0.35 * worn) {
        marks.push(strokes(draw));
    }
    if draw.chance(0.45 * worn) {
        marks.push(scratches(draw));
    }
    marks
}

fn paint(kind: FinishKind, draw: &mut Dice) -> Mark {
    let bright = draw.between(0.3, 0.85);
    let hue = Vec3::new(draw.between(0.7, 1.0), draw.between(0.7, 1.0), draw.between(0.6, 1.0));
    let colour = if draw.chance(0.7) { Vec3::splat(bright) } else { bright * hue };
    let road = matches!(kind, FinishKind::Asphalt | FinishKind::Brushed);
    Mark::Band(Band {
        period: if road { draw.between(0.6, 2.5) } else { draw.between(0.5, 3.0) },
        share: if road { draw.between(0.06, 0.2) } else { draw.between(0.1, 0.6) },
        across: draw.chance(0.5),
        colour,
        worn: draw.between(0.0, 0.5),
    })
}

fn damp(draw: &mut Dice) -> Mark {
    Mark::Patches(Patches {
        cover: Cover {
            matter: Matter::Dirt,
            colour: Vec3::new(0.62, 0.6, 0.57) * draw.between(0.7, 1.2),
            replaces: false,
            strength: draw.between(0.3, 0.9),
        },
        size: draw.log(0.06, 0.8),
        tall: draw.log(0.6, 5.0),
        from: draw.between(-0.15, 0.3),
        border: draw.log(0.05, 0.6),
    })
}

/// Thin films of paste and dirt, drawn out along the form or down the wall.
fn streaks(kind: FinishKind, draw: &mut Dice) -> Mark {
    let pale = draw.chance(0.4);
    let tint = if pale { draw.between(1.1, 1.35) } else { draw.between(0.55, 0.85) };
    let upright = !matches!(kind, FinishKind::Asphalt | FinishKind::Brushed);
    Mark::Patches(Patches {
        cover: Cover {
            matter: Matter::Dirt,
            colour: Vec3::new(1.0, 0.99, 0.97) * tint,
            replaces: false,
            strength: draw.between(0.4, 1.0),
        },
        size: draw.log(0.01, 0.06),
        tall: if upright { draw.log(3.0, 25.0) } else { draw.log(0.5, 2.0) },
        from: draw.between(-0.3, 0.2),
        border: draw.log(0.2, 0.8),
    })
}

fn moss(draw: &mut Dice) -> Mark {
    let black = draw.chance(0.5);
    Mark::Patches(Patches {
        cover: Cover {
            matter: Matter::Dirt,
            colour: if black { Vec3::new(0.06, 0.06, 0.05) } else { Vec3::new(0.09, 0.12, 0.04) },
            replaces: true,
            strength: draw.between(0.4, 0.9),
        },
        size: draw.log(0.02, 0.25),
        tall: draw.log(0.7, 2.0),
        from: draw.between(0.15, 0.4),
        border: draw.log(0.05, 0.3),
    })
}

fn salt() -> Cover {
    Cover {
        matter: Matter::Efflorescence,
        colour: Vec3::new(0.82, 0.81, 0.78),
        replaces: true,
        strength: 0.85,
    }
}

fn iron(draw: &mut Dice) -> Cover {
    Cover {
        matter: Matter::Rust,
        colour: Vec3::new(draw.between(0.2, 0.4), draw.between(0.08, 0.15), 0.03),
        replaces: true,
        strength: draw.between(0.5, 0.95),
    }
}

fn rust_patches(draw: &mut Dice) -> Mark {
    Mark::Patches(Patches {
        cover: iron(draw),
        size: draw.log(0.05, 0.3),
        tall: draw.log(0.6, 3.0),
        from: draw.between(0.1, 0.35),
        border: draw.log(0.25, 0.8),
    })
}

fn salt_patches(draw: &mut Dice) -> Mark {
    Mark::Patches(Patches {
        cover: salt(),
        size: draw.log(0.02, 0.12),
        tall: draw.log(1.0, 6.0),
        from: draw.between(0.1, 0.35),
        border: draw.log(0.4, 1.2),
    })
}

fn runs(draw: &mut Dice, cover: Cover, spacing: f32, width: f32, length: f32, share: f32) -> Mark {
    let scale = draw.log(0.6, 1.6);
    Mark::Runs(Runs {
        cover,
        spacing: spacing * scale,
        width: width * scale,
        length: length * draw.log(0.5, 2.0),
        share,
    })
}

fn strokes(draw: &mut Dice) -> Mark {
    let size = draw.log(0.03, 0.4);
    let dark = draw.chance(0.5);
    let hue = Vec3::new(draw.between(0.2, 1.0), draw.between(0.2, 1.0), draw.between(0.2, 1.0));
    Mark::Strokes(Strokes {
        size,
        width: size * draw.between(0.05, 0.16),
        share: draw.between(0.1, 0.4),
        colour: if dark { Vec3::splat(0.05) } else { 0.8 * hue },
        strength: draw.between(0.5, 1.0),
        straight: false,
    })
}

fn scratches(draw: &mut Dice) -> Mark {
    Mark::Strokes(Strokes {
        size: draw.log(0.05, 0.5),
        width: draw.log(0.5e-3, 3e-3),
        share: draw.between(0.1, 0.5),
        colour: Vec3::splat(if draw.chance(0.7) { 0.65 } else { 0.08 }),
        strength: draw.between(0.3, 0.9),
        straight: true,
    })
}

/// Many small bug-holes.
fn pinholes(draw: &mut Dice, pixel: f32) -> Relief {
    Relief::Pores(Pores { largest: pixel * draw.log(1.5, 5.0), share: draw.between(0.3, 0.95) })
}

/// Grains that stand out, from sand to rendered pebbles.
fn coarse(draw: &mut Dice, pixel: f32) -> Relief {
    let size = pixel * draw.log(4.0, 40.0);
    Relief::Rough(Rough {
        size: Vec2::splat(size),
        octaves: 5,
        gain: draw.between(0.55, 0.85),
        amplitude: size * draw.log(0.01, 0.1),
        dark: draw.between(0.0, 0.6),
    })
}

/// Seams of narrow boards or strips, dark and hardly ever broken.
fn seams(draw: &mut Dice, pixel: f32) -> Relief {
    let (near, far) = (pixel * draw.log(30.0, 250.0), pixel * draw.log(150.0, 1000.0));
    Relief::Joints(Joints {
        panel: if draw.chance(0.75) { vec2(near, far) } else { vec2(far, near) },
        // Half of one that is two pixels wide is left to see.
        width: pixel * draw.log(1.6, 6.0),
        depth: pixel * draw.between(-0.3, 0.6),
        tone: draw.between(0.0, 0.2),
        dark: draw.between(0.3, 0.97),
    })
}

/// Round covers and plugs with a dark rim.
fn covers(draw: &mut Dice, pixel: f32) -> Relief {
    let radius = pixel * draw.log(6.0, 50.0);
    let spacing = radius * draw.between(4.0, 12.0);
    Relief::Holes(Holes {
        spacing: vec2(spacing, spacing * draw.between(0.7, 1.5)),
        radius,
        depth: radius * draw.log(0.02, 0.15),
        tone: draw.between(0.75, 1.2),
    })
}

/// Small sharp spots of dirt, drawn out along the face.
fn specks(draw: &mut Dice, pixel: f32) -> Mark {
    Mark::Patches(Patches {
        cover: Cover {
            matter: Matter::Dirt,
            colour: Vec3::new(0.6, 0.58, 0.55) * draw.log(0.3, 1.2),
            replaces: false,
            strength: draw.between(0.4, 1.0),
        },
        size: pixel * draw.log(4.0, 40.0),
        tall: draw.log(0.5, 5.0),
        from: draw.between(0.1, 0.5),
        border: draw.log(0.02, 0.15),
    })
}

/// What a single drop left on its way down.
fn thin_runs(draw: &mut Dice, pixel: f32) -> Mark {
    let dark = draw.chance(0.7);
    let cover = Cover {
        matter: Matter::Dirt,
        colour: Vec3::new(1.0, 0.97, 0.93) * if dark { draw.log(0.2, 0.75) } else { 1.4 },
        replaces: false,
        strength: draw.between(0.4, 1.0),
    };
    let width = pixel * draw.log(2.5, 14.0);
    runs(draw, cover, 9.0 * width, width, pixel * 150.0, 0.5)
}

/// Pencil, chalk, scratches, the edge of a trowel: long, straight or slightly bowed.
fn long_lines(draw: &mut Dice, pixel: f32) -> Mark {
    Mark::Strokes(Strokes {
        size: pixel * draw.log(30.0, 200.0),
        width: pixel * draw.log(0.5, 4.0),
        share: draw.between(0.2, 0.9),
        colour: Vec3::splat(if draw.chance(0.65) { draw.log(0.03, 0.2) } else { 0.7 }),
        strength: draw.between(0.3, 0.95),
        straight: true,
    })
}
