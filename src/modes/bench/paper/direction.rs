//! Which way figures go as a setting grows, and whether that is the way they went in the paper.
//!
//! Nothing is asserted: each claim is computed from what was measured, and told with the figures it rests on.

use serde::Serialize;

use super::super::digits;

/// Figures over a setting: ours, and the paper's where it gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// What they are called in a sentence.
    pub name: &'static str,
    /// The setting and the figure, in the order of the setting.
    pub ours: Vec<[f64; 2]>,
    /// The paper's likewise.
    pub paper: Vec<[f64; 2]>,
}

/// Something that the paper found, and whether it was found again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// Whether it was.
    pub holds: bool,
    /// The figures, as part of a sentence.
    pub words: String,
}

/// What came of one sweep, in a sentence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Whether all claims hold.
    pub reproduced: bool,
    /// The sentence.
    pub sentence: String,
    /// What it says, claim by claim.
    pub claims: Vec<Claim>,
}

impl Verdict {
    /// The verdict on some claims. `None` if there are none: too little was measured.
    pub fn of(claims: Vec<Claim>) -> Option<Self> {
        let held = claims.iter().filter(|claim| claim.holds).count();
        let head = match (held, claims.len()) {
            (_, 0) => return None,
            (held, all) if held == all => "The paper's direction is reproduced",
            (0, _) => "The paper's direction is not reproduced",
            _ => "The paper's direction is reproduced in part",
        };
        let words: Vec<&str> = claims.iter().map(|claim| claim.words.as_str()).collect();
        let sentence = format!("{head}: {}.", words.join("; "));
        Some(Self { reproduced: held == claims.len(), sentence, claims })
    }
}

/// Steps the other way may add up to this share of the whole way.
const MOST_BACK: f64 = 0.2;

/// Figures within this share of each other are told to be the same.
const FLAT: f64 = 0.1;

/// A jump is at least by this factor.
const JUMP: f64 = 1.5;

/// Which way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Up.
    Rises,
    /// Down.
    Falls,
}

/// Whether figures go one way as the setting grows, on the whole. `None` of fewer than two.
pub fn trend(series: &Series, way: Way) -> Option<Claim> {
    let ([first, .., last], [.., _]) = (&series.ours[..], &series.ours[..]) else { return None };
    let sign = if way == Way::Rises { 1.0 } else { -1.0 };
    let whole = sign * (last[1] - first[1]);
    let steps = series.ours.windows(2).map(|w| sign * (w[1][1] - w[0][1]));
    let back: f64 = steps.map(|step| (-step).max(0.0)).sum();
    let holds = whole > 0.0 && back <= MOST_BACK * whole;
    let verb = match (way, holds) {
        (_, false) if whole > 0.0 => "goes up and down",
        (Way::Rises, false) => "does not rise",
        (Way::Falls, false) => "does not fall",
        (Way::Rises, true) if back == 0.0 => "rises",
        (Way::Falls, true) if back == 0.0 => "falls",
        (Way::Rises, true) => "rises on the whole",
        (Way::Falls, true) => "falls on the whole",
    };
    let from_to = |points: &[[f64; 2]]| match points {
        [first, .., last] => {
            format!("{} at {} to {} at {}", figure(first[1]), first[0], figure(last[1]), last[0])
        }
        _ => String::new(),
    };
    let paper = match series.paper.len() {
        0 | 1 => String::new(),
        _ => format!(" (the paper's from {})", from_to(&series.paper)),
    };
    Some(Claim { holds, words: format!("{} {verb}, from {}{paper}", series.name, from_to(&series.ours)) })
}

/// Whether figures are greatest between the ends. `None` of fewer than three.
pub fn peak(series: &Series) -> Option<Claim> {
    let [first, _, .., last] = series.ours[..] else { return None };
    let top = greatest(&series.ours)?;
    let holds = top[1] > first[1] && top[1] > last[1];
    let paper = greatest(&series.paper)
        .map_or(String::new(), |top| format!(" (the paper's at {} with {})", top[0], figure(top[1])));
    let ends = format!("{} at {} and {} at {}", figure(first[1]), first[0], figure(last[1]), last[0]);
    let words = if holds {
        format!("{} peaks at {} with {}, against {ends}{paper}", series.name, top[0], figure(top[1]))
    } else {
        format!("{} has no peak between {ends}{paper}", series.name)
    };
    Some(Claim { holds, words })
}

