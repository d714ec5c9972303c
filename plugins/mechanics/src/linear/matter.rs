//! Materials, their axes and sections, and the axes of nodes.

use glam::DVec3;
use nalgebra::Matrix3;

use super::{
    model::{Material, Orientation},
    read::{Kind, Reader, Section, plain},
};
use crate::{
    read::{
        Amplitude, Fault,
        abaqus::card::{Card, Row},
        quote,
    },
    tensor::{self, Frame, Tangent},
};

/// Abaqus' order 11, 22, 33, 12, 13, 23 in ours.
pub(super) const ORDER: [usize; 6] = [0, 1, 2, 3, 5, 4];

impl Reader {
    /// Materials, orientations, transforms and amplitudes.
    pub(super) fn material(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        let name = plain(card);
        let in_material = std::mem::replace(&mut self.in_material, false);
        match name.as_str() {
            "MATERIAL" => {
                card.only(&["NAME"])?;
                let name = card.need("NAME")?;
                self.materials.insert(name.clone(), self.deck.materials.len() as u32);
                self.deck.materials.push(Material {
                    name,
                    stiffness: [[0.0; 6]; 6],
                    expansion: [0.0; 3],
                    density: 0.0,
                });
                self.in_material = true;
                Ok(())
            }
            "ELASTIC" | "DENSITY" | "EXPANSION" | "CONDUCTIVITY" | "SPECIFICHEAT" => {
                if !in_material {
                    return Err(card.fault(format!("*{} must stand under a *MATERIAL", card.name)));
                }
                self.in_material = true;
                self.property(card, &name)
            }
            "ORIENTATION" => self.orientation(card),
            "TRANSFORM" => self.transform(card),
            "AMPLITUDE" => self.amplitude(card),
            _ => Ok(()),
        }
    }

    fn property(&mut self, card: &Card<'_>, name: &str) -> Result<(), Fault> {
        let numbers = all_numbers(card)?;
        let stress = self.units.stress();
        let index = self.deck.materials.len() as u32 - 1;
        let Some(material) = self.deck.materials.last_mut() else { return Ok(()) };
        let kind = card.word("TYPE").unwrap_or_default();
        match name {
            "ELASTIC" => {
                card.only(&["TYPE"])?;
                let law = elastic(card, &kind, &numbers)?;
                material.stiffness = law.map(|row| row.map(|v| v * stress));
                self.elastic.insert(index);
            }
            "EXPANSION" => {
                card.only(&["TYPE", "ZERO"])?;
                material.expansion = match (kind.as_str(), counted(card, &numbers, &[1, 3])?) {
                    ("" | "ISO" | "ISOTROPIC", [a]) => [*a; 3],
                    ("ORTHO" | "ORTHOTROPIC", [a, b, c]) => [*a, *b, *c],
                    _ => return Err(card.fault("*EXPANSION: ISO has one number, ORTHO three")),
                };
            }
            "DENSITY" => {
                card.only(&[])?;
                let [density] = counted(card, &numbers, &[1])? else { return Ok(()) };
                if !density.is_finite() || *density < 0.0 {
                    return Err(card.fault(format!("density must not be below 0, not {density}")));
                }
                material.density = density * self.units.density();
            }
            // Heat flows nowhere in a static step.
            _ => {}
        }
        Ok(())
    }

    fn orientation(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NAME", "SYSTEM", "DEFINITION"])?;
        if card.word("DEFINITION").is_some_and(|d| d != "COORDINATES") {
            return Err(card.fault("*ORIENTATION: only DEFINITION=COORDINATES is supported"));
        }
        let points = six(card)?;
        let orientation = match card.word("SYSTEM").as_deref() {
            None | Some("RECTANGULAR") => Orientation::Straight(straight(card, points)?),
            Some("CYLINDRICAL") => self.around(card, points)?,
            Some(other) => {
                let other = quote(other);
                return Err(card
                    .fault(format!("SYSTEM={other}: RECTANGULAR and CYLINDRICAL are supported")));
            }
        };
        self.orientations.insert(card.need("NAME")?, self.deck.orientations.len() as u32);
        self.deck.orientations.push(orientation);
        Ok(())
    }

    /// Axes about the line through two points.
    fn around(&self, card: &Card<'_>, [a, b]: [DVec3; 2]) -> Result<Orientation, Fault> {
        let axis = (b - a)
            .try_normalize()
            .ok_or_else(|| card.fault("both points of the axis are the same"))?;
        let origin = (self.units.length() * a).to_array();
        Ok(Orientation::Around { origin, axis: axis.to_array() })
    }

