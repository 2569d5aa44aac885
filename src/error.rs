//! What can go wrong, in words that name the place and the remedy.

use std::io;
use std::path::{Path, PathBuf};

use miette::{Diagnostic, NamedSource, SourceSpan};

/// The result of every fallible operation of this library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can stop a run. Inputs are never half-accepted: an error means that nothing was written
/// for the input it names.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum Error {
    /// A scene file says something that cannot be built; carries the text and the place.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scene(Box<SceneError>),

    /// A mesh, a table, a parameter or an organ is wrong.
    #[error("{subject}: {problem}")]
    #[diagnostic(help("{remedy}"))]
    Input {
        /// The file, organ or parameter at fault, with the element where one is known.
        subject: String,
        /// What is wrong with it.
        problem: String,
        /// What the user can do about it.
        remedy: String,
    },

    /// The operating system refused to read or write.
    #[error("cannot {action} {}", path.display())]
    Io {
        /// What was being done, as an infinitive: `read`, `create`, `write`, `replace`.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        #[source]
        source: io::Error,
    },

    /// Several things are wrong at once; each is told.
    #[error("{count} problems")]
    Several {
        /// How many.
        count: usize,
        /// Each of them.
        #[related]
        errors: Vec<Error>,
    },

    /// The user asked to stop (Ctrl-C, termination). No target file was left half-written.
    #[error("interrupted")]
    Interrupted,
}

/// An error with its place in a scene file.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{message}")]
pub struct SceneError {
    /// What is wrong.
    pub message: String,
    /// The scene file's name and text.
    #[source_code]
    pub source_code: NamedSource<String>,
    /// Where it is wrong.
    #[label("{label}")]
    pub span: Option<SourceSpan>,
    /// What the marked text is.
    pub label: String,
    /// What the user can do about it.
    #[help]
    pub remedy: Option<String>,
}

impl Error {
    /// A wrong input: who, what, and what to do.
    pub fn input(subject: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (subject, problem) = (legible(&subject.into()), legible(&problem.into()));
        Self::Input { subject, problem, remedy: remedy.into() }
    }

    /// The operating system's refusal, with what was being done to which path.
    pub fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self::Io { action, path: path.to_owned(), source }
    }

    /// One error out of many: the only one there is, or all together. `errors` must not be empty.
    pub fn several(mut errors: Vec<Self>) -> Self {
        match errors.len() {
            1 => errors.swap_remove(0),
            count => Self::Several { count, errors },
        }
    }

    /// The line of the scene file that the error marks, from 1.
    pub fn line(&self) -> Option<usize> {
        let Self::Scene(scene) = self else { return None };
        let start = scene.span?.offset();
        Some(scene.source_code.inner().get(..start)?.matches('\n').count() + 1)
    }

    /// The message with its cause, and the remedy, for use within another error.
    pub fn into_words(self) -> (String, String) {
        let remedy = self.help().map(|h| h.to_string()).unwrap_or_default();
        let cause = std::error::Error::source(&self).map(|c| format!(": {c}")).unwrap_or_default();
        (format!("{self}{cause}"), remedy)
    }

    /// The process exit code of this error: 130 for an interruption (143 if it was a request to terminate, which only the
    /// program knows), 2 for everything else.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Interrupted => 130,
            _ => 2,
        }
    }
}

/// The text with an exponent in numbers that are mostly zeros: f64 writes 1e300 with 301 digits.
pub(crate) fn legible(text: &str) -> String {
    const MOST_DIGITS: usize = 40;
    let is_of_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut legible = String::with_capacity(text.len().min(1 << 10));
    let mut rest = text;
    while let Some(start) = rest.find(is_of_number) {
        let (before, from) = rest.split_at(start);
        let (number, after) = from.split_at(from.find(|c| !is_of_number(c)).unwrap_or(from.len()));
        legible.push_str(before);
        match number.parse::<f64>() {
            Ok(value) if number.len() > MOST_DIGITS => legible.push_str(&format!("{value:e}")),
            _ => legible.push_str(number),
        }
        rest = after;
    }
    legible + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_hundreds_of_digits_are_told_with_an_exponent() {
        let error =
            Error::input(format!("{} mm", 1e-300), format!("-{} is beyond 1e9", f64::MAX), "give less");
        assert_eq!(error.to_string(), format!("1e-300 mm: -{:e} is beyond 1e9", f64::MAX));
        for text in ["", "0..360:30", "faces 4000000000, 18446744073709551616", "v1.2.3 é 7"] {
            assert_eq!(legible(text), text);
        }
        assert_eq!(legible(&"1.".repeat(30)), "1.".repeat(30));
    }
}
