//! How wide the instructions are: the one place where the machine is asked.
//!
//! A program made for all machines takes the wider instructions of the one it runs on. None of them changes a bit: every
//! operation is rounded by itself. So that this can be tested, and a strange result be held against the baseline, the
//! environment variable `CHORDFIELD_DISPATCH` turns it off: `baseline` takes what every machine of the kind has, `auto`, the
//! default, the widest.

use std::sync::OnceLock;

use crate::error::{Error, Result};

const VARIABLE: &str = "CHORDFIELD_DISPATCH";

/// The instructions that all inner loops use: the same for the whole run.
#[inline]
pub(crate) fn arch() -> pulp::Arch {
    static ARCH: OnceLock<pulp::Arch> = OnceLock::new();
    *ARCH.get_or_init(|| if asked_for_baseline() { pulp::Arch::Scalar } else { pulp::Arch::new() })
}

/// In words, for a report on the machine.
pub(crate) fn name() -> &'static str {
    match arch() {
        pulp::Arch::Scalar => "the baseline's",
        #[cfg(target_arch = "x86_64")]
        pulp::Arch::V3(_) => "AVX2",
        #[allow(unreachable_patterns)]
        _ => "the machine's widest",
    }
}

fn asked_for_baseline() -> bool {
    std::env::var_os(VARIABLE).is_some_and(|value| value == "baseline")
}

/// Refuses a value of the variable that means nothing.
///
/// # Errors
/// Input, with the values that mean something.
pub(crate) fn check() -> Result<()> {
    match std::env::var_os(VARIABLE) {
        Some(value) if value != "baseline" && value != "auto" => Err(Error::input(
            VARIABLE,
            format!("`{}` means nothing", value.display()),
            "set it to `baseline` or `auto`, or not at all",
        )),
        _ => Ok(()),
    }
}
