//! Where a model lies on earth: units of maps, scales, and coordinates that nobody gave.

use super::source::{Georeference, MapConversion};

/// Map coordinates are no larger, m: zones before Gauss-Krüger and UTM eastings make 34 million.
const LARGEST: f64 = 1e8;
/// Eastings and northings of a projected system are rarely both smaller, m.
const SMALLEST: f64 = 2e4;
/// Sites lie no further above or below the sea, m.
const HIGHEST: f64 = 1e4;
/// How far a map's scale may lie from 1: 4 ‰ at the edge of a zone, some more high up.
const GRID: std::ops::RangeInclusive<f64> = 0.99..=1.01;
/// So near to a default, a place is the default, degrees.
const NEAR: f64 = 0.02;

/// Places that authoring tools write where their user gave none: latitude, longitude.
const DEFAULTS: [(f64, f64, &str); 3] = [
    (42.4148, -71.2581, "Waltham near Boston, which Revit writes"),
    (42.3587, -71.0567, "Boston, which Revit writes"),
    (42.3584, -71.0598, "Boston, which Revit writes"),
];

/// Lengths in m, what cannot be is left out; what is doubtful is added to `notes`. `scale`: metres
/// per unit of the project.
pub(super) fn resolve(mut told: Georeference, scale: f64, notes: &mut Vec<String>) -> Georeference {
    if let Some(map) = &mut told.map {
        in_metres(map, scale, notes);
    }
    if told.map.as_ref().is_some_and(|m| !is_on_earth(m)) {
        told.map = None;
        notes.push("its map coordinates are no place on earth: left out".into());
    }
    if let Some(elevation) = told.elevation.filter(|e| e.is_nan() || e.abs() > HIGHEST) {
        told.elevation = None;
        notes.push(format!("the site is said to be {elevation} m high: left out"));
    }
    notes.extend(misplaced(&mut told));
    told
}

/// A map conversion has the unit of its map, else that of the project (IfcProjectedCRS.MapUnit).
fn in_metres(map: &mut MapConversion, scale: f64, notes: &mut Vec<String>) {
    let unit = map.metres_per_unit.unwrap_or(scale);
    let size = map.eastings.abs().max(map.northings.abs());
    let fits = |metres: f64| (SMALLEST..LARGEST).contains(&(size * metres));
    let other = [1.0, 1e-3].into_iter().find(|&m| fits(m) && !(0.1..10.0).contains(&(m / unit)));
    // Small numbers may be what they say where the system is one's own, which has no number.
    let is_small = unit < 1.0 && map.crs.contains(|c: char| c.is_ascii_digit());
    let meant = match other.filter(|_| !fits(unit)) {
        Some(metres) if is_small || size * unit >= LARGEST => {
            notes.push(format!(
                "its map coordinates ({} E, {} N) would be {:.3} E, {:.3} N m in the unit that the file says: they are taken as {}; give IfcProjectedCRS.MapUnit, or mend georeference in scene.ron",
                map.eastings,
                map.northings,
                map.eastings * unit,
                map.northings * unit,
                if metres < 1.0 { "millimetres" } else { "metres" }
            ));
            metres
        }
        _ => unit,
    };
    // The height has the unit of the others.
    for length in [&mut map.eastings, &mut map.northings, &mut map.height] {
        *length *= meant;
    }
    // Scale converts from units of the project to those of the map; what is left is the grid's own.
    let said = map.scale.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0);
    let own = said * unit / scale;
    map.scale = [own, said].into_iter().find(|s| GRID.contains(s));
    if map.scale.is_none() {
        notes.push(format!(
            "its map conversion says Scale {said}, which would make the structure {own} times as large on the map: the scale is taken as 1"
        ));
    }
}

/// Whether its numbers can be a place.
fn is_on_earth(map: &MapConversion) -> bool {
    let sizes = [map.eastings, map.northings, map.height];
    let turn = [map.abscissa.unwrap_or(1.0), map.ordinate.unwrap_or(0.0)];
    let length = turn[0].hypot(turn[1]);
    sizes.iter().all(|x| x.abs() < LARGEST) && length.is_finite() && length > 0.0
}

/// What is doubtful of latitude and longitude; what cannot be is taken out.
fn misplaced(told: &mut Georeference) -> Option<String> {
    let (latitude, longitude) = (told.latitude?, told.longitude?);
    let at = words(latitude, longitude);
    if latitude.abs() > 90.0 || longitude.abs() > 180.0 {
        (told.latitude, told.longitude) = (None, None);
        return Some(format!("the site is said to be at {at}, which is no place: left out"));
    }
    let remedy = "give the site's own in the model, or in georeference of scene.ron";
    let is_near = |a: f64, b: f64| (latitude - a).abs() < NEAR && (longitude - b).abs() < NEAR;
    if let Some((.., who)) = DEFAULTS.iter().find(|(a, b, _)| is_near(*a, *b)) {
        return Some(format!(
            "the site is said to be at {at}: that is {who} where nobody gave a place; is it there? {remedy}"
        ));
    }
    if latitude == 0.0 && longitude == 0.0 {
        (told.latitude, told.longitude) = (None, None);
        return Some(format!(
            "the site is said to be at 0° N, 0° E, in the sea off Africa: nobody gave a place, and it is left out; {remedy}"
        ));
    }
    if let Some((a, b)) = told.map.as_ref().and_then(of_utm)
        && ((latitude - a).abs() > 0.5 || (longitude - b).abs() > 4.0)
    {
        return Some(format!(
            "the site is said to be at {at}, and its map coordinates lie near {}: one of them is wrong or a default; {remedy}",
            words(a, b)
        ));
    }
    if latitude.fract() == 0.0 && longitude.fract() == 0.0 {
        return Some(format!(
            "the site is said to be at {at}, whole degrees as tools write them where nobody gave a place; is it there? {remedy}"
        ));
    }
    None
}

