//! What a scene and its evidence may hold, told from the types that read it: as JSON Schema for editors and scripts,
//! and as a page for people.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

use serde_json::{Map, Value};

use super::{SceneFile, evidence, parse};
use crate::{load::bundled, parametric::template};

/// Longest example that a table holds, characters.
const LONGEST: usize = 60;

/// JSON Schema (draft 2020-12) of a scene. RON writes what it calls objects as `Name(field: …)` or
/// `(field: …)`, and arrays of a fixed length as `(x, y, z)`.
#[must_use]
pub fn schema() -> Value {
    let bare = of_scene();
    let examples = Reference::of_scene(&bare).values;
    exemplified(bare.clone(), "Scene", &examples)
}

fn of_scene() -> Value {
    schemars::schema_for!(SceneFile).to_value()
}

/// JSON Schema of `evidence.ron`, written as that of scenes.
#[must_use]
pub fn evidence_schema() -> Value {
    let bare = of_evidence();
    let examples = Reference::of_evidence(&bare).values;
    exemplified(bare.clone(), "Evidence", &examples)
}

fn of_evidence() -> Value {
    schemars::schema_for!(evidence::EvidenceFile).to_value()
}

/// A schema whose fields have the examples of the page.
fn exemplified(mut schema: Value, whole: &str, examples: &BTreeMap<Field, Value>) -> Value {
    for ((name, variant, field), example) in examples {
        let node = match name == whole {
            true => Some(&mut schema),
            false => schema.get_mut("$defs").and_then(|types| types.get_mut(name)),
        };
        let inside = match (variant.as_str(), node) {
            ("", node) => node,
            (variant, Some(node)) => {
                let variants = node.get_mut("oneOf").and_then(Value::as_array_mut);
                variants
                    .into_iter()
                    .flatten()
                    .find_map(|v| v.get_mut("properties")?.get_mut(variant))
            }
            _ => None,
        };
        let at = inside.and_then(|node| node.get_mut("properties")?.get_mut(field));
        if let Some(at) = at.and_then(Value::as_object_mut) {
            at.insert("examples".to_owned(), Value::Array(vec![example.clone()]));
        }
    }
    schema
}

/// A value with the digits that were meant: scenes hold single precision.
fn meant(value: &Value) -> Value {
    match value {
        Value::Number(number) if !number.is_u64() && !number.is_i64() => {
            let single = number.as_f64().filter(|v| f64::from(*v as f32) == *v);
            let short = single.and_then(|v| (v as f32).to_string().parse::<f64>().ok());
            short.and_then(serde_json::Number::from_f64).map_or(value.clone(), Value::Number)
        }
        Value::Array(items) => items.iter().map(meant).collect(),
        Value::Object(fields) => {
            fields.iter().map(|(name, value)| (name.clone(), meant(value))).collect()
        }
        other => other.clone(),
    }
}

/// The page of every field, Markdown: what it is, its unit, what counts where it is left out, and
/// how a bundled scene or a template writes it.
#[must_use]
pub fn page() -> String {
    let mut page = String::from(
        "# Every field of a scene\n\nMade by `intrados schema --page` from the types that read \
         scenes and evidence; do not edit. Lengths are metres unless a name says otherwise, \
         angles degrees, times days. Examples are from the bundled scenes and templates; `…` \
         stands for the rest. [Evidence](#evidence), `evidence.ron` beside a scene, follows after \
         the scene's own fields.\n",
    );
    let (scene, evidence) = (of_scene(), of_evidence());
    let mut said = BTreeSet::new();
    for reference in [Reference::of_scene(&scene), Reference::of_evidence(&evidence)] {
        for (name, node) in reference.in_order() {
            // What both may hold is said once.
            if said.insert(name.to_owned()) {
                reference.section(&mut page, name, node);
            }
        }
    }
    page
}

/// Values of fields that no bundled scene uses.
const REST: &str = include_str!("example.ron");

/// Where a field is: its type, the variant of it (empty for a struct), its name.
type Field = (String, String, String);

/// A schema, and how examples write its fields.
struct Reference<'a> {
    /// What the whole is called, which the schema does not name.
    whole: &'static str,
    root: &'a Value,
    types: &'a Map<String, Value>,
    examples: BTreeMap<Field, String>,
    /// The same as JSON.
    values: BTreeMap<Field, Value>,
}

