//! Grades of steel, by the names that standards give them.

use super::{Bars, InnerLining, Reinforcement, SegmentBars};

/// A grade of reinforcement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grade {
    /// Its name.
    pub name: &'static str,
    /// Characteristic yield stress, MPa.
    pub yield_mpa: f32,
    /// Tensile strength over yield stress, k, and strain at the largest force, ε_uk, where its
    /// standard tells both.
    pub ductility: Option<[f32; 2]>,
}

/// Classes A, B and C of EN 1992-1-1, Annex C, table C.1: least k and least ε_uk.
const A: Option<[f32; 2]> = Some([1.05, 0.025]);
const B: Option<[f32; 2]> = Some([1.08, 0.05]);
const C: Option<[f32; 2]> = Some([1.15, 0.075]);

const fn grade(name: &'static str, yield_mpa: f32, ductility: Option<[f32; 2]>) -> Grade {
    Grade { name, yield_mpa, ductility }
}

/// EN 1992-1-1 Annex C (400 to 600 MPa, classes A to C) under the names of EN 10080, DIN 488 and
/// ÖNORM B 4707; ASTM A615 (40, 60 and 75 ksi, in MPa as the standard rounds them).
const GRADES: [Grade; 11] = [
    grade("B400B", 400.0, B),
    grade("B450C", 450.0, C),
    grade("B500A", 500.0, A),
    grade("B500B", 500.0, B),
    grade("B500C", 500.0, C),
    grade("B550A", 550.0, A),
    grade("B550B", 550.0, B),
    grade("B600B", 600.0, B),
    grade("Grade 40", 280.0, None),
    grade("Grade 60", 420.0, None),
    grade("Grade 75", 520.0, None),
];

/// E of bars, MPa (EN 1992-1-1, 3.2.7).
const MODULUS_MPA: f32 = 200e3;

impl Grade {
    /// The grade of that name: `B500B`, `Grade 60`. `B500` and `B550` without a class are taken for
    /// class A, the least ductile.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let name = match name.trim() {
            "B500" => "B500A",
            "B550" => "B550A",
            other => other,
        };
        GRADES.into_iter().find(|g| g.name == name)
    }

    /// All names, for messages.
    #[must_use]
    pub fn names() -> String {
        GRADES.map(|g| g.name).join(", ")
    }

    /// The grade of that name, with another yield stress where there is one.
    fn chosen(name: &str, yield_mpa: Option<f32>) -> Option<Self> {
        Some(Self::named(name)?.at(yield_mpa))
    }

    /// With a yield stress that was measured or agreed upon.
    #[must_use]
    pub fn at(self, yield_mpa: Option<f32>) -> Self {
        Self { yield_mpa: yield_mpa.unwrap_or(self.yield_mpa), ..self }
    }

    /// Slope after yielding, MPa: up to k f_y at ε_uk (EN 1992-1-1, figure 3.8); E/100 where k and
    /// ε_uk are not known (EN 1993-1-5, C.6).
    #[must_use]
    pub fn hardening_mpa(&self) -> f32 {
        match self.ductility {
            Some([k, strain]) => {
                (k - 1.0) * self.yield_mpa / (strain - self.yield_mpa / MODULUS_MPA)
            }
            None => MODULUS_MPA / 100.0,
        }
    }
}

/// A grade of prestressing steel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrandGrade {
    /// Its name.
    pub name: &'static str,
    /// Characteristic tensile strength f_pk, MPa.
    pub strength_mpa: f32,
    /// Characteristic .1 % proof stress f_p0.1k, MPa.
    pub proof_mpa: f32,
    /// E, MPa (EN 1992-1-1, 3.3.6).
    pub modulus_mpa: f32,
}

const fn strand(name: &'static str, strength_mpa: f32, proof_mpa: f32) -> StrandGrade {
    StrandGrade { name, strength_mpa, proof_mpa, modulus_mpa: 195e3 }
}

const fn bar(name: &'static str, strength_mpa: f32, proof_mpa: f32) -> StrandGrade {
    StrandGrade { name, strength_mpa, proof_mpa, modulus_mpa: 205e3 }
}