    /// Nodes whose supports and forces have axes of their own.
    fn transform(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NSET", "TYPE"])?;
        let points = six(card)?;
        let axes = match card.word("TYPE").as_deref() {
            None | Some("R") => Orientation::Straight(straight(card, points)?),
            Some("C") => self.around(card, points)?,
            Some(other) => {
                let other = quote(other);
                return Err(card.fault(format!("TYPE={other}: R and C are supported")));
            }
        };
        let set = card.need("NSET")?;
        let nodes = self.node_sets.get(&set);
        let nodes =
            nodes.ok_or_else(|| card.fault(format!("node set {} is not defined", quote(&set))))?;
        for &node in nodes {
            self.deck.turned.insert(node, axes.frame(self.deck.nodes[node as usize]));
        }
        Ok(())
    }

    fn amplitude(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NAME", "TIME"])?;
        let total_time = match card.word("TIME").as_deref() {
            None | Some("STEP TIME" | "STEPTIME") => false,
            Some("TOTAL TIME" | "TOTALTIME") => true,
            Some(other) => {
                let other = quote(other);
                return Err(
                    card.fault(format!("TIME={other}: STEP TIME and TOTAL TIME are supported"))
                );
            }
        };
        let numbers = all_numbers(card)?;
        let (pairs, rest) = numbers.as_chunks::<2>();
        if !rest.is_empty() || pairs.is_empty() || !pairs.is_sorted_by(|a, b| a[0] <= b[0]) {
            return Err(
                card.fault("*AMPLITUDE needs: time, factor, time, factor, …, times ascending")
            );
        }
        let points = pairs.iter().map(|&[t, f]| (t, f)).collect();
        let name = card.need("NAME")?;
        self.amplitudes.insert(name.clone(), Amplitude { name, points, total_time });
        Ok(())
    }

    /// What elements are made of.
    pub(super) fn section(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        if plain(card) != "SOLIDSECTION" {
            return Ok(());
        }
        card.only(&["ELSET", "MATERIAL", "ORIENTATION", "OFFSET"])?;
        if card.get("OFFSET").is_some_and(|o| o.parse::<f64>() != Ok(0.0)) {
            return Err(card.fault("*SOLID SECTION: only OFFSET=0 is supported"));
        }
        let (set, material) = (card.need("ELSET")?, card.need("MATERIAL")?);
        let missing =
            |what: &str, name: &str| card.fault(format!("{what} {} is not defined", quote(name)));
        let &material =
            self.materials.get(&material).ok_or_else(|| missing("material", &material))?;
        let orientation = match super::mesh::name_of(card, "ORIENTATION")? {
            None => None,
            Some(name) => {
                Some(*self.orientations.get(&name).ok_or_else(|| missing("orientation", &name))?)
            }
        };
        let thickness = all_numbers(card)?.first().copied().unwrap_or(1.0) * self.units.length();
        let elements = self.element_sets.get(&set).ok_or_else(|| missing("element set", &set))?;
        for &element in elements {
            let raw = &mut self.raw[element as usize];
            if matches!(raw.kind, Kind::Flat(_)) && (thickness.is_nan() || thickness <= 0.0) {
                return Err(card.fault(format!("thickness of {set} must be above 0")));
            }
            raw.section = Some(Section { material, orientation, thickness });
        }
        Ok(())
    }
}

/// All numbers of a card. Fields that are empty are left out.
pub(super) fn all_numbers(card: &Card<'_>) -> Result<Vec<f64>, Fault> {
    let mut all = Vec::new();
    for row in card.rows() {
        for word in row.fields().filter(|w| !w.is_empty()) {
            all.push(row.number(word)?);
        }
    }
    Ok(all)
}

/// The numbers, without the temperature at which they hold where that follows.
fn counted<'a>(card: &Card<'_>, numbers: &'a [f64], counts: &[usize]) -> Result<&'a [f64], Fault> {
    let fits = |&&n: &&usize| numbers.len() == n || numbers.len() == n + 1;
    match counts.iter().find(fits) {
        Some(&n) => Ok(&numbers[..n]),
        None => Err(card.fault(format!(
            "*{}: {} numbers, not {counts:?}; tables over temperature are not supported",
            card.name,
            numbers.len()
        ))),
    }
}

