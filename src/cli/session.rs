//! What all commands share: a way to be stopped, and a terminal to report to or not.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};

use crate::error::Error;

/// One run of the program.
pub struct Session {
    cancel: Arc<AtomicBool>,
    writes: Arc<AtomicBool>,
    /// That of a run which was asked to stop.
    exit_code: Arc<AtomicU8>,
    talks: bool,
}

impl Session {
    /// A session that talks to a terminal on standard error unless told to be quiet.
    pub fn new(quiet: bool) -> Self {
        Self {
            cancel: Arc::default(),
            writes: Arc::default(),
            exit_code: Arc::new(AtomicU8::new(Error::Interrupted.exit_code())),
            talks: !quiet && std::io::stderr().is_terminal(),
        }
    }

    /// The flag that stops the run's work when set.
    pub fn cancel(&self) -> &AtomicBool {
        &self.cancel
    }

    /// Tells that from now on files are written, so that the run must be let come to a stop by itself.
    pub fn begin_writing(&self) {
        self.writes.store(true, Ordering::Relaxed);
    }

    /// What to do when the user asks to stop, given the exit code by which that is told; tells whether to leave the program at
    /// once. So it is while no file is being written (scenes may take long to load), and when the user asks a second time.
    pub fn canceller(&self) -> impl Fn(u8) -> bool + Send + 'static {
        let (cancel, writes) = (Arc::clone(&self.cancel), Arc::clone(&self.writes));
        let exit_code = Arc::clone(&self.exit_code);
        move |code| {
            exit_code.store(code, Ordering::Relaxed);
            cancel.swap(true, Ordering::Relaxed) || !writes.load(Ordering::Relaxed)
        }
    }

    /// The exit code for an error: of one that interrupts, that of the signal which did.
    pub fn exit_code(&self, error: &Error) -> u8 {
        match error {
            Error::Interrupted => self.exit_code.load(Ordering::Relaxed),
            other => other.exit_code(),
        }
    }

    /// A progress bar over `total` of `unit`, on a terminal only. It goes when it is dropped, so that an error's message
    /// stands alone.
    pub fn progress(&self, total: u64, unit: &str) -> ProgressBar {
        let target = if self.talks { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let template = format!(
            "{{msg:20}} [{{bar:32}}] {{percent:>3}} %  {{human_pos}} of {{human_len}} {unit}, {{eta}} left"
        );
        let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::with_draw_target(Some(total), target)
            .with_style(style.progress_chars("█▌ "))
            .with_finish(ProgressFinish::AndClear)
    }

    /// A remark for a person watching; nothing when piped or quiet.
    pub fn remark(&self, text: &str) {
        if self.talks {
            // A terminal that is gone has nobody to tell.
            let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("{text}\n"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_left_at_once_before_it_writes_and_when_asked_twice() {
        let (loading, writing) = (Session::new(true), Session::new(true));
        writing.begin_writing();
        assert!(loading.canceller()(130));
        let ask = writing.canceller();
        assert_eq!(writing.exit_code(&Error::Interrupted), 130);
        assert!(!ask(143));
        assert!(writing.cancel().load(Ordering::Relaxed));
        assert_eq!(writing.exit_code(&Error::Interrupted), 143);
        assert!(ask(130));
    }
}
