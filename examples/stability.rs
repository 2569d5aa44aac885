//! Bodies and rays that are hard on purpose, by every exact engine, against exact rationals: the table of
//! `chordfield::modes::stability`.
//!
//! `cargo run --release --example stability > src/modes/stability/table.md`, or with a number of rays in all, and a seed:
//! `-- 1e8 2`. How many there were is told at the end; one that is lost, or a length that rounding does not explain, is an error.

use std::io::Write;

use chordfield::Error;
use chordfield::modes::Control;
use chordfield::modes::stability::{Effort, HARD_BODIES, sweep, table, totals};

fn main() -> chordfield::Result<()> {
    let refused =
        |problem: &str| Error::input("stability", problem, "give a number of rays and a seed, as `1e8 2`");
    let bodies = HARD_BODIES
        .iter()
        .map(|hard| Ok((hard.name, hard.body().map_err(|fault| refused(&fault.to_string()))?)))
        .collect::<chordfield::Result<Vec<_>>>()?;
    let mut words = std::env::args().skip(1);
    let rays = words.next().map(|word| word.parse::<f64>().map_err(|_| refused("that is no number")));
    let seed = words.next().map(|word| word.parse().map_err(|_| refused("that is no seed"))).transpose()?;
    let seed = seed.unwrap_or(Effort::default().seed);
    let effort = match rays.transpose()? {
        None => Effort::default(),
        Some(rays) => Effort::aiming(rays as u64, bodies.iter().map(|(_, body)| body), seed),
    };
    let mut found = Vec::new();
    for (name, body) in &bodies {
        found.extend(sweep(name, body, effort, &Control::none())?);
    }
    let text = format!("{}\n{}", table(&found), totals(&found));
    std::io::stdout()
        .write_all(text.as_bytes())
        .map_err(|e| Error::io("write", "standard output".as_ref(), e))?;
    match found.iter().all(|found| found.figures.lost == 0 && found.figures.beyond == 0) {
        true => Ok(()),
        false => Err(Error::input("stability", "rays are lost, or lengths disagree", "see the table")),
    }
}
