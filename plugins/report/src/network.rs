//! One page of many structures: a map, what to look at first, and all of them, worst first.

use std::{collections::BTreeMap, fmt::Write};

use askama::Template;
use intrados_forecast::span::CANNOT_SAY;

use crate::svg;

const CSS: &str = include_str!("report.css");

/// What is predicted of one span or member.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Item {
    /// Id of the structure that it is of.
    pub structure: String,
    /// What the structure (a span's) or the member is called.
    pub name: String,
    /// The road.
    pub road: String,
    /// Which span or member.
    pub part: String,
    /// What kind that is.
    pub kind: String,
    /// Its state in words.
    pub state: String,
    /// Where to look, or what to do.
    pub look: String,
    /// Why nothing is forecast of it; empty where something is.
    pub not_forecast: String,
    /// Latitude and longitude, degrees.
    pub place: Option<[f64; 2]>,
    /// When it was built.
    pub year: Option<i32>,
    /// Damage and its standard error.
    pub damage: Option<f64>,
    /// The standard error.
    pub std_error: Option<f64>,
    /// What is foretold for now, by the mean of what may be, and for later.
    pub foretold: Option<f64>,
    /// For later.
    pub later: Option<f64>,
    /// Length of the span, m.
    pub length: Option<f64>,
    /// Probability of each state, mildest first; empty where nothing is known.
    pub probability: Vec<f64>,
}

/// What a page shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// Of the program.
    pub version: String,
    /// Names of the states, mildest first.
    pub states: Vec<String>,
    /// Whether all is assumed from a table.
    pub is_assumed: bool,
    /// Years from now to what is foretold for later.
    pub ahead_years: Option<f64>,
    /// What is missing, in a sentence.
    pub missing: Option<String>,
    /// Spans or members in the order of the plan.
    pub items: Vec<Item>,
}

/// Of how many structures more is said.
const FIRST: usize = 25;

/// A structure by its worst part.
struct Structure<'a> {
    worst: &'a Item,
    parts: usize,
    /// Probability that its worst part is in the worse half of the states.
    poor: f64,
    url: String,
}

#[derive(Template)]
#[template(path = "network.html")]
struct Shown<'a> {
    page: &'a Page,
    structures: Vec<Structure<'a>>,
    /// Structures of which something is not forecast, part by part, by why.
    unknown: BTreeMap<&'a str, Vec<&'a str>>,
    parts: usize,
    map: Map,
}

/// Places as dots.
#[derive(Default)]
struct Map {
    svg: String,
    /// Places so far from all others that they are hardly right.
    astray: Vec<String>,
}

/// The page.
///
/// # Errors
/// The template cannot be filled.
pub fn html(page: &Page) -> Result<String, askama::Error> {
    let structures = ranked(page);
    let mut unknown: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for item in page.items.iter().filter(|i| !i.not_forecast.is_empty()) {
        unknown.entry(item.not_forecast.as_str()).or_default().push(item.structure.as_str());
    }
    let shown = Shown {
        page,
        parts: page.items.iter().filter(|i| i.damage.is_some()).count(),
        map: map(&structures),
        unknown,
        structures,
    };
    shown.render()
}

/// Structures by how probable it is that their worst part is poor or worse; what is alike by what
/// is foretold, then by id, so that the order is the same everywhere.
fn ranked(page: &Page) -> Vec<Structure<'_>> {
    let mut by_id: BTreeMap<&str, Structure> = BTreeMap::new();
    let half = page.states.len() / 2;
    for item in page.items.iter().filter(|item| !item.probability.is_empty()) {
        let poor: f64 = item.probability.iter().skip(half).sum();
        let structure = by_id.entry(item.structure.as_str()).or_insert_with(|| Structure {
            worst: item,
            parts: 0,
            poor: f64::NEG_INFINITY,
            url: url(item),
        });
        structure.parts += 1;
        if poor > structure.poor {
            (structure.worst, structure.poor) = (item, poor);
        }
    }
    let mut all: Vec<Structure> = by_id.into_values().collect();
    let later = |s: &Structure| s.worst.later.unwrap_or(0.0);
    all.sort_by(|a, b| b.poor.total_cmp(&a.poor).then(later(b).total_cmp(&later(a))));
    all
}

/// Where a map on the web shows it.
fn url(item: &Item) -> String {
    item.place.map_or_else(String::new, |[latitude, longitude]| {
        format!("https://www.openstreetmap.org/?mlat={latitude}&mlon={longitude}#map=16/{latitude}/{longitude}")
    })
}

/// Where 98 of a hundred values are, and half as much again on either side: one wrong sign in a
/// table of thousands must not make all others one dot.
fn reach(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    let at = |share: f64| values.get((share * last as f64).round() as usize).copied();
    let (low, high) = (at(0.01).unwrap_or(0.0), at(0.99).unwrap_or(0.0));
    let more = 0.5 * (high - low).max(0.02);
    [low - more, high + more]
}

