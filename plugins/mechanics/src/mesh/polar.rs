//! Rings and linings in r-θ-z: layers, segments, joints.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::{
    ElementId, Mesh, MeshError, divide,
    generate::{Lattice, ascending},
};

/// Angles that differ by less are one, rad.
const NEAR: f64 = 1e-9;

/// A ring, or a part of one, about the z axis; θ from +x towards +y.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Polar {
    /// From the inside out.
    pub layers: Vec<Layer>,
    /// Radial planes, ascending, rad. If the last is the first + 2π the ring closes on itself.
    /// [`Polar::angles`] makes them.
    pub angles: Vec<f64>,
    /// Planes across the axis, ascending, m.
    pub z: Vec<f64>,
}

/// One layer: inner lining, segments, ground.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Layer {
    /// Its region.
    pub region: String,
    /// Radii of its surfaces and of the element faces between, ascending, m. It begins where the
    /// last layer ends, or further out where there is an interface.
    pub radii: Vec<f64>,
    /// Region of the interface elements between the layer inside and this one; none: grown
    /// together.
    pub interface: Option<String>,
    /// How it is cut into segments.
    pub rings: Option<Rings>,
}

/// How a layer is cut into rings and segments. They become element sets `REGION/R1/S1`, …, counted
/// along z and θ; segment 1 begins at the first joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Rings {
    /// Planes between rings, each one of [`Polar::z`], m. None: one ring.
    pub planes: Vec<f64>,
    /// Angles of the joints of each ring, each one of [`Polar::angles`] (or 2π apart), rad; the
    /// list is repeated for further rings.
    pub joints: Vec<Vec<f64>>,
    /// Region of the interface elements in joints.
    pub joint: String,
    /// Region of the interface elements between rings; none: grown together.
    pub ring_joint: Option<String>,
}

/// Where a layer is cut, by numbers of the lattice.
struct Cuts {
    /// θ planes at which each ring is cut.
    joints: Vec<Vec<usize>>,
    /// Ring of each cell along z.
    ring: Vec<usize>,
    joint: Option<u32>,
    ring_joint: Option<u32>,
}

impl Polar {
    /// Planes from `from` to `to` (rad) through all joints, wherever their angle is counted from,
    /// at most `largest` apart.
    #[must_use]
    pub(crate) fn angles(from: f64, to: f64, joints: &[f64], largest: f64) -> Vec<f64> {
        let cuts: Vec<f64> = joints.iter().map(|a| from + (a - from).rem_euclid(TAU)).collect();
        divide(from, to, &cuts, largest)
    }

    /// The mesh. Its sides are the sets `inner`, `outer`, `z0`, `z1`, and `t0`, `t1` where the ring
    /// does not close.
    ///
    /// # Errors
    /// No layer, radii or planes that do not ascend, a gap without interface, layers that overlap,
    /// a joint that is no plane of the mesh, more than a full turn, elements spanning too wide an
    /// angle.
    pub(crate) fn build(&self) -> Result<Mesh, MeshError> {
        let (radii, layer_of) = self.radii()?;
        ascending("z", &self.z)?;
        ascending("angles", &self.angles)?;
        let turn = self.angles[self.angles.len() - 1] - self.angles[0];
        if turn > TAU + NEAR {
            return Err(MeshError::whole(format!(
                "angles span {turn} rad, more than a full turn; are they in degrees?"
            )));
        }
        let closed = turn >= TAU - NEAR;
        let cells = [radii.len() - 1, self.angles.len() - 1, self.z.len() - 1];
        if closed && cells[1] < 3 {
            return Err(MeshError::whole("a closed ring needs at least three elements around"));
        }
        let sides = ["inner", "outer", "t0", "t1", "z0", "z1"];
        let regions = self.layers.iter().map(|l| l.region.clone()).collect();
        let lattice = Lattice { cells, closed, sides, regions };
        let point = |i: usize, j: usize, k: usize| at(radii[i], self.angles[j], self.z[k]);
        let (mut mesh, places) = lattice.build(point, |i, _, _| Some(layer_of[i] as u32))?;
        // Layers of the same name are one region.
        let names = std::mem::take(&mut mesh.regions);
        let numbers: Vec<u32> = names.iter().map(|n| mesh.region(n)).collect();
        mesh.hexes.iter_mut().for_each(|h| h.region = numbers[h.region as usize]);

        let cuts = self
            .layers
            .iter()
            .map(|l| self.cuts(l, &mut mesh, closed))
            .collect::<Result<Vec<_>, _>>()?;
        let between: Vec<Option<u32>> = self
            .layers
            .iter()
            .map(|l| l.interface.as_ref().map(|name| mesh.region(name)))
            .collect();
        mesh.separate(|_, [a, b]| {
            let ([i, j, k], [other_i, other_j, other_k]) =
                (places[a.hex as usize], places[b.hex as usize]);
            let (inside, outside) = (layer_of[i.min(other_i)], layer_of[i.max(other_i)]);
            if inside != outside {
                return between[outside];
            }
            let cuts = &cuts[inside];
            if k != other_k {
                return cuts.ring_joint.filter(|_| cuts.ring[k] != cuts.ring[other_k]);
            }
            // The plane between j and the next cell is j + 1; between the last and the first cell
            // of a closed ring it is 0.
            let plane = if j.abs_diff(other_j) > 1 { 0 } else { j.max(other_j) };
            cuts.joint.filter(|_| i == other_i && cuts.joints[cuts.ring[k]].contains(&plane))
        });
        self.open_gaps(&mut mesh, &places, &layer_of);
        self.name_segments(&mut mesh, &places, &layer_of, &cuts);
        mesh.check()?;
        Ok(mesh)
    }

