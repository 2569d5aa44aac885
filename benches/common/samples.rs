//! Times of several rounds: the program's own.

pub use chordfield::modes::bench::Samples;
