//! The tables of `assets`, checked and interpolated.

use intrados_assets::xray::{ATTENUATION, FORMS};

use super::PhysicsError;

/// μ/ρ by what happens, m²/kg.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Attenuation {
    /// Photoelectric absorption.
    pub photo: f64,
    /// Incoherent scattering.
    pub compton: f64,
    /// Coherent scattering.
    pub rayleigh: f64,
}

impl Attenuation {
    /// All three.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.photo + self.compton + self.rayleigh
    }

    /// The two that leave a photon.
    #[must_use]
    pub fn scatter(&self) -> f64 {
        self.compton + self.rayleigh
    }
}

/// One material's tables.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// As scenes call it.
    pub name: String,
    /// kg/m³.
    pub density: f64,
    /// Pieces between absorption edges: ln(keV), and ln of the three.
    pieces: Vec<Vec<(f64, [f64; 3])>>,
    /// Scattering functions.
    pub forms: Forms,
}

/// Scattering functions over x = sin(θ/2)/λ, Å⁻¹.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Forms {
    /// Å⁻¹, increasing from 0.
    pub x: Vec<f64>,
    /// S(x)/Z.
    pub incoherent: Vec<f64>,
    /// F²(x)/F²(0).
    pub coherent: Vec<f64>,
}

impl Material {
    /// μ/ρ at `kev`, held constant beyond the table (5–500 keV). Cubic in log-log within the piece
    /// between two edges.
    #[must_use]
    pub fn attenuation(&self, kev: f64) -> Attenuation {
        let x = kev.max(1e-3).ln();
        let piece = self
            .pieces
            .iter()
            .rev()
            .find(|p| p.first().is_some_and(|first| first.0 <= x))
            .or(self.pieces.first());
        let Some(piece) = piece else { return Attenuation::default() };
        let [photo, compton, rayleigh] = cubic(piece, x).map(f64::exp);
        Attenuation { photo, compton, rayleigh }
    }
}

/// Lagrange's cubic through the four points around `x`, fewer where there are fewer.
fn cubic(points: &[(f64, [f64; 3])], x: f64) -> [f64; 3] {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return [0.0; 3] };
    let x = x.clamp(first.0, last.0);
    let right = points.partition_point(|p| p.0 <= x);
    let from = right.saturating_sub(2).min(points.len().saturating_sub(4));
    let stencil = &points[from..(from + 4).min(points.len())];
    let mut sum = [0.0; 3];
    for (i, (xi, y)) in stencil.iter().enumerate() {
        let others = stencil.iter().enumerate().filter(|(j, _)| *j != i);
        let basis: f64 = others.map(|(_, (xj, _))| (x - xj) / (xi - xj)).product();
        (0..3).for_each(|k| sum[k] += basis * y[k]);
    }
    sum
}

/// All materials.
#[derive(Debug, Clone, PartialEq)]
pub struct Library {
    materials: Vec<Material>,
}

impl Library {
    /// The tables that the program carries.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] if they are damaged.
    pub fn builtin() -> Result<Self, PhysicsError> {
        Self::parse(ATTENUATION, FORMS)
    }

    /// Reads both tables.
    fn parse(attenuation: &str, forms: &str) -> Result<Self, PhysicsError> {
        let mut materials: Vec<Material> = Vec::new();
        for row in rows("attenuation.csv", attenuation, 6)? {
            let [density, energy, values @ ..] = row.numbers::<5>()?;
            if density <= 0.0 || energy <= 0.0 || values.iter().any(|v| *v <= 0.0) {
                return Err(row.wrong("a value that is not positive"));
            }
            if materials.last().is_none_or(|m| m.name != row.name) {
                let name = row.name.to_owned();
                materials.push(Material {
                    name,
                    density,
                    pieces: vec![Vec::new()],
                    forms: Forms::default(),
                });
            }
            let Some(material) = materials.last_mut() else { continue };
            material
                .push(energy.ln(), values.map(f64::ln))
                .map_err(|problem| row.wrong(problem))?;
        }
        for row in rows("form.csv", forms, 4)? {
            let [x, s, f] = row.numbers::<3>()?;
            let Some(material) = materials.iter_mut().find(|m| m.name == row.name) else {
                return Err(row.wrong("a material without attenuation"));
            };
            let last = material.forms.x.last();
            if !(0.0..=1.0).contains(&s)
                || !(0.0..=1.0).contains(&f)
                || last.is_some_and(|&l| l >= x)
                || (last.is_none() && x != 0.0)
            {
                return Err(row.wrong("x must increase from 0, both functions lie in 0..1"));
            }
            material.forms.x.push(x);
            material.forms.incoherent.push(s);
            material.forms.coherent.push(f);
        }
        match materials.iter().find(|m| m.forms.x.len() < 2) {
            Some(m) => Err(PhysicsError::Table {
                file: "form.csv",
                line: 1,
                problem: format!("nothing of {}", m.name),
            }),
            None => Ok(Self { materials }),
        }
    }

    /// The material called `name`.
    ///
    /// # Errors
    /// [`PhysicsError::UnknownMaterial`].
    pub fn material(&self, name: &str) -> Result<&Material, PhysicsError> {
        self.materials.iter().find(|m| m.name == name).ok_or_else(|| {
            PhysicsError::UnknownMaterial {
                name: name.to_owned(),
                known: self
                    .materials
                    .iter()
                    .map(|m| m.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", "),
            }
        })
    }
}