/// Places as dots, the worst on top: a degree of longitude is as long as at the middle latitude.
fn map(structures: &[Structure<'_>]) -> Map {
    let all: Vec<([f64; 2], &Structure)> =
        structures.iter().filter_map(|s| Some((s.worst.place?, s))).collect();
    let reaches = [0, 1].map(|k| reach(all.iter().map(|(place, _)| place[k]).collect()));
    let is_near = |place: &[f64; 2]| {
        place.iter().zip(&reaches).all(|(x, [low, high])| (low..=high).contains(&x))
    };
    let (places, astray): (Vec<_>, Vec<_>) = all.into_iter().partition(|(p, _)| is_near(p));
    let astray = astray.iter().map(|(_, s)| s.worst.structure.clone()).collect();
    if places.len() < 2 {
        return Map { svg: String::new(), astray };
    }
    let range = |k: usize| {
        let values = places.iter().map(|(place, _)| place[k]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
    };
    let ([south, north], [west, east]) = (range(0), range(1));
    let narrow = (0.5 * (south + north)).to_radians().cos().max(0.05);
    let wide = ((east - west) * narrow).max(1e-4);
    let high = (north - south).max(1e-4);
    let width = 920.0;
    let scale = (width - 20.0) / wide;
    let height = (high * scale).min(900.0) + 20.0;
    let scale = scale.min((height - 20.0) / high);
    let mut svg = svg::head("plot map", [width, height], "Map of the structures");
    let _ = write!(svg, "<rect width=\"{width}\" height=\"{height:.0}\" fill=\"#f5f7f9\"/>");
    // Colours over the range that occurs, so that differences are seen; the legend says it.
    let [low, high] = poor_range(structures);
    for ([latitude, longitude], s) in places.iter().rev() {
        let x = 10.0 + (longitude - west) * narrow * scale;
        let y = 10.0 + (north - latitude) * scale;
        let share = (s.poor - low) / (high - low).max(1e-9);
        let c = colorous::CIVIDIS.eval_continuous(1.0 - share.clamp(0.0, 1.0));
        let _ = write!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\" fill=\"#{c:x}\" stroke=\"#1c2430\" stroke-width=\".3\"><title>{}</title></circle>",
            2.0 + 2.5 * share.clamp(0.0, 1.0),
            escaped(&format!(
                "{} {}: poor or worse {:.0} %",
                s.worst.structure,
                s.worst.name,
                100.0 * s.poor
            ))
        );
    }
    Map { svg: svg + "</svg>", astray }
}

/// The least and the most that a structure is probably poor.
fn poor_range(structures: &[Structure<'_>]) -> [f64; 2] {
    structures
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], s| [lo.min(s.poor), hi.max(s.poor)])
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

impl Shown<'_> {
    fn range(&self) -> [f64; 2] {
        poor_range(&self.structures)
    }

    fn percent(&self, share: &f64) -> String {
        format!("{:.0} %", 100.0 * share)
    }

    fn share(&self, value: &Option<f64>) -> String {
        value.map_or_else(|| "-".into(), |x| format!("{x:.2}"))
    }

    fn built(&self, year: &Option<i32>) -> String {
        year.map_or_else(|| "-".into(), |year| year.to_string())
    }

    /// Structures by their ids, each once, the first of many.
    fn named(&self, parts: &[&str]) -> String {
        let mut ids = parts.to_vec();
        ids.dedup();
        let more = if ids.len() > FIRST { ", …" } else { "" };
        ids.truncate(FIRST);
        ids.join(", ") + more
    }

    fn first(&self) -> &[Structure<'_>] {
        &self.structures[..self.structures.len().min(FIRST)]
    }

    fn years(&self) -> String {
        self.page.ahead_years.map_or_else(String::new, |years| format!("{years:.0}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(structure: &str, poor: f64) -> Item {
        Item {
            structure: structure.into(),
            name: format!("<{structure}>"),
            place: Some([43.0 + poor, -80.0 - poor]),
            damage: Some(0.1),
            probability: vec![1.0 - poor, 0.0, poor, 0.0],
            ..Item::default()
        }
    }

    #[test]
    fn the_worst_part_counts_and_the_worst_structure_comes_first() {
        let states = ["sound", "fair", "poor", "severe"].map(String::from).to_vec();
        let unknown = Item { not_forecast: "no year".into(), ..item("c", 0.0) };
        let unknown = Item { probability: Vec::new(), damage: None, ..unknown };
        let items = vec![item("a", 0.1), item("b", 0.2), item("a", 0.6), unknown];
        let page = Page { states, items, ..Page::default() };
        let ranked = ranked(&page);
        let order: Vec<_> =
            ranked.iter().map(|s| (s.worst.structure.as_str(), s.parts, s.poor)).collect();
        assert_eq!(order, [("a", 2, 0.6), ("b", 1, 0.2)]);
        let text = html(&page).unwrap();
        assert!(text.contains("circle"));
        // Of what nothing is forecast has its name there, too.
        assert!(text.contains("<td>c</td><td>no year</td>"), "{text}");
        // Whatever a table says is text, and no part of the page.
        assert!(!text.contains("<a>") && text.contains("&lt;a&gt;"));
    }

    /// A place with a wrong sign is named and does not shrink the map.
    #[test]
    fn a_place_astray_is_named() {
        let mut items: Vec<Item> =
            (0..200).map(|k| item(&k.to_string(), 0.002 * f64::from(k))).collect();
        items[7].place = Some([43.0, 80.0]);
        let page = Page { items, ..Page::default() };
        let map = map(&ranked(&page));
        assert_eq!((map.astray, map.svg.matches("<circle").count()), (vec!["7".to_owned()], 199));
    }
}
