//! The command line: from words to the library and back to words.

pub mod args;
mod audit;
mod bench;
mod check;
mod dose;
mod keep;
mod method;
mod phantom;
mod project;
mod session;
mod trace;

use std::io::Write;

use clap::CommandFactory;

use crate::error::{Error, Result};
use crate::modes::audit::shell_word;
use args::{Cli, Command};

pub use session::Session;

/// Does what the command line says; results go to `out`, remarks and progress to standard error.
///
/// # Errors
/// What stopped the command. A refusal by `check` is [`Refused`](Outcome::Refused), not an error.
pub fn run(cli: &Cli, session: &Session, out: &mut dyn Write) -> Result<Outcome> {
    crate::dispatch::check()?;
    match &cli.command {
        Command::Project(args) => project::run(args, session, out).map(|()| Outcome::Done),
        Command::Audit(args) => audit::run(args, session, out),
        Command::Bench(command) => bench::run(command, session, out).map(|()| Outcome::Done),
        Command::Dose(args) => dose::run(args, session, out).map(|()| Outcome::Done),
        Command::Trace(args) => trace::run(args, session, out).map(|()| Outcome::Done),
        Command::Check(args) => check::run(args, out),
        Command::Phantom(command) => phantom::run(command, session, out).map(|()| Outcome::Done),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "chordfield", &mut script);
            print(out, &String::from_utf8_lossy(&script)).map(|()| Outcome::Done)
        }
    }
}

/// How a command ended that was not stopped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All was done.
    Done,
    /// `check` found input that cannot be used; it said so on standard output.
    Refused,
    /// `audit` found an error beyond the limit: what is to be said of it.
    LimitBroken(String),
}

impl Outcome {
    /// The process's exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Done => 0,
            Self::LimitBroken(_) => 1,
            Self::Refused => 2,
        }
    }
}

/// The command line as it was given, so that a shell takes it again.
fn command_line() -> String {
    let words: Vec<String> = std::env::args().skip(1).collect();
    format!("chordfield {}", shell_words(&words))
}

fn shell_words(words: &[String]) -> String {
    words.iter().map(|word| shell_word(word)).collect::<Vec<_>>().join(" ")
}

/// Writes text to standard output.
fn print(out: &mut dyn Write, text: &str) -> Result<()> {
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(|e| Error::io("write", std::path::Path::new("standard output"), e))
}
