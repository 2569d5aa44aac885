//! Numbers that are made when they are asked for first.

use std::sync::atomic::{AtomicU64, Ordering};

/// Not a number until it is made. Whoever makes it, it is a function of what it stands for: threads
/// that ask at once make the same.
pub struct Lazy(AtomicU64);

impl Default for Lazy {
    fn default() -> Self {
        Self(AtomicU64::new(f64::NAN.to_bits()))
    }
}

impl Lazy {
    /// So many, none of them made.
    pub fn many(n: usize) -> Vec<Self> {
        (0..n).map(|_| Self::default()).collect()
    }

    /// What it is, made by `make` if nobody asked before.
    #[inline]
    pub fn get(&self, make: impl FnOnce() -> f64) -> f64 {
        let known = f64::from_bits(self.0.load(Ordering::Relaxed));
        if !known.is_nan() {
            return known;
        }
        let made = make();
        self.0.store(made.to_bits(), Ordering::Relaxed);
        made
    }
}
