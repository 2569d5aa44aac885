//! A study in parts, each followed on its own, and their joining.
//!
//! Parts are runs of whole blocks, so that their rows one after the other are the whole study's. A field that is cut keeps its
//! sums as nodes of its tree of blocks; joined, they are the same bits as if it had not been cut.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::report::{Collector, DoseReport, NOTICE, SampledErrors, StudyWords};
use super::sums::{FieldSums, Nodes};
use crate::error::{Error, Result};
use crate::study::Study;

/// One of so many parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Which, from 1.
    number: u32,
    /// Of how many.
    of: u32,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Part `number`, from 1, of `of` parts. `None` if there is none.
    pub fn new(number: u32, of: u32) -> Option<Self> {
        (1..=of).contains(&number).then_some(Self { number, of })
    }

    /// Which part, from 1.
    pub fn number(self) -> u32 {
        self.number
    }

    /// Of how many.
    pub fn of(self) -> u32 {
        self.of
    }

    /// Its share of things in a row.
    pub fn share_of(self, count: u64) -> Range<u64> {
        let place = |i: u32| (u128::from(count) * u128::from(i) / u128::from(self.of)) as u64;
        place(self.number - 1)..place(self.number)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').map(|(number, of)| (number.trim().parse(), of.trim().parse()));
        match parts {
            Some((Ok(number), Ok(of))) => Self::new(number, of),
            _ => None,
        }
        .ok_or_else(|| "give which part of how many, as `3/16`, from 1".into())
    }
}

/// The sums of one field, as much of it as is in a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// The field's number.
    pub field: usize,
    /// Nodes of its tree of blocks.
    pub nodes: Nodes<FieldSums>,
}

/// What one part of a study has found, to be written down and joined.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Part {
    /// The program.
    pub program: String,
    /// Its version.
    pub version: String,
    /// What this is not.
    pub notice: String,
    /// Which study.
    pub study: StudyWords,
    /// How lengths were found.
    pub method: String,
    /// Which part.
    pub shard: Shard,
    /// How many paths were followed.
    pub paths: u64,
    /// Errors of lengths on a sample of the part's paths.
    pub errors: Vec<SampledErrors>,
    /// The sums of its fields.
    pub pieces: Vec<Piece>,
}

impl Part {
    pub(super) fn new(
        study: &Study,
        method: &str,
        shard: Shard,
        paths: u64,
        pieces: Vec<Piece>,
        errors: Vec<SampledErrors>,
    ) -> Self {
        Self {
            program: "chordfield".into(),
            version: env!("CARGO_PKG_VERSION").into(),
            notice: NOTICE.into(),
            study: StudyWords::of(study),
            method: method.into(),
            shard,
            paths,
            errors,
            pieces,
        }
    }

    /// Whether it is a part of this study, followed by this method and by this version of the program.
    pub fn is_of(&self, study: &Study, method: &str) -> bool {
        let hashes = |words: &StudyWords| -> Vec<(String, String)> {
            words.inputs.iter().map(|input| (input.role.clone(), input.sha256.clone())).collect()
        };
        let words = StudyWords::of(study);
        self.version == env!("CARGO_PKG_VERSION")
            && self.method == method
            && hashes(&self.study) == hashes(&words)
            && self.study.settings == words.settings
            && self.study.parameters == words.parameters
    }
}

/// The report of all parts of a study: the same as of the whole, but for errors, which each part has its own sample of.
///
/// # Errors
/// Parts of another study, method, version or number of parts; a part that is missing or there twice.
pub fn join(study: &Study, method: &'static str, mut parts: Vec<Part>) -> Result<DoseReport> {
    let refuse = |problem: String, remedy: &str| Err(Error::input("the parts to be joined", problem, remedy));
    if let Some(foreign) = parts.iter().find(|part| !part.is_of(study, method)) {
        let problem = format!("part {} is of another study, setting, method or version", foreign.shard);
        return refuse(problem, "join with the arguments that the parts were made with, or make them anew");
    }
    parts.sort_by_key(|part| part.shard.number);
    let of = parts.first().map_or(0, |part| part.shard.of);
    if parts.iter().any(|part| part.shard.of != of) {
        return refuse("they are of splits into different numbers".into(), "remove those that do not belong");
    }
    if let Some(wrong) =
        (1..=of).zip(parts.iter().map(|part| part.shard.number)).find(|(i, number)| i != number)
    {
        return refuse(format!("part {}/{of} is missing, or another is there twice", wrong.0), "make it");
    }
    if parts.len() as u32 != of || of == 0 {
        return refuse(format!("{} of {of} parts are there", parts.len()), "make the others");
    }
    let mut collector = Collector::new(study);
    let mut errors = Vec::new();
    let mut open: Option<Piece> = None;
    for part in parts {
        errors.extend(part.errors);
        for piece in part.pieces {
            match &mut open {
                Some(known) if known.field == piece.field => {
                    piece.nodes.0.into_iter().for_each(|node| known.nodes.push(node));
                }
                _ => {
                    if let Some(done) = open.replace(piece) {
                        collector.take(done.nodes);
                    }
                }
            }
        }
    }
    open.into_iter().for_each(|piece| collector.take(piece.nodes));
    Ok(collector.report(method, errors))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other_and_are_alike_in_size() {
        for (count, of) in [(0, 3), (2, 5), (1000, 16), (u64::MAX, 7)] {
            let mut next = 0;
            for number in 1..=of {
                let share = Shard::new(number, of).expect("a part").share_of(count);
                assert_eq!(share.start, next);
                assert!(share.end - share.start <= count / u64::from(of) + 1);
                next = share.end;
            }
            assert_eq!(next, count);
        }
        assert_eq!("3/16".parse(), Ok(Shard { number: 3, of: 16 }));
        for wrong in ["0/4", "5/4", "3", "a/b", "1/0"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
