//! The rules of glTF 2.0, one file a subject, and [`validate`], which applies them all.
//!
//! `schema` knows the shape of every object (a table); the other files know what must hold between
//! objects and in the data. Rules read leniently and report each fault once: what has the wrong
//! type is the schema's business and absent for everyone else. The verdicts agree with Khronos's
//! validator on its own test files.

mod accessor;
mod animation;
mod asset;
mod buffer;
mod camera;
mod image;
mod light;
mod mesh;
mod node;
mod schema;
mod skin;

use std::{collections::HashMap, path::Path};

use intrados_stage::{Access, Cancelled, Job};

use super::{
    accessor::Accessor,
    document::Document,
    problem::{GltfProblem, ImportError, Severity, remedy::SMALLER},
};

/// Every problem of a file, errors, warnings and what could not be checked, in the order of the
/// rules.
///
/// # Errors
/// [`ImportError::Read`] where the file cannot be read, [`ImportError::Cancelled`] where the job
/// was.
pub fn validate(path: &Path, job: &Job) -> Result<Vec<GltfProblem>, ImportError> {
    validate_within(path, &Access::default(), job)
}

/// [`validate`] where links may lead to other folders too.
///
/// # Errors
/// As [`validate`].
pub fn validate_within(
    path: &Path,
    access: &Access,
    job: &Job,
) -> Result<Vec<GltfProblem>, ImportError> {
    let mut problems = Vec::new();
    if let Some(document) = Document::open(path, access, job, &mut problems)? {
        problems.extend(check(&document, true, job)?);
        problems.extend(
            super::import::unsupported(&document)
                .into_iter()
                .map(|p| GltfProblem { severity: Severity::Warning, ..p }),
        );
    }
    Ok(problems)
}

/// Applies all rules to a document; those of images' bytes only if asked, for they decode every
/// image.
pub(super) fn check(
    document: &Document,
    images: bool,
    job: &Job,
) -> Result<Vec<GltfProblem>, Cancelled> {
    let mut check = Check { document, job, problems: Vec::new(), extremes: HashMap::new() };
    let rules: [fn(&mut Check) -> Result<(), Cancelled>; 9] = [
        |check| {
            schema::check(check);
            asset::check(check);
            Ok(())
        },
        |check| {
            buffer::check(check);
            Ok(())
        },
        accessor::check,
        mesh::check,
        |check| {
            node::check(check);
            Ok(())
        },
        skin::check,
        animation::check,
        |check| {
            camera::check(check);
            light::check(check);
            Ok(())
        },
        |check| {
            image::check_places(check);
            Ok(())
        },
    ];
    let steps = rules.len() + 1;
    for (i, rule) in rules.into_iter().enumerate() {
        // Opening was the first 4/10 of the work, building the last 3/10.
        job.step(4 * steps + 3 * i, 10 * steps)?;
        rule(&mut check)?;
    }
    if images {
        image::check_bytes(&mut check)?;
    }
    Ok(check.problems)
}

/// A document under examination.
struct Check<'a> {
    document: &'a Document,
    job: &'a Job,
    problems: Vec<GltfProblem>,
    /// Largest index of index accessors, found once.
    extremes: HashMap<usize, f64>,
}

impl<'a> Check<'a> {
    /// Problems that are kept; nobody reads more.
    const MAX_PROBLEMS: usize = 10_000;

    fn push(&mut self, problem: GltfProblem) {
        if self.problems.len() < Self::MAX_PROBLEMS {
            self.problems.push(problem);
        }
    }

    fn error(
        &mut self,
        pointer: impl Into<String>,
        code: &'static str,
        message: impl Into<String>,
        remedy: &'static str,
    ) {
        self.push(GltfProblem::error(pointer, code, message, remedy));
    }

    fn warn(
        &mut self,
        pointer: impl Into<String>,
        code: &'static str,
        message: impl Into<String>,
        remedy: &'static str,
    ) {
        self.push(GltfProblem::warning(pointer, code, message, remedy));
    }

    fn note(
        &mut self,
        pointer: impl Into<String>,
        code: &'static str,
        message: impl Into<String>,
        remedy: &'static str,
    ) {
        self.push(GltfProblem {
            severity: Severity::Note,
            ..GltfProblem::error(pointer, code, message, remedy)
        });
    }

    /// Opens an accessor that has data to look at; its faults are reported elsewhere.
    fn data(&self, index: usize) -> Option<Accessor<'a>> {
        Accessor::open(self.document, index).ok().filter(Accessor::has_data)
    }

    /// Visits the elements of an accessor, unless the file asks for more reading than any honest
    /// one.
    fn visit(
        &mut self,
        accessor: &Accessor,
        visitor: impl FnMut(usize, &[f64]),
    ) -> Result<(), Cancelled> {
        match self.document.work(accessor.count * accessor.layout.shape.components()) {
            Ok(()) => accessor.visit(self.job, visitor),
            Err(problem) => {
                if !self.problems.iter().any(|p| p.code == problem.code) {
                    self.push(GltfProblem { remedy: SMALLER, ..problem });
                }
                Ok(())
            }
        }
    }
}