    /// Radii of the lattice (those of the inner layer where two meet) and the layer of each cell.
    fn radii(&self) -> Result<(Vec<f64>, Vec<usize>), MeshError> {
        let mut radii: Vec<f64> = Vec::new();
        let mut layer_of = Vec::new();
        for (l, layer) in self.layers.iter().enumerate() {
            ascending(&format!("radii of {}", layer.region), &layer.radii)?;
            let first = layer.radii[0];
            match radii.last() {
                None if first > 0.0 => radii.push(first),
                None => {
                    return Err(MeshError::whole(format!(
                        "{}: an inner radius of {first} m; a ring needs one above 0 (a full disc is a section)",
                        layer.region
                    )));
                }
                Some(&end) => {
                    let gap = first - end;
                    if gap < -1e-9 * end || (gap > 1e-9 * end && layer.interface.is_none()) {
                        return Err(MeshError::whole(format!(
                            "{} begins at {first} m, but the layer inside ends at {end} m: let it begin there, \
                             or name an interface for the gap",
                            layer.region
                        )));
                    }
                }
            }
            radii.extend(&layer.radii[1..]);
            layer_of.extend(std::iter::repeat_n(l, layer.radii.len() - 1));
        }
        if radii.is_empty() {
            Err(MeshError::whole("a ring without layers; give at least one"))
        } else {
            Ok((radii, layer_of))
        }
    }

    fn cuts(&self, layer: &Layer, mesh: &mut Mesh, closed: bool) -> Result<Cuts, MeshError> {
        let none = Rings::default();
        let rings = layer.rings.as_ref().unwrap_or(&none);
        let reach = self.z[self.z.len() - 1] - self.z[0];
        if let Some(plane) =
            rings.planes.iter().find(|p| !self.z.iter().any(|z| (z - **p).abs() <= 1e-9 * reach))
        {
            return Err(MeshError::whole(format!(
                "{}: rings meet at z = {plane} m, which is no plane of the mesh; give it to divide as a cut",
                layer.region
            )));
        }
        let ring: Vec<usize> = self
            .z
            .windows(2)
            .map(|z| rings.planes.iter().filter(|p| **p < 0.5 * (z[0] + z[1])).count())
            .collect();
        let last = self.angles.len() - 1;
        let plane_at = |angle: f64| {
            let found = self
                .angles
                .iter()
                .position(|a| ((a - angle + PI).rem_euclid(TAU) - PI).abs() <= 1e-7);
            found.map(|j| if closed && j == last { 0 } else { j }).ok_or_else(|| {
                let degrees = angle.to_degrees();
                MeshError::whole(format!(
                    "{}: a joint at {degrees}° is no radial plane of the mesh; give it to Polar::angles",
                    layer.region
                ))
            })
        };
        let joints = (0..=rings.planes.len())
            .map(|r| {
                let Some(angles) =
                    r.checked_rem(rings.joints.len()).and_then(|r| rings.joints.get(r))
                else {
                    return Ok(Vec::new());
                };
                angles.iter().map(|&a| plane_at(a)).collect()
            })
            .collect::<Result<Vec<Vec<usize>>, _>>()?;
        let joint = (!rings.joints.is_empty()).then(|| mesh.region(&rings.joint));
        Ok(Cuts {
            joints,
            ring,
            joint,
            ring_joint: rings.ring_joint.as_ref().map(|name| mesh.region(name)),
        })
    }

