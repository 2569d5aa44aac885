//! Bodies and rays that are hard on purpose, by every exact engine, against exact rationals: the table of
//! `chordfield::modes::stability`.
//!
//! `cargo run --release --example stability > src/modes/stability/table.md`, or with a number of rays in all, and a seed:
//! `-- 1e8 2`.

use std::io::Write;

use chordfield::Error;
use chordfield::modes::Control;
use chordfield::modes::stability::{Case, Effort, HARD_BODIES, sweep, table};

fn main() -> chordfield::Result<()> {
    let refused =
        |problem: &str| Error::input("stability", problem, "give a number of rays and a seed, as `1e8 2`");
    let mut effort = Effort::default();
    if let Some(words) = std::env::args().nth(2) {
        effort.seed = words.parse().map_err(|_| refused("that is no seed"))?;
    }
    if let Some(words) = std::env::args().nth(1) {
        let rays: f64 = words.parse().map_err(|_| refused("that is no number"))?;
        effort.rays = (rays / (HARD_BODIES.len() * Case::ALL.len()) as f64).ceil() as u64;
    }
    let mut found = Vec::new();
    for hard in HARD_BODIES {
        let body = hard.body().map_err(|fault| refused(&fault.to_string()))?;
        found.extend(sweep(hard.name, &body, effort, &Control::none())?);
    }
    std::io::stdout()
        .write_all(table(&found).as_bytes())
        .map_err(|e| Error::io("write", "standard output".as_ref(), e))
}