/// Whether figures jump and are flat from there on, as a cache's do once it holds all that is in use; `holds_all` is the
/// setting from which on it does, if one does. `None` of fewer than three.
pub fn knee(series: &Series, holds_all: Option<f64>) -> Option<Claim> {
    let [first, _, .., last] = series.ours[..] else { return None };
    let is_level =
        |point: &&[f64; 2]| point[1] >= (1.0 - FLAT) * last[1] && point[1] <= (1.0 + FLAT) * last[1];
    let level = series.ours.iter().rev().take_while(is_level).last()?;
    let jump = last[1] / first[1];
    let holds = jump >= JUMP && level[0] > first[0] && level[0] < last[0];
    let all = holds_all.map_or(String::new(), |size| format!("; nothing is forgotten from {size} on"));
    let words = if holds {
        format!(
            "{} is flat from {} on at {}, {} times what it is at {}{all}",
            series.name,
            level[0],
            figure(last[1]),
            figure(jump),
            first[0]
        )
    } else {
        format!(
            "{} shows no knee: {} at {}, {} at {}{all}",
            series.name,
            figure(first[1]),
            first[0],
            figure(last[1]),
            last[0]
        )
    };
    Some(Claim { holds, words })
}

fn greatest(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    points.iter().copied().max_by(|a, b| a[1].total_cmp(&b[1]))
}

fn figure(value: f64) -> String {
    digits(value, 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: &[f64]) -> Series {
        let ours = values.iter().zip(1u32..).map(|(v, i)| [f64::from(i), *v]).collect();
        Series { name: "it", ours, paper: Vec::new() }
    }

    fn rises(values: &[f64]) -> bool {
        trend(&series(values), Way::Rises).expect("enough").holds
    }

    #[test]
    fn a_trend_may_step_back_a_little_but_not_much() {
        assert!(rises(&[1.0, 2.0, 3.0]) && rises(&[1.0, 3.0, 2.8]));
        assert!(!rises(&[1.0, 3.0, 1.2]) && !rises(&[1.0, 1.0]) && !rises(&[2.0, 1.0]));
        assert!(!rises(&[1.0, 3.0, 2.0, 2.5]), "back by two thirds of the way");
        let words = |values: &[f64]| trend(&series(values), Way::Rises).expect("enough").words;
        assert_eq!(words(&[1.0, 3.0, 2.8]), "it rises on the whole, from 1.00 at 1 to 2.80 at 3");
        assert_eq!(words(&[1.0, 3.0, 1.2]), "it goes up and down, from 1.00 at 1 to 1.20 at 3");
        assert_eq!(words(&[2.0, 1.0]), "it does not rise, from 2.00 at 1 to 1.00 at 2");
        assert!(trend(&series(&[3.0, 2.0, 1.0]), Way::Falls).expect("enough").holds);
        assert!(!trend(&series(&[1.0, 2.0]), Way::Falls).expect("enough").holds);
        assert_eq!(trend(&series(&[1.0]), Way::Rises), None);
    }

    #[test]
    fn a_peak_lies_between_the_ends() {
        let holds = |values: &[f64]| peak(&series(values)).expect("enough").holds;
        assert!(holds(&[1.0, 3.0, 2.0]));
        assert!(!holds(&[1.0, 2.0, 3.0]) && !holds(&[3.0, 2.0, 1.0]) && !holds(&[1.0, 1.0, 1.0]));
        assert_eq!(peak(&series(&[1.0, 2.0])), None);
        let words = peak(&series(&[1.0, 3.0, 2.0])).expect("enough").words;
        assert_eq!(words, "it peaks at 2 with 3.00, against 1.00 at 1 and 2.00 at 3");
    }

    #[test]
    fn a_knee_is_a_jump_to_what_stays_level() {
        let claim = |values: &[f64]| knee(&series(values), Some(3.0)).expect("enough");
        let found = claim(&[0.1, 0.2, 2.0, 2.05, 2.0]);
        assert!(found.holds, "{}", found.words);
        assert!(found.words.contains("flat from 3 on at 2.00, 20.0 times"), "{}", found.words);
        assert!(!claim(&[0.1, 0.2, 0.4, 0.8, 1.6]).holds, "still growing");
        assert!(!claim(&[2.0, 2.0, 2.1, 2.0]).holds, "flat all along");
        assert!(!claim(&[2.0, 1.0, 0.5]).holds, "falling");
    }

    #[test]
    fn a_verdict_says_how_much_of_it_was_found_again_and_quotes_the_figures() {
        let claim = |holds| Claim { holds, words: if holds { "a rises" } else { "b does not" }.into() };
        let verdict = |claims: &[bool]| Verdict::of(claims.iter().map(|&holds| claim(holds)).collect());
        assert_eq!(verdict(&[]), None);
        assert!(verdict(&[true, true]).expect("claims").reproduced);
        let part = verdict(&[true, false]).expect("claims");
        assert!(!part.reproduced);
        assert_eq!(part.sentence, "The paper's direction is reproduced in part: a rises; b does not.");
        assert!(verdict(&[false]).expect("a claim").sentence.contains("is not reproduced"));
    }
}
