//! The `chordfield` command.

use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;

use chordfield::Error;
use chordfield::cli::{self, Outcome, Session, args::Cli};
use clap::Parser;
use miette::{GraphicalReportHandler, GraphicalTheme};

fn main() -> ExitCode {
    let cli = Cli::parse();
    let session = Session::new(cli.quiet);
    if let Err(error) = prepare(&cli, &session) {
        return fail(&error);
    }
    match cli::run(&cli, &session, &mut io::stdout().lock()) {
        Ok(outcome) => {
            if let Outcome::LimitBroken(words) = &outcome {
                // Nobody is left to tell if standard error is gone; the exit code tells.
                let _ = writeln!(io::stderr().lock(), "{words}");
            }
            ExitCode::from(outcome.exit_code())
        }
        // Whoever read our output has seen enough (`| head`).
        Err(Error::Io { source, .. }) if source.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => fail(&error),
    }
}

/// Sets up threads and the way to be stopped.
fn prepare(cli: &Cli, session: &Session) -> Result<(), Error> {
    let threads = usize::from(cli.threads.unwrap_or(0));
    let refused = |what: &str, e: &dyn std::error::Error| {
        Error::input(what, e.to_string(), "try again with `--threads 1`")
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|e| refused("threads", &e))?;
    let leave_at_once = session.canceller();
    let stop = move || {
        if leave_at_once() {
            std::process::exit(Error::Interrupted.exit_code().into());
        }
    };
    ctrlc::set_handler(stop).map_err(|e| refused("signals", &e))
}

fn fail(error: &Error) -> ExitCode {
    let stderr = io::stderr();
    let theme = if stderr.is_terminal() { GraphicalTheme::unicode() } else { GraphicalTheme::none() };
    let mut text = String::new();
    if GraphicalReportHandler::new_themed(theme).with_width(100).render_report(&mut text, error).is_err() {
        text = error.to_string();
    }
    // Nobody is left to tell if standard error is gone.
    let _ = writeln!(stderr.lock(), "{}", text.trim_end());
    ExitCode::from(error.exit_code())
}