impl<'a> Reference<'a> {
    fn of_scene(schema: &'a Value) -> Self {
        let templates = ["column", "beam", "tunnel"].into_iter().filter_map(template);
        let texts = bundled().iter().map(|(_, text)| *text).chain(templates).chain([REST]);
        let scenes =
            texts.filter_map(|t| serde_json::to_value(parse("", t).ok()?).ok()).collect::<Vec<_>>();
        Self::of("Scene", schema, &scenes)
    }

    fn of_evidence(schema: &'a Value) -> Self {
        let example = evidence::parse("", &evidence::examples()).ok();
        let example = example.and_then(|file| serde_json::to_value(file).ok());
        Self::of("Evidence", schema, example.as_slice())
    }

    fn of(whole: &'static str, schema: &'a Value, examples: &[Value]) -> Self {
        static NONE: std::sync::LazyLock<Map<String, Value>> = std::sync::LazyLock::new(Map::new);
        let types = schema.get("$defs").and_then(Value::as_object).unwrap_or(&NONE);
        let mut reference =
            Self { whole, root: schema, types, examples: BTreeMap::new(), values: BTreeMap::new() };
        for example in examples {
            reference.gather(whole, schema, example);
        }
        reference
    }

    /// Types in the order in which a reader meets them, from the scene down.
    fn in_order(&self) -> Vec<(&'a str, &'a Value)> {
        let mut met = BTreeSet::new();
        let mut order = vec![(self.whole, self.root)];
        let mut next = 0;
        while next < order.len() {
            let (_, node) = order[next];
            next += 1;
            let mut names = Vec::new();
            named(node, &mut names);
            for name in names {
                if let Some((name, node)) = self.types.get_key_value(name)
                    && met.insert(name)
                {
                    order.push((name, node));
                }
            }
        }
        order
    }

    /// What a node stands for: a reference's type, an option's inside.
    fn resolved(&self, node: &'a Value) -> (&'a str, &'a Value) {
        if let Some(name) = reference(node) {
            return self.types.get_key_value(name).map_or(("", node), |(n, v)| (n, v));
        }
        let inside = node.get("anyOf").and_then(Value::as_array).and_then(|any| {
            any.iter().find(|n| n.get("type").and_then(Value::as_str) != Some("null"))
        });
        inside.map_or(("", node), |n| self.resolved(n))
    }

    /// Takes examples from a value of the type `name`.
    fn gather(&mut self, name: &str, node: &'a Value, value: &Value) {
        if let Some(items) = value.as_array() {
            let (inner, of) = node.get("items").map_or((name, node), |n| self.resolved(n));
            items.iter().for_each(|item| self.gather(inner, of, item));
            return;
        }
        let Some(object) = value.as_object() else { return };
        let (variant, fields, object) = match variant_of(node, object) {
            Some((variant, inside)) => {
                let Some((_, value)) = object.iter().next() else { return };
                let (inner, of) = self.resolved(inside);
                if !inner.is_empty() || value.as_object().is_none() {
                    return self.gather(inner, of, value);
                }
                let Some(object) = value.as_object() else { return };
                (variant, properties(inside), object)
            }
            None => ("", properties(node), object),
        };
        for (field, at) in fields {
            let Some(value) = object.get(field) else { continue };
            let (inner, of) = self.resolved(at);
            if !says_nothing(value) && at.get("default") != Some(value) {
                let key = (name.to_owned(), variant.to_owned(), field.clone());
                let text = self.ron(at, value);
                self.values.entry(key.clone()).or_insert_with(|| meant(value));
                self.examples.entry(key).or_insert(text);
            }
            self.gather(inner, of, value);
        }
    }

