//! A scene file's text, and errors that point into it.

use std::ops::Range;

use miette::NamedSource;
use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use crate::error::{Error, SceneError, legible};

/// A TOML document with its name, kept for error messages.
#[derive(Clone, Debug)]
pub struct SceneText {
    name: String,
    text: String,
}

/// Longer messages, and lines of many bytes, are no person's work: they are cut short, or told by their numbers.
const LONGEST_MESSAGE: usize = 300;
const LONGEST_LINE: usize = 2_000;

/// One step from a TOML value to a part of it.
#[derive(Clone, Copy, Debug)]
pub enum Step<'a> {
    /// Into a table, by key.
    Key(&'a str),
    /// Into an array, by index from 0.
    Index(usize),
}

impl SceneText {
    /// The document `text`, called `name` in messages.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into() }
    }

    /// The name used in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The document.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The document as typed values.
    ///
    /// # Errors
    /// Text that is not TOML, an unknown or duplicate key, a value of another type: with the place.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, Error> {
        toml::from_str(&self.text).map_err(|e| {
            // Of values nested without end, the parser says no more than that.
            let remedy = e.span().is_none().then(|| "write the scene as the examples do".to_owned());
            self.error_at(e.span(), e.message().trim_end(), "here", remedy)
        })
    }

    /// An error at the value that `path` leads to, or at the deepest value on the way that exists.
    pub fn error(
        &self,
        path: &[Step],
        message: impl Into<String>,
        label: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Error {
        self.error_at(self.locate(path), message, label, Some(remedy.into()))
    }

    fn error_at(
        &self,
        span: Option<Range<usize>>,
        message: impl Into<String>,
        label: impl Into<String>,
        remedy: Option<String>,
    ) -> Error {
        let mut message = shortened(legible(&message.into()));
        let span = span.filter(|span| {
            let can_be_shown = self.can_show(span);
            if !can_be_shown {
                let (line, column) = self.place_of(span.start);
                message += &format!(" (line {line}, column {column})");
            }
            can_be_shown
        });
        Error::Scene(Box::new(SceneError {
            message,
            source_code: NamedSource::new(&self.name, self.text.clone()),
            span: span.map(|s| (s.start, s.end.saturating_sub(s.start)).into()),
            label: label.into(),
            remedy,
        }))
    }

    /// Whether the lines of a span, and those before and after, are of a length to be shown.
    fn can_show(&self, span: &Range<usize>) -> bool {
        let (first, last) = (self.place_of(span.start).0, self.place_of(span.end).0);
        let mut around = self.text.split('\n').take(last + 1).skip(first.saturating_sub(2));
        around.all(|line| line.len() <= LONGEST_LINE)
    }

    /// Line and column, in bytes, of an offset, from 1.
    fn place_of(&self, offset: usize) -> (usize, usize) {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |newline| newline + 1);
        (before.iter().filter(|&&b| b == b'\n').count() + 1, before.len() - line_start + 1)
    }

    /// Where the value at `path` stands. Parses anew: errors are rare, and holding a spanned tree would tie every
    /// scene to its text.
    fn locate(&self, path: &[Step]) -> Option<Range<usize>> {
        let document = DeTable::parse(&self.text).ok()?;
        let mut span = None;
        let mut table = Some(document.get_ref());
        let mut array: Option<&toml::de::DeArray> = None;
        for step in path {
            let value = match step {
                Step::Key(key) => table.and_then(|t| t.get(*key)),
                Step::Index(i) => array.and_then(|a| a.get(*i)),
            };
            let Some(value) = value else { break };
            span = Some(value.span());
            table = match value.get_ref() {
                DeValue::Table(t) => Some(t),
                _ => None,
            };
            array = match value.get_ref() {
                DeValue::Array(a) => Some(a),
                _ => None,
            };
        }
        span
    }
}

/// The beginning and the end: what is wrong is said in one, what it is in the other.
fn shortened(message: String) -> String {
    if message.len() <= LONGEST_MESSAGE {
        return message;
    }
    let half = LONGEST_MESSAGE / 2;
    let is_end = |at: &usize| message.is_char_boundary(*at);
    let end = (0..=half).rev().find(is_end).unwrap_or(0);
    let start = (message.len() - half..message.len()).find(is_end).unwrap_or(message.len());
    format!("{} … {}", &message[..end], &message[start..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Doc {
        #[allow(dead_code)]
        organ: Vec<Organ>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Organ {
        #[allow(dead_code)]
        density: f64,
    }

    fn marked(error: &Error) -> &str {
        let Error::Scene(e) = error else { panic!("{error}") };
        let span = e.span.expect("a span");
        &e.source_code.inner()[span.offset()..span.offset() + span.len()]
    }

    #[test]
    fn errors_mark_the_value_or_the_deepest_one_there_is() {
        let text = SceneText::new("a.toml", "[[organ]]\ndensity = 1.0\n[[organ]]\ndensity = -2.5\n");
        let path = [Step::Key("organ"), Step::Index(1), Step::Key("density")];
        assert_eq!(marked(&text.error(&path, "", "", "")), "-2.5");
        let missing = [Step::Key("organ"), Step::Index(0), Step::Key("colour")];
        assert!(marked(&text.error(&missing, "", "", "")).contains("organ"));
    }

    #[test]
    fn unknown_and_duplicate_keys_are_refused_with_their_place() {
        let parse = |s: &str| SceneText::new("a.toml", s).parse::<Doc>().unwrap_err();
        let unknown = parse("[[organ]]\ndensity = 1.0\ncolor = 3\n");
        assert!(unknown.to_string().contains("unknown field `color`"), "{unknown}");
        assert_eq!(marked(&unknown), "color");
        let duplicate = parse("[[organ]]\ndensity = 1.0\ndensity = 2.0\n");
        assert!(duplicate.to_string().contains("duplicate key"), "{duplicate}");
    }

    #[test]
    fn endless_keys_lines_and_nestings_are_told_in_a_sentence() {
        let long_key = format!("{} = 1\n", "k".repeat(1 << 20));
        let deep = format!("organ = {}{}\n", "[".repeat(1 << 20), "]".repeat(1 << 20));
        let dotted = format!("{} = 1\n", vec!["a"; 1 << 20].join("."));
        for text in [long_key, deep, dotted] {
            let error = SceneText::new("a.toml", text).parse::<Doc>().unwrap_err();
            let shown = format!("{:?}", miette::Report::new(error));
            assert!(shown.len() < 2_000, "{} bytes", shown.len());
        }
        let far = format!("organ = []\nx = [{}]\n", "1, ".repeat(LONGEST_LINE));
        let error = SceneText::new("a.toml", far).parse::<Doc>().unwrap_err();
        assert!(error.to_string().ends_with("(line 2, column 1)"), "{error}");
    }
}