impl Material {
    fn push(&mut self, energy: f64, values: [f64; 3]) -> Result<(), &'static str> {
        let Some(piece) = self.pieces.last_mut() else { return Ok(()) };
        match piece.last() {
            Some(&(last, _)) if last > energy => return Err("energies must increase"),
            // Two rows of one energy: an edge.
            Some(&(last, _)) if last == energy => self.pieces.push(vec![(energy, values)]),
            _ => piece.push((energy, values)),
        }
        Ok(())
    }
}

/// A line of a table: a name, then numbers.
pub(super) struct Row<'a> {
    file: &'static str,
    line: usize,
    pub(super) name: &'a str,
    rest: &'a str,
}

impl Row<'_> {
    pub(super) fn wrong(&self, problem: impl Into<String>) -> PhysicsError {
        PhysicsError::Table { file: self.file, line: self.line, problem: problem.into() }
    }

    /// The numbers after the name, as many as there are.
    pub(super) fn all(&self) -> Result<Vec<f64>, PhysicsError> {
        let number = |field: &str| field.parse().ok().filter(|x: &f64| x.is_finite());
        self.rest
            .split(',')
            .map(|field| number(field).ok_or_else(|| self.wrong(format!("'{field}' is no number"))))
            .collect()
    }

    fn numbers<const N: usize>(&self) -> Result<[f64; N], PhysicsError> {
        self.all()?.try_into().map_err(|_| self.wrong(format!("not {} columns", N + 1)))
    }
}

/// The lines of a table below its header, which must have `columns` columns.
pub(super) fn rows<'a>(
    file: &'static str,
    text: &'a str,
    columns: usize,
) -> Result<Vec<Row<'a>>, PhysicsError> {
    let header = text.lines().next().unwrap_or_default();
    if header.split(',').count() != columns {
        return Err(PhysicsError::Table {
            file,
            line: 1,
            problem: format!("not {columns} columns"),
        });
    }
    let row = |(i, line): (usize, &'a str)| {
        let (name, rest) = line.split_once(',').unwrap_or((line, ""));
        Row { file, line: i + 1, name, rest }
    };
    Ok(text.lines().enumerate().skip(1).filter(|(_, line)| !line.is_empty()).map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of reference data.
    fn data(file: &str) -> String {
        let folder = std::env::var_os("INTRADOS_DATA")
            .expect("INTRADOS_DATA must name the folder of test data");
        std::fs::read_to_string(std::path::Path::new(&folder).join(file)).unwrap()
    }

    /// Below and above the K edge of tin, 29.2001 keV, and of no one else.
    #[test]
    fn edges_are_steps() {
        let library = Library::builtin().unwrap();
        let tin = library.material("tin").unwrap();
        let step = tin.attenuation(29.201).photo / tin.attenuation(29.199).photo;
        assert!((step - 6.16).abs() < 0.02, "{step}");
        // Between the edge and the next grid point no cubic may have looked across.
        assert!(tin.attenuation(29.4).photo < tin.attenuation(29.21).photo);
    }

    #[test]
    fn damaged_tables_are_refused_by_line() {
        let cut = |from: &str, to: &str| {
            Library::parse(&ATTENUATION.replacen(from, to, 1), FORMS).unwrap_err().to_string()
        };
        assert!(cut("5.316633", "5.31663x").contains("line 3: '5.31663x' is no number"));
        assert!(cut("5.316633", "4.9").contains("line 3: energies must increase"));
        assert!(cut("5.316633", "-1").contains("line 3"));
        assert!(cut("5.316633,", "").contains("line 3: not 6 columns"));
        assert!(cut("5.316633", "NaN").contains("line 3"));
        assert!(
            Library::parse("", FORMS).is_err() && Library::parse(ATTENUATION, "a,b,c,d\n").is_err()
        );
        assert!(
            Library::builtin()
                .unwrap()
                .material("cheese")
                .unwrap_err()
                .to_string()
                .contains("known: concrete")
        );
    }

    /// Ignored, since nothing can be said without them:
    /// `INTRADOS_DATA=… cargo test --release --workspace -- --ignored with_data`.
    mod with_data {
        use super::*;

        /// The table has four or five digits; its energies lie between ours. Total and all three
        /// parts, worst of 264 numbers.
        #[test]
        #[ignore = "needs INTRADOS_DATA"]
        fn attenuation_agrees_with_the_table_to_four_digits() {
            let text = data("mu_table.csv");
            let library = Library::builtin().unwrap();
            let mut worst: f64 = 0.0;
            for line in text.lines().skip(1) {
                let fields: Vec<&str> = line.split(',').collect();
                let name = ["concrete", "water", "steel", "air", "quartz", "limestone"][[
                    "concrete", "water", "iron", "air", "SiO2", "CaCO3",
                ]
                .iter()
                .position(|n| fields[0].starts_with(n))
                .unwrap()];
                let numbers: Vec<f64> = fields[1..].iter().map(|f| f.parse().unwrap()).collect();
                let mu = library.material(name).unwrap().attenuation(numbers[1]);
                for (ours, theirs) in
                    [mu.total(), mu.photo, mu.compton, mu.rayleigh].into_iter().zip(&numbers[2..6])
                {
                    worst = worst.max((10.0 * ours / theirs - 1.0).abs());
                }
            }
            assert!(worst > 0.0 && worst < 1e-4, "{worst}");
        }
    }
}