/// Strands of seven wires (prEN 10138-3, f_p0.1k = .88 f_pk) and threaded bars (prEN 10138-4).
const STRANDS: [StrandGrade; 5] = [
    strand("Y1770S7", 1770.0, 1560.0),
    strand("Y1860S7", 1860.0, 1640.0),
    bar("Y1030H", 1030.0, 835.0),
    bar("Y1050H", 1050.0, 950.0),
    bar("Y1230H", 1230.0, 1080.0),
];

impl StrandGrade {
    /// The grade of that name: `Y1860S7`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        STRANDS.into_iter().find(|g| g.name == name.trim())
    }

    /// All names, for messages.
    #[must_use]
    pub fn names() -> String {
        STRANDS.map(|g| g.name).join(", ")
    }
}

impl Reinforcement {
    /// What its bars are made of; none: a grade that nobody knows, which the checks refuse.
    #[must_use]
    pub fn grade(&self) -> Option<Grade> {
        Grade::chosen(&self.steel, self.f_y_mpa)
    }

    /// Area of its longitudinal bars in the section that has most of them, m²; `laps` not counted.
    #[must_use]
    pub fn area(&self) -> f32 {
        // Going along the axis, there are more only where some begin.
        let in_section = |at: f32| {
            let meets = |bars: &&Bars| {
                let [from, to] = bars.span();
                from <= at && at < to
            };
            self.bars.iter().filter(meets).map(Bars::area).sum::<f32>()
        };
        self.bars.iter().map(|bars| in_section(bars.span()[0])).fold(0.0, f32::max)
    }
}

impl SegmentBars {
    /// What they are made of.
    #[must_use]
    pub fn grade(&self) -> Option<Grade> {
        Grade::chosen(&self.steel, self.f_y_mpa)
    }
}

impl InnerLining {
    /// What its bars and hoops are made of.
    #[must_use]
    pub fn grade(&self) -> Option<Grade> {
        Grade::chosen(&self.steel, self.f_y_mpa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Starter bars count where they are, not on top of what begins above them.
    #[test]
    fn the_area_of_bars_is_that_of_the_section_that_has_most() {
        let around = |from, to| Bars::Around {
            count: 4,
            diameter_mm: 20.0,
            from,
            to,
            ends: Default::default(),
            laps: Vec::new(),
        };
        let with = |bars| Reinforcement {
            cover_mm: 40.0,
            steel: "B500B".into(),
            f_y_mpa: None,
            bars,
            stirrups: None,
            bond: Default::default(),
        };
        let one = 4.0 * std::f32::consts::FRAC_PI_4 * 4e-4;
        for (bars, sets) in [
            (vec![], 0.0),
            (vec![Bars::around(4, 20.0)], 1.0),
            (vec![around(0.0, 0.5), around(0.5, 1.0)], 1.0),
            (vec![around(0.0, 0.3), around(0.1, 1.0)], 2.0),
        ] {
            let area = with(bars).area();
            assert!((area - sets * one).abs() < 1e-6 * one, "{area} {sets}");
        }
    }

    #[test]
    fn grades_are_read_by_name() {
        assert_eq!(Grade::named("B450C").map(|g| g.yield_mpa), Some(450.0));
        assert_eq!(Grade::named("Grade 60").map(|g| g.yield_mpa), Some(420.0));
        assert_eq!(Grade::named("B500").and_then(|g| g.ductility), A);
        // A structural steel is no reinforcement: whoever has plain bars of it gives f_y_mpa.
        assert_eq!([Grade::named("S1860-rubbish"), Grade::named("S235")], [None, None]);
        assert_eq!(StrandGrade::named("Y1860S7").map(|g| g.proof_mpa), Some(1640.0));
        assert_eq!(StrandGrade::named("Y1860"), None);
    }

    /// B500B: from 500 MPa at 2.5 ‰ to 540 MPa at 50 ‰.
    #[test]
    fn class_b_hardens_to_its_k_at_its_strain() {
        let grade = Grade::named("B500B").unwrap();
        assert!((500.0 + grade.hardening_mpa() * (0.05 - 0.0025) - 540.0).abs() < 1e-3);
        assert_eq!(Grade::named("B500B").unwrap().at(Some(235.0)).yield_mpa, 235.0);
    }
}
