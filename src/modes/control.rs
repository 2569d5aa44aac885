//! How a long run is watched and stopped.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

/// A run's ties to whoever started it: a flag to stop it, and a call for each piece of work done.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    cancel: &'a AtomicBool,
    progress: &'a (dyn Fn(u64) + Sync),
}

/// The flag of runs that nothing stops.
static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Control<'a> {
    /// A run that stops soon after `cancel` is set, and calls `progress` with the number of rays just done.
    pub fn new(cancel: &'a AtomicBool, progress: &'a (dyn Fn(u64) + Sync)) -> Self {
        Self { cancel, progress }
    }

    /// A run that goes to its end and tells nobody.
    pub fn none() -> Self {
        Self { cancel: &NEVER, progress: &|_| {} }
    }

    /// The same flag to stop by, for work whose progress is told otherwise.
    pub fn without_progress(&self) -> Self {
        Self { progress: &|_| {}, ..*self }
    }

    /// # Errors
    /// [`Error::Interrupted`] once the run was asked to stop.
    pub fn check(&self) -> Result<()> {
        if self.cancel.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// Tells that `rays` more rays are done.
    pub fn advance(&self, rays: u64) {
        (self.progress)(rays);
    }
}