    /// Moves the inner surface of layers outward to where they begin.
    fn open_gaps(&self, mesh: &mut Mesh, places: &[[usize; 3]], layer_of: &[usize]) {
        for (hex, &[i, j, k]) in places.iter().enumerate() {
            let layer = layer_of[i];
            if i == 0 || layer_of[i - 1] == layer || self.layers[layer].interface.is_none() {
                continue;
            }
            let radius = self.layers[layer].radii[0];
            for (corner, (j, k)) in
                [(0, (j, k)), (3, (j + 1, k)), (4, (j, k + 1)), (7, (j + 1, k + 1))]
            {
                let node = mesh.hexes[hex].nodes[corner] as usize;
                // A closed ring ends where it began, to the last bit.
                let first = mesh.nodes[node].truncate();
                let moved = at(radius, self.angles[j], self.z[k]);
                if (first.length() - radius).abs() > 1e-12 * radius {
                    mesh.nodes[node] = moved;
                }
            }
        }
    }

    fn name_segments(
        &self,
        mesh: &mut Mesh,
        places: &[[usize; 3]],
        layer_of: &[usize],
        cuts: &[Cuts],
    ) {
        for (hex, &[i, j, k]) in (0u32..).zip(places) {
            let layer = &self.layers[layer_of[i]];
            let Some(rings) = &layer.rings else { continue };
            let ring = cuts[layer_of[i]].ring[k];
            let joints = ring
                .checked_rem(rings.joints.len())
                .and_then(|r| rings.joints.get(r))
                .map_or(&[][..], Vec::as_slice);
            let first = joints.first().copied().unwrap_or(0.0);
            let past = |angle: f64| (angle - first + NEAR).rem_euclid(TAU);
            let middle = past(0.5 * (self.angles[j] + self.angles[j + 1]));
            let segment = joints.iter().filter(|&&a| past(a) <= middle).count().max(1);
            let name = format!("{}/R{}/S{segment}", layer.region, ring + 1);
            mesh.element_sets.entry(name).or_default().push(ElementId::Hex(hex));
        }
    }
}

impl Mesh {}

