//! Bodies and rays that are hard on purpose, by every exact engine, against exact rationals: the table of
//! `chordfield::modes::stability`.
//!
//! `cargo run --release --example stability > src/modes/stability/table.md`, or with a number of rays in all: `-- 1e8`.

use std::io::Write;

use chordfield::Error;
use chordfield::modes::Control;
use chordfield::modes::stability::{Case, Effort, hard_bodies, sweep, table};

fn main() -> chordfield::Result<()> {
    let refused = |problem: &str| Error::input("stability", problem, "give a number of rays, as `1e8`");
    let bodies = hard_bodies().map_err(|fault| refused(&fault.to_string()))?;
    let mut effort = Effort::default();
    if let Some(words) = std::env::args().nth(1) {
        let rays: f64 = words.parse().map_err(|_| refused("that is no number"))?;
        effort.rays = (rays / (bodies.len() * Case::ALL.len()) as f64).ceil() as u64;
    }
    let found = bodies.iter().map(|hard| sweep(hard.name, &hard.body, effort, &Control::none()));
    let found = found.collect::<chordfield::Result<Vec<_>>>()?.concat();
    std::io::stdout()
        .write_all(table(&found).as_bytes())
        .map_err(|e| Error::io("write", "standard output".as_ref(), e))
}