    /// A value as RON writes it.
    fn ron(&self, node: &'a Value, value: &Value) -> String {
        let (_, of) = self.resolved(node);
        match value {
            Value::String(text) if is_word(of, text) => text.clone(),
            Value::Array(items) => {
                let inner = of.get("items").unwrap_or(of);
                let list: Vec<_> = items.iter().map(|item| self.ron(inner, item)).collect();
                let fixed = of.get("maxItems").is_some() || of.get("prefixItems").is_some();
                let [open, close] = if fixed { ["(", ")"] } else { ["[", "]"] };
                format!("{open}{}{close}", list.join(", "))
            }
            Value::Object(object) => match variant_of(of, object) {
                Some((variant, inside)) => {
                    let value = object.values().next().unwrap_or(&Value::Null);
                    let text = self.ron(inside, value);
                    match text.strip_prefix('(') {
                        Some(_) if value.is_object() => format!("{variant}{text}"),
                        _ => format!("{variant}({text})"),
                    }
                }
                None => {
                    let fields = properties(of).into_iter().filter_map(|(name, at)| {
                        let value = object.get(name).filter(|v| !says_nothing(v))?;
                        (at.get("default") != Some(value))
                            .then(|| format!("{name}: {}", self.ron(at, value)))
                    });
                    format!("({})", fields.collect::<Vec<_>>().join(", "))
                }
            },
            // Scenes hold single precision, and a double writes more digits than were meant.
            Value::Number(number) => match number.as_f64() {
                Some(v) if !number.is_u64() && f64::from(v as f32) == v => (v as f32).to_string(),
                _ => number.to_string(),
            },
            other => other.to_string(),
        }
    }

    /// One type: its heading, what it is, and its tables.
    fn section(&self, page: &mut String, name: &str, node: &'a Value) {
        _ = write!(page, "\n## {name}\n\n{}\n", told(node));
        let variants = node.get("oneOf").and_then(Value::as_array);
        let Some(variants) = variants else {
            return self.table(page, name, "", node);
        };
        page.push_str("\nOne of:\n");
        for variant in variants {
            for (word, inside) in words(variant) {
                _ = write!(page, "\n- `{word}`: {}", told(variant));
                let Some(inside) = inside else { continue };
                if properties(inside).is_empty() {
                    _ = write!(page, " (holds {})", self.type_of(inside));
                } else {
                    page.push('\n');
                    self.table(page, name, word, inside);
                }
            }
        }
        page.push('\n');
    }

    /// The fields of a struct, or of one variant.
    fn table(&self, page: &mut String, name: &str, variant: &str, node: &'a Value) {
        let fields = properties(node);
        if fields.is_empty() {
            return;
        }
        page.push_str(
            "\n| field | type | what | unit | left out | example |\n|---|---|---|---|---|---|\n",
        );
        let required: BTreeSet<&str> = node
            .get("required")
            .and_then(Value::as_array)
            .map(|list| list.iter().filter_map(Value::as_str).collect())
            .unwrap_or_default();
        for (field, at) in fields {
            let what = told(at);
            let left_out = match at.get("default") {
                _ if required.contains(field.as_str()) => "must be there".to_owned(),
                None | Some(Value::Null) => "none".to_owned(),
                Some(value) if says_nothing(value) => "none".to_owned(),
                Some(value) => format!("`{}`", shortened(&self.ron(at, value))),
            };
            let key = (name.to_owned(), variant.to_owned(), field.clone());
            let example = self
                .examples
                .get(&key)
                .map_or(String::new(), |text| format!("`{}`", shortened(text).replace('|', "\\|")));
            _ = writeln!(
                page,
                "| `{field}` | {} | {what} | {} | {left_out} | {example} |",
                self.type_of(at),
                unit(field, &what),
            );
        }
    }

    /// The name of a node's type, with a link where it has a section of its own.
    fn type_of(&self, node: &'a Value) -> String {
        let (name, of) = self.resolved(node);
        if !name.is_empty() {
            return format!("[{name}](#{})", name.to_lowercase());
        }
        let kind = match of.get("type") {
            Some(Value::Array(kinds)) => kinds.first(),
            kind => kind,
        };
        match kind.and_then(Value::as_str) {
            Some("array") => match (of.get("items"), of.get("prefixItems")) {
                (_, Some(Value::Array(items))) => {
                    let items: Vec<_> = items.iter().map(|item| self.type_of(item)).collect();
                    format!("({})", items.join(", "))
                }
                (Some(item), _) => match of.get("maxItems").and_then(Value::as_u64) {
                    Some(n) => format!("{n} of {}", self.type_of(item)),
                    None => format!("list of {}", self.type_of(item)),
                },
                _ => "list".to_owned(),
            },
            Some("number") => "number".to_owned(),
            Some("integer") => "whole number".to_owned(),
            Some("string") => "text".to_owned(),
            Some("boolean") => "`true`, `false`".to_owned(),
            _ => "see there".to_owned(),
        }
    }
}

