//! A simple span as a scene, for a life in finite elements: the same section, bars, loads and
//! attack as its section has.

use super::{Kind, Settings, Span};

/// Id of the member.
pub const ID: &str = "span";

/// The scene; why not, of a span that no such scene can stand for.
///
/// # Errors
/// It goes on over supports, or is a deck on girders.
pub fn drawn(span: &Span, settings: Settings) -> Result<String, &'static str> {
    if span.kind == Kind::Deck {
        return Err("lives in finite elements are built of slabs and beams, not of decks");
    }
    if span.continuous {
        return Err("lives in finite elements are built of simple spans");
    }
    let [width, depth] = span.section;
    let one = std::f64::consts::FRAC_PI_4 * span.diameter.powi(2);
    let bars = (span.steel[0] / one).round().max(2.0);
    // As many thicker or thinner bars as bring the very area.
    let diameter = 1e3 * (span.steel[0] / bars * 4.0 / std::f64::consts::PI).sqrt();
    let (cover, years) = (1e3 * span.cover[0], (settings.now - span.attacked[0]).max(0));
    let [surfacing, traffic] = [span.surfacing, span.traffic].map(|q| 1e-3 * q);
    let (length, class) = (span.length, span.class);
    Ok(format!(
        r#"(
    schema: "intrados.scene/1",
    members: [(
        id: "{ID}", name: "A span by rules",
        body: Beam(
            section: Rectangle(width_m: {width:.4}, depth_m: {depth:.4}),
            length_m: {length:.3},
            reinforcement: (cover_mm: {cover:.1}, bars: [Row(side_deg: 180, count: {bars:.0}, diameter_mm: {diameter:.3})]),
        ),
        at: (0, 5, 0),
        concrete: "{class}",
        exposure: (class: "XD1, XC4", years: {years}),
    )],
    supports: [
        (member: "{ID}", place: Surface(from: 0.01, to: 0.01, side_deg: 180), hold: Fixed),
        (member: "{ID}", place: Surface(from: 0.99, to: 0.99, side_deg: 180), hold: Directions(x: false, y: true, z: true)),
    ],
    loads: [
        (name: "self weight", action: SelfWeight, history: [(14, 0), (28, 1)]),
        (name: "surfacing", members: ["{ID}"], action: Line(force_kn_m: (0, -{surfacing:.4}, 0)), history: [(60, 0), (61, 1)]),
        (name: "traffic", members: ["{ID}"], action: Line(force_kn_m: (0, -{traffic:.4}, 0)), history: [(90, 0), (91, 1), (92, 0)]),
    ],
    climate: (humidity_percent: 75, temperature_c: 7),
    grading: (profile: "four_states"),
)
"#
    ))
}
