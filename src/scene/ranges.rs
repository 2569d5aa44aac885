//! Lists and ranges of angles, as a user writes them: `90`, `[0, 90]`, `"0,90,180"`, `"0..360:30"`.

use std::fmt;
use std::str::FromStr;

use serde::de::{self, Deserialize, Deserializer, SeqAccess, Visitor};

/// The most views that one beam may ask for, and so the most angles in one list. Two thousand are a fine tomographic
/// orbit; far beyond it, the step is almost surely mistyped and the output would fill the disk.
pub const MAX_VIEWS: usize = 10_000;

/// Larger angles, some three thousand turns, are surely mistyped; names of files tell the angle.
const MAX_DEG: f64 = 1e6;

/// How far from a whole number of steps (or turns) an end may lie and still count as on it: decimal steps such as
/// 0.1 are not binary numbers, and the quotient of two of them is off by a few units in the last place of at most
/// [`MAX_VIEWS`], that is by less than 1e-11.
const ON_STEP: f64 = 1e-9;

/// Angles in degrees, finite, at least one and at most [`MAX_VIEWS`], in the order written.
///
/// A range `start..end:step` runs from `start` in steps of `step` (negative to run down). Its end is included when it falls
/// on a step, except when the range spans whole turns: there the end is the start again and would be seen twice. So
/// `0..360:30` is twelve angles ending at 330, and `0..180:30` is seven ending at 180.
#[derive(Clone, Debug, PartialEq)]
pub struct Angles(Vec<f64>);

impl Angles {
    /// These angles, degrees. An error says which is not finite, or that there are none or too many.
    pub fn new(degrees: Vec<f64>) -> Result<Self, String> {
        if degrees.is_empty() {
            return Err("no angle given; write a number, a list or a range such as \"0..360:30\"".into());
        }
        if degrees.len() > MAX_VIEWS {
            return Err(too_many(degrees.len() as f64));
        }
        match degrees.iter().find(|angle| angle.is_nan() || angle.abs() > MAX_DEG) {
            Some(angle) => Err(format!("{angle} is no angle of up to {MAX_DEG} degrees; give degrees")),
            None => Ok(Self(degrees)),
        }
    }

    /// The angles, degrees.
    pub fn degrees(&self) -> &[f64] {
        &self.0
    }
}

impl From<f64> for Angles {
    /// One angle, degrees. Whether it is finite is checked where it is used.
    fn from(degrees: f64) -> Self {
        Self(vec![degrees])
    }
}

impl FromStr for Angles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut degrees = Vec::new();
        for item in text.split(',') {
            match item.split_once("..") {
                Some(_) => degrees.extend(range(item, true)?),
                None => degrees.push(number(item)?),
            }
        }
        Self::new(degrees)
    }
}

/// The numbers of `start..end:step`. The end is included when it falls on a step; not if `turns` and the range spans whole
/// turns of 360.
pub(crate) fn range(item: &str, turns: bool) -> Result<Vec<f64>, String> {
    let item = item.trim();
    let (start, rest) = item.split_once("..").unwrap_or((item, ""));
    let (end, step) = rest.split_once(':').ok_or_else(|| {
        format!("the range {item:?} has no step; write start..end:step, for example 0..360:30")
    })?;
    let (start, end, step) = (number(start)?, number(end)?, number(step)?);
    if step == 0.0 {
        return Err(format!("the range {item:?} has a step of zero; give the distance from one to the next"));
    }
    let steps = (end - start) / step;
    if steps < 0.0 {
        return Err(format!("the range {item:?} steps away from its end; change the step's sign"));
    }
    let whole_steps = (steps + ON_STEP).floor();
    let ends_on_step = (steps - whole_steps).abs() <= ON_STEP;
    let turned = (end - start) / 360.0;
    let full_turn = turns && (turned - turned.round()).abs() <= ON_STEP && turned.round() != 0.0;
    let count = if full_turn && ends_on_step { whole_steps } else { whole_steps + 1.0 };
    // Finite but huge ends can make the count infinite or NaN.
    if count.is_nan() || count > MAX_VIEWS as f64 {
        return Err(too_many(count));
    }
    Ok((0..count as usize).map(|i| start + i as f64 * step).collect())
}

fn number(text: &str) -> Result<f64, String> {
    let text = text.trim();
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("{text:?} is not a number; write, for example, 90, 0,90,180 or 0..360:30")),
    }
}

