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
        return fail(&error, &session);
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
        Err(error) => fail(&error, &session),
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
    let stop = move |exit_code: u8| {
        if leave_at_once(exit_code) {
            std::process::exit(exit_code.into());
        }
    };
    on_signals(stop).map_err(|e| refused("signals", &*e))
}

/// Calls `stop`, on a thread of its own, with the exit code by which shells tell the signal: 128 and its number.
#[cfg(unix)]
fn on_signals(stop: impl Fn(u8) + Send + 'static) -> Result<(), Box<dyn std::error::Error>> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    // Not SIGHUP, which `nohup` has ignored: to catch it would be to heed it.
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || signals.forever().for_each(|signal| stop(128 + signal as u8)))?;
    Ok(())
}

/// Calls `stop`, on a thread of its own, when the user asks for it.
#[cfg(not(unix))]
fn on_signals(stop: impl Fn(u8) + Send + 'static) -> Result<(), Box<dyn std::error::Error>> {
    Ok(ctrlc::set_handler(move || stop(Error::Interrupted.exit_code()))?)
}

fn fail(error: &Error, session: &Session) -> ExitCode {
    let stderr = io::stderr();
    let theme = if stderr.is_terminal() { GraphicalTheme::unicode() } else { GraphicalTheme::none() };
    let mut text = String::new();
    if GraphicalReportHandler::new_themed(theme).with_width(100).render_report(&mut text, error).is_err() {
        text = error.to_string();
    }
    // Nobody is left to tell if standard error is gone.
    let _ = writeln!(stderr.lock(), "{}", text.trim_end());
    ExitCode::from(session.exit_code(error))
}