/// The type that a node refers to.
fn reference(node: &Value) -> Option<&str> {
    node.get("$ref").and_then(Value::as_str)?.strip_prefix("#/$defs/")
}

/// All types that a node speaks of, in its order.
fn named<'a>(node: &'a Value, names: &mut Vec<&'a str>) {
    names.extend(reference(node));
    match node {
        Value::Array(items) => items.iter().for_each(|item| named(item, names)),
        Value::Object(object) => {
            object.iter().filter(|(k, _)| *k != "$defs").for_each(|(_, v)| named(v, names));
        }
        _ => {}
    }
}

fn properties(node: &Value) -> Vec<(&String, &Value)> {
    node.get("properties").and_then(Value::as_object).map_or(Vec::new(), |p| p.iter().collect())
}

/// The words of one entry of a choice, each with what it holds.
fn words(variant: &Value) -> Vec<(&str, Option<&Value>)> {
    if let Some(word) = variant.get("const").and_then(Value::as_str) {
        return vec![(word, None)];
    }
    if let Some(list) = variant.get("enum").and_then(Value::as_array) {
        return list.iter().filter_map(Value::as_str).map(|word| (word, None)).collect();
    }
    properties(variant).into_iter().map(|(word, inside)| (word.as_str(), Some(inside))).collect()
}

/// The variant of a choice that an object of one field is.
fn variant_of<'a>(node: &'a Value, object: &Map<String, Value>) -> Option<(&'a str, &'a Value)> {
    let (key, _) = object.iter().next().filter(|_| object.len() == 1)?;
    let variants = node.get("oneOf").and_then(Value::as_array)?;
    variants
        .iter()
        .flat_map(words)
        .find_map(|(word, inside)| inside.filter(|_| word == key).map(|inside| (word, inside)))
}

/// Whether a text is one of the words of a choice.
fn is_word(node: &Value, text: &str) -> bool {
    let variants = node.get("oneOf").and_then(Value::as_array);
    variants.is_some_and(|all| all.iter().flat_map(words).any(|(word, _)| word == text))
        || words(node).iter().any(|(word, inside)| inside.is_none() && *word == text)
}

fn says_nothing(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::String(text) => text.is_empty(),
        Value::Array(items) => items.is_empty(),
        _ => false,
    }
}

/// What the documentation of a type or field says, on one line, without the links of Rust.
fn told(node: &Value) -> String {
    let text = node.get("description").and_then(Value::as_str).unwrap_or_default();
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    text.replace("[`", "`").replace("`]", "`").replace('|', "\\|")
}

/// The unit of a field: what its name ends in, or what its description gives after a comma.
fn unit(field: &str, what: &str) -> &'static str {
    const ENDINGS: [(&str, &str); 40] = [
        ("_1e6_k", "1e-6/K"),
        ("_kn_m3", "kN/m³"),
        ("_kj_kg", "kJ/kg"),
        ("_ua_cm2", "µA/cm²"),
        ("_k", "K"),
        ("_n_m", "N/m"),
        ("_kn_m2", "kN/m²"),
        ("_kn_m", "kN/m"),
        ("_kn", "kN"),
        ("_mpa_m", "MPa/m"),
        ("_mpa", "MPa"),
        ("_gpa", "GPa"),
        ("_kpa", "kPa"),
        ("_kg_m3", "kg/m³"),
        ("_kg_m2", "kg/m²"),
        ("_j_kg", "J/kg"),
        ("_mm2", "mm²"),
        ("mm", "mm"),
        ("_um", "µm"),
        ("_m2_s", "m²/s"),
        ("m_s", "m/s"),
        ("_m2", "m²"),
        ("mv", "mV"),
        ("mpa", "MPa"),
        ("percent_of_cement", "%"),
        ("percent_of_concrete", "%"),
        ("_m", "m"),
        ("_deg", "°"),
        ("_days", "d"),
        ("_day", "d"),
        ("_hours", "h"),
        ("_years", "a"),
        ("years", "a"),
        ("days", "d"),
        ("_kv", "kV"),
        ("_kev", "keV"),
        ("_mas", "mA·s"),
        ("_percent", "%"),
        ("_celsius", "°C"),
        ("_c", "°C"),
    ];
    const SPOKEN: [(&str, &str); 12] = [
        ("Metres", "m"),
        ("W·m⁻²·sr⁻¹", "W/(m²·sr)"),
        ("W·m⁻²", "W/m²"),
        (" W/sr", "W/sr"),
        (" lm", "lm"),
        (", mm", "mm"),
        (", m²/s", "m²/s"),
        (", m.", "m"),
        (", m;", "m"),
        (", °C", "°C"),
        (" degrees", "°"),
        ("0 to 1", "1"),
    ];
    let ends = ENDINGS.iter().find(|(end, _)| field.ends_with(end));
    let says = || SPOKEN.iter().find(|(words, _)| what.contains(words));
    ends.or_else(says).map_or("", |(_, unit)| unit)
}

