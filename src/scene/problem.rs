//! What is wrong with a beam, by the key that says it; and values that remember where they were written.

use std::ops::Range;

use serde::{Deserialize, Deserializer};

use super::panel::MAX_COORDINATE_MM;
use crate::Error;

/// A beam that cannot be built: which key is at fault, why, and what to do.
///
/// The key is a path below `[beam]` (`sad_mm`, `detector.pixels`), so that whoever holds the scene's text can mark
/// the place; [`super::beam::BeamSpec::span_of`] gives it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {problem}")]
pub struct BeamProblem {
    /// The key at fault, below `[beam]`.
    pub key: &'static str,
    /// What is wrong with it.
    pub problem: String,
    /// What the user can do about it.
    pub remedy: String,
}

impl BeamProblem {
    pub(super) fn new(key: &'static str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { key, problem: problem.into(), remedy: remedy.into() }
    }

    /// The same problem, blamed on the key that the user wrote.
    pub(super) fn blamed_on(self, key: &'static str) -> Self {
        Self { key, ..self }
    }
}

impl From<BeamProblem> for Error {
    fn from(problem: BeamProblem) -> Self {
        Error::input(format!("beam.{}", problem.key), problem.problem, problem.remedy)
    }
}

/// A value and, if a TOML text gave it, its place there (byte offsets). Values from elsewhere (`Given::from`) have none.
#[derive(Clone, Debug, PartialEq)]
pub struct Given<T> {
    value: T,
    span: Option<Range<usize>>,
}

impl<T> Given<T> {
    /// The value.
    pub fn get(&self) -> &T {
        &self.value
    }

    /// Where the scene's text says it, bytes.
    pub fn span(&self) -> Option<Range<usize>> {
        self.span.clone()
    }
}

impl<T> From<T> for Given<T> {
    fn from(value: T) -> Self {
        Self { value, span: None }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Given<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = toml::Spanned::<T>::deserialize(deserializer)?;
        let span = Some(spanned.span());
        Ok(Self { value: spanned.into_inner(), span })
    }
}

/// A finite number, or the problem that it is not.
pub(super) fn finite(key: &'static str, value: f64) -> Result<f64, BeamProblem> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(BeamProblem::new(key, format!("{value} is not a finite number"), "give a finite number"))
}

/// Coordinates within [`MAX_COORDINATE_MM`], or the problem that they are not.
pub(super) fn coordinates<const N: usize>(
    key: &'static str,
    values: [f64; N],
) -> Result<[f64; N], BeamProblem> {
    for value in values {
        if finite(key, value)?.abs() > MAX_COORDINATE_MM {
            return Err(BeamProblem::new(
                key,
                format!("{value} is beyond {MAX_COORDINATE_MM:e} mm"),
                "give distances in millimetres",
            ));
        }
    }
    Ok(values)
}

/// A distance above zero and within [`MAX_COORDINATE_MM`], or the problem that it is not.
pub(super) fn distance(key: &'static str, value: f64) -> Result<f64, BeamProblem> {
    if coordinates(key, [value])?[0] > 0.0 {
        return Ok(value);
    }
    Err(BeamProblem::new(key, format!("{value} is not positive"), "give a number greater than zero"))
}
