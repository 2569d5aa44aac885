//! The `chordfield` command.

fn main() {}
