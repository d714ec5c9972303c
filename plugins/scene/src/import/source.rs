//! What was found in a file, before anything is decided: elements with what is said of them.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use serde::Deserialize;
use serde_json::Value;

use crate::{Frame, MemberKind, Part};

/// A model as its file tells it. World right-handed, y up, m.
#[derive(Debug, Clone, Default)]
pub(super) struct Source {
    /// What was read, and by what.
    pub(super) format: String,
    pub(super) is_ifc: bool,
    /// Name of the project.
    pub(super) project: String,
    /// When it was built.
    pub(super) year: Option<i32>,
    pub(super) elements: Vec<Element>,
    /// Of the file's unit of length.
    pub(super) metres_per_unit: f64,
    /// What a user should know.
    pub(super) notes: Vec<String>,
    /// What its reader took off all coordinates, m.
    pub(super) moved: DVec3,
    pub(super) georeference: Georeference,
}

/// Where the model's origin lies on earth, as far as its file says so.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct Georeference {
    pub(super) map: Option<MapConversion>,
    /// Degrees.
    pub(super) latitude: Option<f64>,
    pub(super) longitude: Option<f64>,
    /// m.
    pub(super) elevation: Option<f64>,
}

/// IfcMapConversion: as its file says it, in m once it is resolved.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub(super) struct MapConversion {
    /// Name of the coordinate reference system, as of EPSG.
    #[serde(default)]
    pub(super) crs: String,
    pub(super) eastings: f64,
    pub(super) northings: f64,
    #[serde(default)]
    pub(super) height: f64,
    /// Direction of the model's x axis on the map.
    #[serde(default)]
    pub(super) abscissa: Option<f64>,
    #[serde(default)]
    pub(super) ordinate: Option<f64>,
    /// From units of the project to those of the map; of the map alone once it is resolved.
    #[serde(default)]
    pub(super) scale: Option<f64>,
    /// Of the map, where it has a unit of its own.
    #[serde(default)]
    pub(super) metres_per_unit: Option<f64>,
}

/// One element of the file.
#[derive(Debug, Clone, Default)]
pub(super) struct Element {
    /// GlobalId, or the node's name.
    pub(super) id: String,
    /// IFC class; empty where the format knows none.
    pub(super) class: String,
    pub(super) predefined: String,
    pub(super) name: String,
    /// Words that may tell what it is: its type's name, its object type.
    pub(super) words: Vec<String>,
    /// What it is part of, the nearest first.
    pub(super) above: Vec<Above>,
    pub(super) properties: Properties,
    pub(super) materials: Vec<Matter>,
    pub(super) attributes: BTreeMap<String, Value>,
    pub(super) courses: Vec<Course>,
    pub(super) surface: Surface,
    /// Linear Rec. 709.
    pub(super) colour: Option<Vec3>,
    /// What the model itself says (`extras.intrados`), which is not asked again.
    pub(super) said: Option<Said>,
    /// What is said where its file has its body more than once.
    pub(super) twice: Option<String>,
    /// Objects of the model that the surface came from, where there is one.
    pub(super) objects: Vec<usize>,
}

/// Property sets: set, property, value.
pub(super) type Properties = BTreeMap<String, BTreeMap<String, Value>>;

/// What a model says in our own words.
#[derive(Debug, Clone)]
pub(super) struct Said {
    pub(super) kind: MemberKind,
    pub(super) part: Part,
    pub(super) concrete: Option<String>,
    pub(super) frame: Option<Frame>,
    /// Id of the member that it is part of.
    pub(super) member: String,
}

/// What an element is part of.
#[derive(Debug, Clone, Default, Deserialize)]
pub(super) struct Above {
    pub(super) class: String,
    pub(super) name: String,
    pub(super) id: String,
}

/// A material.
#[derive(Debug, Clone, Default, Deserialize)]
pub(super) struct Matter {
    pub(super) name: String,
    #[serde(default)]
    pub(super) category: String,
    #[serde(default)]
    pub(super) properties: Properties,
}

/// The axis of a bar or tendon.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course {
    /// m.
    pub(super) diameter: f64,
    /// m; closed ones end where they begin.
    pub(super) line: Vec<DVec3>,
}

/// Triangles in the world.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Surface {
    /// m.
    pub(super) points: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Surface {
    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Corners of a triangle; zeros where an index leads nowhere.
    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| self.points.get(i as usize).copied().unwrap_or_default())
    }

    pub(super) fn faces(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.triangles.iter().map(|&t| self.corners(t))
    }

    /// Volume enclosed, by the divergence theorem about a point of its own, m³.
    pub(super) fn volume(&self) -> f64 {
        self.signed_volume().abs()
    }

    /// The same, below zero where faces look inward.
    pub(super) fn signed_volume(&self) -> f64 {
        let origin = self.points.first().copied().unwrap_or_default();
        let sixfold = |[a, b, c]: [DVec3; 3]| (a - origin).dot((b - origin).cross(c - origin));
        self.faces().map(sixfold).sum::<f64>() / 6.0
    }

    /// Corners of its box.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        let used = self.triangles.iter().flatten().filter_map(|&i| self.points.get(i as usize));
        used.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], &p| [l.min(p), h.max(p)])
    }

    /// Extent along a direction.
    pub(super) fn span(&self, along: DVec3) -> [f64; 2] {
        self.faces()
            .flatten()
            .map(|p| p.dot(along))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)])
    }

    /// Whether a point lies within: the solid angle that the surface takes up, seen from there, is
    /// that of the whole sphere (van Oosterom and Strackee, 1983, of each triangle).
    pub(super) fn holds(&self, p: DVec3) -> bool {
        let angle = |corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|q| q - p);
            let (x, y, z) = (a.length(), b.length(), c.length());
            let base = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
            2.0 * a.dot(b.cross(c)).atan2(base)
        };
        self.faces().map(angle).sum::<f64>().abs() > 2.0 * std::f64::consts::PI
    }
}

impl Course {
    pub(super) fn length(&self) -> f64 {
        self.line.windows(2).map(|w| w[0].distance(w[1])).sum()
    }

    /// Points at even distances, about `count` of them.
    pub(super) fn samples(&self, count: usize) -> Vec<DVec3> {
        let (total, mut at, mut points) = (self.length(), 0.0, Vec::with_capacity(count));
        for ends in self.line.windows(2) {
            let length = ends[0].distance(ends[1]);
            while points.len() < count
                && (points.len() as f64 + 0.5) * total <= (at + length) * count as f64
            {
                let along = (points.len() as f64 + 0.5) * total / count as f64 - at;
                points.push(ends[0].lerp(ends[1], along / length.max(1e-12)));
            }
            at += length;
        }
        points
    }
}
