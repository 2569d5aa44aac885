//! Times of several rounds: the program's own, and criterion's.

use std::time::Duration;

pub use chordfield::modes::bench::Samples;
use criterion::Criterion;

/// Ten samples of each: an iteration is a whole image, or thousands of lines.
pub fn few_samples() -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
}