fn at(radius: f64, angle: f64, z: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    DVec3::new(radius * cos, radius * sin, z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(region: &str, radii: &[f64]) -> Layer {
        Layer { region: region.into(), radii: radii.to_vec(), ..Layer::default() }
    }

    /// Volume between regular polygons of `n` sides.
    fn polygonal(n: f64, inner: f64, outer: f64, length: f64) -> f64 {
        0.5 * n * (TAU / n).sin() * (outer * outer - inner * inner) * length
    }

    #[test]
    fn a_closed_ring_closes() {
        let ring = Polar {
            layers: vec![layer("lining", &[2.75, 3.0, 3.2])],
            angles: Polar::angles(0.0, TAU, &[], TAU / 24.0),
            z: vec![0.0, 0.5, 1.0],
        };
        let mesh = ring.build().unwrap();
        assert_eq!((mesh.hexes.len(), mesh.nodes.len()), (2 * 24 * 2, 3 * 24 * 3));
        assert!((mesh.volume() - polygonal(24.0, 2.75, 3.2, 1.0)).abs() < 1e-12);
        assert_eq!(mesh.outer_faces().len(), 2 * 24 * 2 + 2 * 24 * 2);
        for (set, radius) in [("inner", 2.75), ("outer", 3.2)] {
            assert_eq!(mesh.face_sets[set].len(), 48);
            assert!(
                mesh.node_sets[set]
                    .iter()
                    .all(|&n| (mesh.nodes[n as usize].truncate().length() - radius).abs() < 1e-14),
                "{set}"
            );
        }
        assert!(!mesh.face_sets.contains_key("t0"));
        let (middle, normal) = mesh.face_middle(mesh.face_sets["inner"][5]);
        assert!(middle.truncate().dot(normal.truncate()) < 0.0);
    }

    #[test]
    fn a_quarter_is_open() {
        let mesh = Polar {
            layers: vec![layer("c", &[1.0, 2.0])],
            angles: Polar::angles(0.0, PI / 2.0, &[], 0.1),
            z: vec![0.0, 1.0],
        }
        .build()
        .unwrap();
        assert!(mesh.node_sets["t0"].iter().all(|&n| mesh.nodes[n as usize].y.abs() < 1e-15));
        assert!(mesh.node_sets["t1"].iter().all(|&n| mesh.nodes[n as usize].x.abs() < 1e-15));
    }

    fn tunnel(gap: f64) -> Polar {
        let joints = |shift: f64| {
            (0..6).map(|s| (10.0 + shift + 60.0 * f64::from(s)).to_radians()).collect::<Vec<_>>()
        };
        let rings = Rings {
            planes: vec![2.0, 4.0],
            joints: vec![joints(0.0), joints(30.0)],
            joint: "joint".into(),
            ring_joint: Some("ring".into()),
        };
        let both: Vec<f64> = rings.joints.concat();
        Polar {
            layers: vec![
                layer("inner", &[2.75, 2.975, 3.2]),
                Layer {
                    interface: Some("cushion".into()),
                    rings: Some(rings),
                    ..layer("segments", &[3.2 + gap, 3.55 + gap])
                },
                Layer {
                    interface: Some("ground joint".into()),
                    ..layer("ground", &[3.55 + gap, 5.0, 9.0, 18.0])
                },
            ],
            angles: Polar::angles(0.0, TAU, &both, 10f64.to_radians()),
            z: divide(0.0, 6.0, &[2.0, 4.0], 1.0),
        }
    }

    #[test]
    fn a_segmental_lining_comes_apart_where_it_should() {
        for gap in [0.0, 0.005] {
            let mesh = tunnel(gap).build().unwrap();
            let n = tunnel(gap).angles.len() - 1;
            assert_eq!(n, 36);
            // Inner lining, three rings of six segments, ground.
            assert_eq!(mesh.bodies().1, 1 + 18 + 1);
            let count = |region: &str| {
                let r = mesh.regions.iter().position(|x| x == region).unwrap() as u32;
                mesh.interfaces.iter().filter(|i| i.region == r).count()
            };
            assert_eq!(
                [count("cushion"), count("ground joint"), count("joint"), count("ring")],
                [36 * 6, 36 * 6, 6 * 6, 2 * 36]
            );
            let turn = 36.0;
            let expected = polygonal(turn, 2.75, 3.2, 6.0) + polygonal(turn, 3.2 + gap, 18.0, 6.0);
            assert!((mesh.volume() - expected).abs() < 1e-9, "{} {expected}", mesh.volume());
            // Every interface has its normal from first to last face, and is as thick as the gap
            // where it is the cushion.
            let cushion = mesh.regions.iter().position(|x| x == "cushion").unwrap() as u32;
            for joint in &mesh.interfaces {
                let p = joint.nodes.map(|m| mesh.nodes[m as usize]);
                let expected = if joint.region == cushion { gap } else { 0.0 };
                for m in 0..4 {
                    assert!((p[m].distance(p[m + 4]) - expected).abs() < 1e-14);
                    assert_ne!(joint.nodes[m], joint.nodes[m + 4]);
                }
                if joint.region == cushion {
                    let normal = (p[2] - p[0]).cross(p[3] - p[1]);
                    assert!(normal.dot(p[0] + p[2]) > 0.0);
                }
            }
            assert_eq!(mesh.element_sets.len(), 18);
            assert_eq!(mesh.element_sets["segments/R1/S1"].len(), 6 * 2);
            // Segment 1 of ring 1 begins at 10°, of ring 2 at 40°.
            for (set, from) in
                [("segments/R1/S1", 10.0), ("segments/R2/S1", 40.0), ("segments/R3/S6", 310.0)]
            {
                for &id in &mesh.element_sets[set] {
                    let ElementId::Hex(h) = id else { panic!() };
                    let c = mesh.centre(h);
                    let past = (c.y.atan2(c.x).to_degrees() - from).rem_euclid(360.0);
                    assert!(past < 60.0, "{set}: {past}");
                }
            }
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let bad = |change: fn(&mut Polar)| {
            let mut polar = tunnel(0.005);
            change(&mut polar);
            polar.build().unwrap_err().reason
        };
        assert!(bad(|p| p.layers[1].interface = None).contains("name an interface for the gap"));
        assert!(bad(|p| p.layers[0].radii[0] = 0.0).contains("above 0"));
        assert!(bad(|p| p.layers.clear()).contains("without layers"));
        assert!(
            bad(|p| p.angles.iter_mut().for_each(|a| *a = a.to_degrees())).contains("in degrees")
        );
        assert!(bad(|p| p.z = vec![0.0, 6.0]).contains("no plane of the mesh"));
        assert!(bad(|p| p.angles = Polar::angles(0.0, TAU, &[], 1.0)).contains("no radial plane"));
        assert!(bad(|p| p.layers[2].radii[0] = 3.3).contains("begins at"));
    }
}
