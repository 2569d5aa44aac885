//! A scene file's text, and errors that point into it.

use std::ops::Range;

use miette::NamedSource;
use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use crate::error::{Error, SceneError};

/// A TOML document with its name, kept for error messages.
#[derive(Clone, Debug)]
pub struct SceneText {
    name: String,
    text: String,
}

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
            let message = e.message().trim_end().to_owned();
            self.error_at(e.span(), message, "here", None)
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
        Error::Scene(Box::new(SceneError {
            message: message.into(),
            source_code: NamedSource::new(&self.name, self.text.clone()),
            span: span.map(|s| (s.start, s.end.saturating_sub(s.start)).into()),
            label: label.into(),
            remedy,
        }))
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
}
