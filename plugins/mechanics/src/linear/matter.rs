//! Materials, their axes and sections, and the axes of nodes.

use glam::DVec3;
use nalgebra::Matrix3;

use super::{
    law::{Elastic, Expansion, Table},
    model::{Material, Orientation},
    read::{Kind, Reader, Section, plain},
    shape::Shape,
    thin::{Form, Profile, Thin},
};
use crate::{
    read::{
        Amplitude, Fault,
        abaqus::card::{Card, Row},
        quote,
    },
    tensor::Frame,
};

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
                self.deck.materials.push(Material { name, ..Material::default() });
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
        let units = self.units;
        let Some(material) = self.deck.materials.last_mut() else { return Ok(()) };
        let kind = card.word("TYPE").unwrap_or_default();
        match name {
            "ELASTIC" => {
                card.only(&["TYPE"])?;
                material.elastic = Some(elastic(card, &kind, &numbers, units.stress())?);
            }
            "EXPANSION" => {
                card.only(&["TYPE", "ZERO"])?;
                let zero = card.get("ZERO").map_or(Ok(0.0), |z| {
                    z.parse().map_err(|_| card.fault(format!("ZERO={}: a temperature", quote(z))))
                })?;
                let table = along_axes(card, &kind, &numbers)?;
                material.expansion = Some(Expansion { table, zero });
            }
            "DENSITY" => {
                card.only(&[])?;
                let table = table::<1>(card, &numbers)?;
                if let Some(rho) = table.rows().flatten().find(|r| !r.is_finite() || **r < 0.0) {
                    return Err(card.fault(format!("density must not be below 0, not {rho}")));
                }
                material.density = Some(table.scaled(units.density()));
            }
            "CONDUCTIVITY" => {
                card.only(&["TYPE"])?;
                // W/(m·K) is N/(s·K), whatever the unit of length.
                let table = along_axes(card, &kind, &numbers)?;
                if let Some(k) = table.rows().flatten().find(|k| !k.is_finite() || **k <= 0.0) {
                    return Err(card.fault(format!("conductivity must be above 0, not {k}")));
                }
                material.conductivity = Some(table);
            }
            _ => {
                card.only(&[])?;
                let table = table::<1>(card, &numbers)?;
                material.specific_heat = Some(table.scaled(units.specific_heat()));
            }
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
        match plain(card).as_str() {
            "SOLIDSECTION" => self.solid_section(card),
            "SHELLSECTION" => self.shell_section(card),
            "BEAMSECTION" | "BEAMGENERALSECTION" => self.beam_section(card),
            "NORMAL" => self.normal(card),
            _ => Ok(()),
        }
    }

    fn solid_section(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ELSET", "MATERIAL", "ORIENTATION", "OFFSET"])?;
        if card.get("OFFSET").is_some_and(|o| o.parse::<f64>() != Ok(0.0)) {
            return Err(card.fault("*SOLID SECTION: only OFFSET=0 is supported"));
        }
        let thickness = all_numbers(card)?.first().copied().unwrap_or(1.0) * self.units.length();
        let section = Section {
            material: self.named_material(card, &card.need("MATERIAL")?)?,
            orientation: self.named_orientation(card)?,
            thickness,
            profile: Profile::Whole,
        };
        let fits = |kind: Kind| !matches!(kind, Kind::Thin(_));
        let set = self.named_elements(card)?;
        let is_bar = |e: &u32| self.raw[*e as usize].kind == Kind::Solid(Shape::Bar);
        if set.iter().any(is_bar) && all_numbers(card)?.first().copied().unwrap_or(0.0) <= 0.0 {
            return Err(card.fault("bars need the area of their section, above 0"));
        }
        self.assign(card, &section, fits)
    }

    /// Gives a set of elements what they are made of.
    fn assign(
        &mut self,
        card: &Card<'_>,
        section: &Section,
        fits: impl Fn(Kind) -> bool,
    ) -> Result<(), Fault> {
        for element in self.named_elements(card)? {
            let raw = &mut self.raw[element as usize];
            if !fits(raw.kind) {
                return Err(card.fault(format!(
                    "*{} says nothing of element {}, which is of another kind",
                    card.name, raw.label
                )));
            }
            raw.section = Some(section.clone());
        }
        Ok(())
    }

    fn named_material(&self, card: &Card<'_>, name: &str) -> Result<u32, Fault> {
        let undefined = || card.fault(format!("material {} is not defined", quote(name)));
        self.materials.get(&name.to_ascii_uppercase()).copied().ok_or_else(undefined)
    }

    fn named_orientation(&self, card: &Card<'_>) -> Result<Option<u32>, Fault> {
        let Some(name) = super::mesh::name_of(card, "ORIENTATION")? else { return Ok(None) };
        self.axes_of(card, &name).map(Some)
    }

    fn axes_of(&self, card: &Card<'_>, name: &str) -> Result<u32, Fault> {
        let undefined = || card.fault(format!("orientation {} is not defined", quote(name)));
        self.orientations.get(&name.to_ascii_uppercase()).copied().ok_or_else(undefined)
    }

    fn shell_section(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ELSET", "MATERIAL", "ORIENTATION", "OFFSET"])?;
        let offset = match card.word("OFFSET").as_deref() {
            None => 0.0,
            Some("SPOS") => -0.5,
            Some("SNEG") => 0.5,
            Some(word) => {
                let found = word.parse().ok().filter(|o: &f64| o.is_finite());
                found.ok_or_else(|| card.fault("OFFSET is a number, SPOS or SNEG"))?
            }
        };
        let row =
            card.one_row()?.ok_or_else(|| card.fault("*SHELL SECTION needs its thickness"))?;
        let thickness = row.number(row.fields().next().unwrap_or_default())? * self.units.length();
        if thickness.is_nan() || thickness <= 0.0 {
            return Err(row.fault("a thickness must be above 0"));
        }
        let section = Section {
            material: self.named_material(card, &card.need("MATERIAL")?)?,
            orientation: self.named_orientation(card)?,
            thickness,
            profile: Profile::Shell { offset },
        };
        self.assign(card, &section, |kind| matches!(kind, Kind::Thin(Thin::Shell { .. })))
    }

    fn beam_section(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ELSET", "MATERIAL", "SECTION", "OFFSET1", "OFFSET2"])?;
        let mut offset = [0.0; 2];
        for (offset, name) in offset.iter_mut().zip(["OFFSET1", "OFFSET2"]) {
            let Some(word) = card.get(name) else { continue };
            let found = word.parse().ok().filter(|o: &f64| o.is_finite());
            *offset = found.ok_or_else(|| card.fault(format!("{name} is a number")))?;
        }
        let mut rows = card.rows();
        let sizes = rows.next().ok_or_else(|| card.fault("needed are: sizes of the section"))?;
        let length = self.units.length();
        let sizes: Vec<f64> = sizes.numbers("sizes", 1..=8)?.iter().map(|s| s * length).collect();
        if sizes.iter().any(|s| s.is_nan() || *s <= 0.0) {
            return Err(card.fault("sizes of a section must be above 0"));
        }
        let first = match rows.next() {
            Some(row) => DVec3::from_slice(&row.numbers("x, y, z of the 1-direction", 3..=3)?),
            None => DVec3::NEG_Z,
        };
        let (size, form) = match (card.word("SECTION").as_deref(), sizes.as_slice()) {
            (Some("RECT"), &[a, b]) => ([a, b], Form::Full),
            (Some("RECT"), &[a]) => ([a, a], Form::Full),
            (Some("CIRC"), &[a, b]) => ([a, b], Form::Round),
            (Some("CIRC"), &[a]) => ([a, a], Form::Round),
            (Some("PIPE"), &[radius, wall]) if wall < radius => {
                ([2.0 * radius; 2], Form::Pipe(wall))
            }
            (Some("BOX"), &[a, b, w]) if 2.0 * w < a.min(b) => ([a, b], Form::Box([w; 4])),
            (Some("BOX"), &[a, b, t1, t2, t3, t4]) if t1 + t3 < a && t2 + t4 < b => {
                ([a, b], Form::Box([t1, t2, t3, t4]))
            }
            _ => {
                return Err(card.fault(
                    "sections are RECT and CIRC (two sizes), PIPE (outer radius, wall) and BOX (two sizes, one wall or four)",
                ));
            }
        };
        let section = Section {
            material: self.named_material(card, &card.need("MATERIAL")?)?,
            orientation: None,
            thickness: size[0],
            profile: Profile::Beam { first, size, offset, form },
        };
        self.assign(card, &section, |kind| match kind {
            Kind::Thin(Thin::Beam { shape, .. }) => match form {
                Form::Full => true,
                Form::Round => shape != Shape::Hex8Bubbles,
                Form::Pipe(_) | Form::Box(_) => shape == Shape::Hex20Reduced,
            },
            _ => false,
        })
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

/// Rows of N numbers by temperature.
fn table<const N: usize>(card: &Card<'_>, numbers: &[f64]) -> Result<Table<N>, Fault> {
    Table::of(numbers).ok_or_else(|| {
        card.fault(format!(
            "*{}: {} numbers, where {N} by row are needed, each row with its temperature, ascending",
            card.name,
            numbers.len()
        ))
    })
}

/// One constant for all axes, or one for each.
fn along_axes(card: &Card<'_>, kind: &str, numbers: &[f64]) -> Result<Table<3>, Fault> {
    match kind {
        "" | "ISO" | "ISOTROPIC" => table::<1>(card, numbers)?.map(|&[a]| Ok([a; 3])),
        "ORTHO" | "ORTHOTROPIC" => table::<3>(card, numbers),
        other => {
            let other = quote(other);
            Err(card.fault(format!("*{}, TYPE={other}: ISO and ORTHO are supported", card.name)))
        }
    }
}

/// Hooke's law along the axes of a material.
fn elastic(card: &Card<'_>, kind: &str, numbers: &[f64], unit: f64) -> Result<Elastic, Fault> {
    let law = match kind {
        "" | "ISO" | "ISOTROPIC" => {
            let in_range = |&[young, poisson]: &[f64; 2]| {
                if young > 0.0 && poisson > -1.0 && poisson < 0.5 {
                    return Ok([unit * young, poisson]);
                }
                Err(card.fault(
                    "Young's modulus must be above 0 and Poisson's ratio above −1 and below 0.5",
                ))
            };
            Elastic::Isotropic(table::<2>(card, numbers)?.map(in_range)?)
        }
        "ORTHO" | "ORTHOTROPIC" => Elastic::Orthotropic(table::<9>(card, numbers)?.scaled(unit)),
        "ENGINEERING CONSTANTS" | "ENGINEERINGCONSTANTS" => {
            let constants = table::<9>(card, numbers)?.map(|row| engineering(card, row))?;
            Elastic::Orthotropic(constants.scaled(unit))
        }
        "ANISO" | "ANISOTROPIC" => Elastic::Anisotropic(table::<21>(card, numbers)?.scaled(unit)),
        other => {
            let other = quote(other);
            return Err(card.fault(format!(
                "*ELASTIC, TYPE={other}: ISO, ORTHO, ANISO and ENGINEERING CONSTANTS are supported"
            )));
        }
    };
    // What bears no shear is a fluid: whether a structure of it can move, its equations say.
    let resists = |law: [[f64; 6]; 6]| {
        if !law.iter().flatten().all(|value| value.is_finite()) {
            return false;
        }
        let all = nalgebra::Matrix6::from_fn(|i, j| law[i][j]).symmetric_eigenvalues();
        all.min() >= -1e-9 * all.max().abs()
    };
    let all = law.all().into_iter().all(resists);
    all.then_some(law).ok_or_else(|| card.fault("*ELASTIC: this law gives way to some strain"))
}

/// E₁, E₂, E₃, ν₁₂, ν₁₃, ν₂₃, G₁₂, G₁₃, G₂₃ to the constants of [`Elastic::Orthotropic`].
fn engineering(card: &Card<'_>, n: &[f64; 9]) -> Result<[f64; 9], Fault> {
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
pub(super) fn six(card: &Card<'_>) -> Result<[DVec3; 2], Fault> {
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
