//! Where a scene lies on earth, for who puts results back on a model or a map.

use glam::{DVec3, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the scene lies on earth. Lengths in m.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Georeference {
    /// What an import took off the model's coordinates, m: those of the model are those of the
    /// scene (y up) plus this.
    #[serde(default)]
    pub offset_m: [f64; 3],
    /// Where on a map the model's origin lies.
    #[serde(default)]
    pub map: Option<MapOrigin>,
    /// North of the equator, degrees.
    #[serde(default)]
    pub latitude_deg: Option<f64>,
    /// East of Greenwich, degrees.
    #[serde(default)]
    pub longitude_deg: Option<f64>,
    /// Above the sea, m.
    #[serde(default)]
    pub elevation_m: Option<f64>,
}

/// A model's origin on a map, as `IfcMapConversion` tells it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapOrigin {
    /// Coordinate reference system, such as `EPSG:25832`.
    #[serde(default)]
    pub crs: String,
    /// m.
    pub eastings: f64,
    /// m.
    pub northings: f64,
    /// m.
    #[serde(default)]
    pub height: f64,
    /// East and north of the model's x axis, of any length.
    #[serde(default = "east")]
    pub x_axis: [f64; 2],
    /// Metres on the map per metre of the model, as of a projection's scale there.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

fn east() -> [f64; 2] {
    [1.0, 0.0]
}

impl Georeference {
    /// A point of the scene in the coordinates of its model, m, y up.
    #[must_use]
    pub fn in_model(&self, point: Vec3) -> DVec3 {
        point.as_dvec3() + DVec3::from(self.offset_m)
    }

    /// Eastings, northings and height of a point of the scene, m; none where nobody knows.
    ///
    /// ```
    /// use glam::Vec3;
    /// use intrados_scene::structure::{Georeference, MapOrigin};
    ///
    /// // The model's x axis runs north, so that its north (−z here) runs west.
    /// let map = MapOrigin {
    ///     crs: "EPSG:25832".into(),
    ///     eastings: 5e5,
    ///     northings: 5e6,
    ///     height: 100.0,
    ///     x_axis: [0.0, 2.0],
    ///     scale: 1.0,
    /// };
    /// let place = Georeference { map: Some(map), ..Georeference::default() };
    /// let at = place.on_map(Vec3::new(3.0, 2.0, -1.0)).unwrap();
    /// assert_eq!(at, [499_999.0, 5_000_003.0, 102.0]);
    /// ```
    #[must_use]
    pub fn on_map(&self, point: Vec3) -> Option<[f64; 3]> {
        let map = self.map.as_ref()?;
        let at = self.in_model(point);
        let length = map.x_axis[0].hypot(map.x_axis[1]);
        let [cos, sin] = map.x_axis.map(|c| map.scale * c / length);
        let (x, y) = (at.x, -at.z);
        Some([
            map.eastings + cos * x - sin * y,
            map.northings + sin * x + cos * y,
            map.height + at.y,
        ])
    }
}