/// A place as people write it.
pub(super) fn words(latitude: f64, longitude: f64) -> String {
    let [north, east] =
        [(latitude, ["N", "S"]), (longitude, ["E", "W"])].map(|(at, [more, less])| {
            format!("{:.6}° {}", at.abs(), if at < 0.0 { less } else { more })
        });
    format!("{north}, {east}")
}

/// Latitude and middle longitude of the zone, where the map is of UTM: to half a degree and a zone.
fn of_utm(map: &MapConversion) -> Option<(f64, f64)> {
    let code: u32 = map.crs.rsplit(':').next()?.trim().parse().ok()?;
    let (zone, is_south) = match code {
        25_828..=25_838 => (code - 25_800, false),
        23_028..=23_038 => (code - 23_000, false),
        32_601..=32_660 => (code - 32_600, false),
        32_701..=32_760 => (code - 32_700, true),
        _ => return None,
    };
    // A degree of the meridian is 110.6 to 111.7 km.
    let north = if is_south { map.northings - 1e7 } else { map.northings };
    Some((north / 0.9996 / 111_150.0, 6.0 * f64::from(zone) - 183.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(eastings: f64, northings: f64, unit: Option<f64>, scale: Option<f64>) -> MapConversion {
        MapConversion {
            crs: "EPSG:25832".into(),
            eastings,
            northings,
            height: 12.5,
            metres_per_unit: unit,
            scale,
            ..MapConversion::default()
        }
    }

    /// Hamburg in every unit and scale that files say it in.
    #[test]
    fn a_map_is_in_metres_whatever_the_project_is_in() {
        let (e, n) = (564_321.5, 5_934_567.25);
        let cases = [
            (map(e, n, None, None), 1.0, 0),
            (map(1e3 * e, 1e3 * n, None, None), 1e-3, 0),
            (map(e, n, Some(1.0), Some(1e-3)), 1e-3, 0),
            // As exporters write it: the scale is forgotten, or 1.
            (map(e, n, Some(1.0), None), 1e-3, 0),
            (map(e, n, Some(1.0), Some(1.0)), 1e-3, 0),
            (map(1e3 * e, 1e3 * n, Some(1e-3), Some(1.0)), 1e-3, 0),
            (map(e / 0.3048, n / 0.3048, None, None), 0.3048, 0),
            // Metres in a file of millimetres, which says no unit of the map.
            (map(e, n, None, None), 1e-3, 1),
            (map(1e3 * e, 1e3 * n, None, None), 1.0, 1),
            (map(e, n, Some(1.0), Some(0.5)), 1.0, 1),
        ];
        for (map, scale, count) in cases {
            let mut notes = Vec::new();
            let told = Georeference { map: Some(map.clone()), ..Georeference::default() };
            let found = resolve(told, scale, &mut notes).map.unwrap();
            assert!((found.eastings - e).abs() < 1e-3, "{map:?} {found:?}");
            assert!((found.northings - n).abs() < 1e-3, "{map:?} {found:?}");
            assert_eq!(found.scale, (count == 0 || map.scale.is_none()).then_some(1.0), "{map:?}");
            assert_eq!(notes.len(), count, "{notes:?}");
        }
        let mut notes = Vec::new();
        let grid = Georeference {
            map: Some(map(e, n, Some(1.0), Some(0.9996e-3))),
            ..Georeference::default()
        };
        let found = resolve(grid, 1e-3, &mut notes).map.unwrap().scale.unwrap();
        assert!((found - 0.9996).abs() < 1e-9 && notes.is_empty(), "{found} {notes:?}");
        let local = Georeference { map: Some(map(150.0, 80.0, None, None)), ..Default::default() };
        assert!((resolve(local, 1.0, &mut notes).map.unwrap().eastings - 150.0).abs() < 1e-9);
        assert!(notes.is_empty(), "{notes:?}");
    }

    #[test]
    fn places_that_nobody_gave_are_doubted() {
        let of = |latitude: f64, longitude: f64, map: Option<MapConversion>| {
            let mut notes = Vec::new();
            let (latitude, longitude) = (Some(latitude), Some(longitude));
            resolve(Georeference { map, latitude, longitude, elevation: None }, 1.0, &mut notes);
            notes.join("\n")
        };
        let hamburg = || Some(map(564_321.5, 5_934_567.25, None, None));
        assert!(of(42.414_863, -71.258_065, None).contains("Waltham near Boston"));
        assert!(of(42.358_717, -71.056_74, None).contains("Revit"));
        assert!(of(0.0, 0.0, None).contains("off Africa"));
        assert!(of(48.0, 11.0, None).contains("whole degrees"));
        assert!(of(91.0, 11.5, None).contains("no place"));
        assert!(of(48.137, 11.575, hamburg()).contains("53.4"));
        // Ordinary ones: Karlsruhe, Santiago, Hamburg with its map.
        assert_eq!(of(49.100_435, 8.436_539, None), "");
        assert_eq!(of(-33.858_472, -70.65, None), "");
        assert_eq!(of(53.55, 9.97, hamburg()), "");
        assert_eq!(words(-33.5, -70.25), "33.500000° S, 70.250000° W");
    }
}