fn shortened(text: &str) -> String {
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    text.chars().take(LONGEST).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A field that nobody could look up would be a field that nobody uses.
    #[test]
    fn every_field_is_said_what_it_is() {
        let (scene, evidence) = (schema(), evidence_schema());
        let silent = |node: &Value| {
            let fields = properties(node);
            let none = fields.iter().filter(|(_, at)| told(at).is_empty());
            none.map(|(name, _)| (*name).clone()).collect::<Vec<_>>()
        };
        let all = [Reference::of_scene(&scene), Reference::of_evidence(&evidence)];
        for (name, node) in all.iter().flat_map(Reference::in_order) {
            let variants = node.get("oneOf").and_then(Value::as_array);
            let inside = variants.into_iter().flatten().flat_map(words).filter_map(|(_, n)| n);
            let missing: Vec<_> = inside.chain([node]).flat_map(silent).collect();
            assert!(missing.is_empty(), "{name}: {missing:?}");
        }
    }

    #[test]
    fn what_no_bundled_scene_uses_has_an_example_that_can_be_read() {
        parse("", REST).unwrap();
        let page = page();
        let bare: Vec<&str> = page.lines().filter(|l| l.ends_with("|  |")).collect();
        assert!(bare.iter().all(|l| l.starts_with("| `face` |")), "{bare:?}");
    }

    #[test]
    fn the_page_says_unit_default_and_example() {
        let page = page();
        let line = |of: &str| page.lines().find(|l| l.contains(of)).unwrap_or_default().to_owned();
        let cover = line("| `cover_mm` |");
        assert!(cover.contains("| mm |") && cover.contains("must be there"), "{cover}");
        assert!(line("| `readings` |").contains("list of [Reading](#reading)"), "{page}");
        // Of a map, which comes first, and of a model.
        let mut scales = page.lines().filter(|l| l.contains("| `scale` |"));
        assert!(scales.any(|scale| scale.contains("`(1, 1, 1)`")), "{page}");
        let section = line("| `section` |");
        assert!(section.contains("Rectangle(depth_m: "), "{section}");
    }

    /// Editors show them; a list of a type is no field of it.
    #[test]
    fn the_schema_has_the_examples_of_the_page() {
        let (scene, evidence) = (schema(), evidence_schema());
        let of = |schema: &Value, path: &str| {
            schema.pointer(path).and_then(|p| p["examples"].get(0)).cloned().unwrap_or_default()
        };
        assert_eq!(of(&evidence, "/$defs/Record/properties/date"), "2026-05-03");
        let cover = evidence["$defs"]["Finding"]["oneOf"].as_array().unwrap();
        let crack = cover.iter().find(|v| v["properties"].get("Crack").is_some()).unwrap();
        let width = &crack["properties"]["Crack"]["properties"]["width_mm"]["examples"][0];
        assert_eq!(*width, 0.3);
        assert!(of(&scene, "/properties/title").is_string(), "{scene}");
        let fields = scene.to_string().matches("\"examples\"").count();
        assert!(fields > 200, "{fields}");
    }

    /// A number without a unit says what it counts; a length, a force, an angle says its unit.
    #[test]
    fn numbers_have_units() {
        for (field, unit_of_it) in [
            ("height_m", "m"),
            ("cover_mm", "mm"),
            ("force_kn_m", "kN/m"),
            ("expansion_1e6_k", "1e-6/K"),
            ("pressure_kpa", "kPa"),
            ("fov_deg", "°"),
        ] {
            assert_eq!(unit(field, ""), unit_of_it);
        }
    }
}
