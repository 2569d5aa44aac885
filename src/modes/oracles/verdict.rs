//! What an oracle found.

use std::fmt::Write as _;

use serde::Serialize;

/// Whether what was measured is within the bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// It is.
    Passed,
    /// It is not: a length is wrong, or the bound.
    Failed,
    /// The oracle has nothing to say about this body or method.
    DoesNotApply,
}

/// What an oracle claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Claim {
    /// A short name.
    pub oracle: &'static str,
    /// What it claims, in one sentence.
    pub claim: &'static str,
    /// Where that comes from.
    pub source: &'static str,
}

/// What one oracle found about one subject.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// The oracle and its claim.
    #[serde(flatten)]
    claim: Claim,
    /// The organ, or the scene.
    pub subject: String,
    /// Lengths asked for.
    pub rays: usize,
    /// What was measured.
    pub measured: f64,
    /// What it may be at most.
    pub bound: f64,
    /// The unit of both, and what they are.
    pub unit: &'static str,
    /// Whether it is.
    pub outcome: Outcome,
}

impl Verdict {
    pub(super) fn new(
        claim: Claim,
        subject: &str,
        rays: usize,
        (measured, bound): (f64, f64),
        unit: &'static str,
    ) -> Self {
        // What is not a number is within no bound.
        let outcome = if measured <= bound { Outcome::Passed } else { Outcome::Failed };
        Self { claim, subject: subject.to_owned(), rays, measured, bound, unit, outcome }
    }

    pub(super) fn does_not_apply(claim: Claim, subject: &str, why: &'static str) -> Self {
        let outcome = Outcome::DoesNotApply;
        Self { claim, subject: subject.to_owned(), rays: 0, measured: 0.0, bound: 0.0, unit: why, outcome }
    }

    /// The oracle's name.
    pub fn oracle(&self) -> &'static str {
        self.claim.oracle
    }

    /// What it claims, in one sentence.
    pub fn claim(&self) -> &'static str {
        self.claim.claim
    }
}

/// Verdicts as a table: for each oracle, how many subjects passed, and the one nearest to its bound or beyond. Then each
/// verdict that failed.
pub fn table(verdicts: &[Verdict]) -> String {
    let mut text = format!(
        "{:<22} {:>7} {:>7} {:>10}  {:>9} {:>9}  {:<28} {}\n",
        "oracle", "passed", "failed", "rays", "measured", "bound", "unit", "nearest to its bound"
    );
    let mut names: Vec<&str> = Vec::new();
    for verdict in verdicts.iter().filter(|v| v.outcome != Outcome::DoesNotApply) {
        if !names.contains(&verdict.oracle()) {
            names.push(verdict.oracle());
        }
    }
    for name in names {
        let of_name = || verdicts.iter().filter(|v| v.oracle() == name && v.outcome != Outcome::DoesNotApply);
        let count = |outcome| of_name().filter(|v| v.outcome == outcome).count();
        let rays: usize = of_name().map(|v| v.rays).sum();
        if let Some(worst) = of_name().max_by(|a, b| a.strain().total_cmp(&b.strain())) {
            let (passed, failed) = (count(Outcome::Passed), count(Outcome::Failed));
            let Verdict { measured, bound, unit, subject, .. } = worst;
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{name:<22} {passed:>7} {failed:>7} {rays:>10}  {measured:>9.2e} {bound:>9.2e}  {unit:<28} {subject}"
            );
        }
    }
    for verdict in verdicts.iter().filter(|v| v.outcome == Outcome::Failed) {
        let Verdict { subject, measured, bound, unit, .. } = verdict;
        let (name, claim) = (verdict.oracle(), verdict.claim());
        let _ = writeln!(
            text,
            "\nFAILED {name}, {subject}: {measured:.3e} is above {bound:.3e} ({unit}).\n  {claim}"
        );
    }
    text
}

impl Verdict {
    /// How much of the bound is used; more than 1 if failed.
    fn strain(&self) -> f64 {
        match (self.outcome, self.bound) {
            (Outcome::Failed, 0.0) => f64::INFINITY,
            (_, 0.0) => 0.0,
            _ => self.measured / self.bound,
        }
    }
}