/// Hooke's law along the axes of a material.
fn elastic(card: &Card<'_>, kind: &str, numbers: &[f64]) -> Result<Tangent, Fault> {
    let count = match kind {
        "" | "ISO" | "ISOTROPIC" => 2,
        "ORTHO" | "ORTHOTROPIC" | "ENGINEERING CONSTANTS" | "ENGINEERINGCONSTANTS" => 9,
        "ANISO" | "ANISOTROPIC" => 21,
        other => {
            let other = quote(other);
            return Err(card.fault(format!(
                "*ELASTIC, TYPE={other}: ISO, ORTHO, ANISO and ENGINEERING CONSTANTS are supported"
            )));
        }
    };
    let n = counted(card, numbers, &[count])?;
    let law = match count {
        2 => {
            if !(n[0] > 0.0 && n[1] > -1.0 && n[1] < 0.5) {
                return Err(card.fault(
                    "Young's modulus must be above 0 and Poisson's ratio above −1 and below 0.5",
                ));
            }
            tensor::stiffness(n[0], n[1])
        }
        9 if kind.starts_with("ORTHO") => orthotropic(n),
        9 => orthotropic(&engineering(card, n)?),
        _ => anisotropic(n),
    };
    let positive = nalgebra::Matrix6::from_fn(|i, j| law[i][j]).cholesky().is_some();
    positive.then_some(law).ok_or_else(|| card.fault("*ELASTIC: this law is not positive definite"))
}

/// 1111, 1122, 2222, 1133, 2233, 3333, 1212, 1313, 2323.
fn orthotropic(n: &[f64]) -> Tangent {
    let mut law = [[0.0; 6]; 6];
    for (value, (i, j)) in n.iter().zip([(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]) {
        (law[i][j], law[j][i]) = (*value, *value);
    }
    (law[3][3], law[5][5], law[4][4]) = (n[6], n[7], n[8]);
    law
}

/// The upper triangle, column by column, in Abaqus' order.
fn anisotropic(n: &[f64]) -> Tangent {
    let mut law = [[0.0; 6]; 6];
    let mut values = n.iter();
    for (column, &b) in ORDER.iter().enumerate() {
        for &a in &ORDER[..=column] {
            let value = values.next().copied().unwrap_or(0.0);
            (law[a][b], law[b][a]) = (value, value);
        }
    }
    law
}

/// E₁, E₂, E₃, ν₁₂, ν₁₃, ν₂₃, G₁₂, G₁₃, G₂₃ to the constants of [`orthotropic`].
fn engineering(card: &Card<'_>, n: &[f64]) -> Result<[f64; 9], Fault> {
    let [e1, e2, e3] = [n[0], n[1], n[2]];
    let compliance = Matrix3::new(
        1.0 / e1,
        -n[3] / e1,
        -n[4] / e1,
        -n[3] / e1,
        1.0 / e2,
        -n[5] / e2,
        -n[4] / e1,
        -n[5] / e2,
        1.0 / e3,
    );
    let d = compliance
        .try_inverse()
        .ok_or_else(|| card.fault("*ELASTIC: these constants have no stiffness"))?;
    Ok([d[(0, 0)], d[(0, 1)], d[(1, 1)], d[(0, 2)], d[(1, 2)], d[(2, 2)], n[6], n[7], n[8]])
}

/// Two points.
fn six(card: &Card<'_>) -> Result<[DVec3; 2], Fault> {
    let mut rows = card.rows();
    let what = "two points: x, y, z, x, y, z";
    let row: Row<'_> = rows.next().ok_or_else(|| card.fault(format!("needed are {what}")))?;
    if let Some(more) = rows.next() {
        return Err(more.fault(format!("one line, please: {what}")));
    }
    let n = row.numbers(what, 6..=6)?;
    Ok([DVec3::new(n[0], n[1], n[2]), DVec3::new(n[3], n[4], n[5])])
}

/// Axes of which the first runs through one point, and the second lies in the plane of both.
fn straight(card: &Card<'_>, [a, b]: [DVec3; 2]) -> Result<Frame, Fault> {
    let flat = || card.fault("both points lie on one line through the origin");
    let x = a.try_normalize().ok_or_else(flat)?;
    let z = a.cross(b).try_normalize().ok_or_else(flat)?;
    Ok([x, z.cross(x), z].map(|v| v.to_array()))
}