fn too_many(count: f64) -> String {
    format!("{count} values are more than the {MAX_VIEWS} that one list may have; use a coarser step")
}

impl<'de> Deserialize<'de> for Angles {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnglesVisitor)
    }
}

struct AnglesVisitor;

impl<'de> Visitor<'de> for AnglesVisitor {
    type Value = Angles;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an angle in degrees, a list of them, or a range such as \"0..360:30\"")
    }

    fn visit_f64<E: de::Error>(self, degrees: f64) -> Result<Angles, E> {
        Angles::new(vec![degrees]).map_err(E::custom)
    }

    fn visit_i64<E: de::Error>(self, degrees: i64) -> Result<Angles, E> {
        self.visit_f64(degrees as f64)
    }

    fn visit_u64<E: de::Error>(self, degrees: u64) -> Result<Angles, E> {
        self.visit_f64(degrees as f64)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Angles, E> {
        text.parse().map_err(E::custom)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Angles, A::Error> {
        let mut degrees = Vec::new();
        while let Some(angle) = list.next_element::<f64>()? {
            degrees.push(angle);
        }
        Angles::new(degrees).map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(text: &str) -> Vec<f64> {
        text.parse::<Angles>().expect("angles").0
    }

    #[test]
    fn a_full_turn_leaves_its_end_out() {
        assert_eq!(degrees("0..360:90"), [0.0, 90.0, 180.0, 270.0]);
        assert_eq!(degrees("-180..180:120"), [-180.0, -60.0, 60.0]);
        assert_eq!(degrees("360..0:-90"), [360.0, 270.0, 180.0, 90.0]);
        assert_eq!(degrees("0.1..360.1:0.1").len(), 3600, "decimal steps do not lose or gain a view");
    }

    #[test]
    fn a_partial_turn_keeps_an_end_that_falls_on_a_step() {
        assert_eq!(degrees("0..180:60"), [0.0, 60.0, 120.0, 180.0]);
        assert_eq!(degrees("0..100:60"), [0.0, 60.0]);
        assert_eq!(degrees("0..0.3:0.1").len(), 4);
        assert_eq!(degrees("5..5:1"), [5.0]);
        assert_eq!(degrees("0..360:100"), [0.0, 100.0, 200.0, 300.0]);
    }

    #[test]
    fn angles_of_thousands_of_turns_and_what_are_no_numbers_are_refused() {
        assert_eq!(degrees("-1e6,1e6"), [-1e6, 1e6]);
        for text in ["1e300", "-1e300", "1000001", "inf", "nan"] {
            assert!(text.parse::<Angles>().is_err(), "{text}");
        }
    }

    #[test]
    fn lists_and_ranges_mix_in_the_order_written() {
        assert_eq!(degrees("90, 0,180..200:10"), [90.0, 0.0, 180.0, 190.0, 200.0]);
    }

    #[test]
    fn bad_texts_are_refused_with_a_remedy() {
        for (text, word) in [
            ("", "is not a number"),
            ("0,,90", "is not a number"),
            ("nan", "is not a number"),
            ("1e999", "is not a number"),
            ("0..360", "no step"),
            ("0..360:0", "zero"),
            ("0..90:-10", "sign"),
            ("0..360:1e-9", "coarser step"),
            ("-1e308..1e308:1e-300", "coarser step"),
        ] {
            let error = text.parse::<Angles>().expect_err(text);
            assert!(error.contains(word), "{text}: {error}");
        }
        assert!(Angles::new(Vec::new()).is_err());
        assert!(Angles::new(vec![0.0; MAX_VIEWS + 1]).is_err());
    }

    #[test]
    fn toml_gives_numbers_lists_and_texts() {
        #[derive(serde::Deserialize)]
        struct Keys {
            a: Angles,
        }
        let read = |text: &str| toml::from_str::<Keys>(text).map(|keys| keys.a.0);
        assert_eq!(read("a = 90").expect("integer"), [90.0]);
        assert_eq!(read("a = -22.5").expect("float"), [-22.5]);
        assert_eq!(read("a = [0, 22.5]").expect("list"), [0.0, 22.5]);
        assert_eq!(read("a = '0..360:180'").expect("range"), [0.0, 180.0]);
        for text in ["a = nan", "a = []", "a = [inf]", "a = true", "a = 'x'"] {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
