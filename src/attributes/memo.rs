//! Samples that are asked for again.

use std::sync::{Mutex, OnceLock, PoisonError};

use crate::linespace::LinePoint;

/// The samples remembered, at most: less than a megabyte of exit rays, made when the first line is sampled. They stand beside
/// the cache of nodes, and do not grow.
const PLACES: usize = 1 << 12;

type Place<T> = Mutex<Option<(LinePoint, T)>>;

/// The latest samples of lines, each in the one place that its line's bits say: of cells that touch, but are no halves of
/// one, corners are the same lines. What is sampled is a pure function of the line, so it does not matter which threads
/// remember what.
pub struct Memo<T> {
    places: OnceLock<Vec<Place<T>>>,
}

impl<T> Default for Memo<T> {
    fn default() -> Self {
        Self { places: OnceLock::new() }
    }
}

impl<T: Clone> Memo<T> {
    /// Bytes that it holds once it is used, beside any cache: they do not grow.
    pub const BYTES: usize = PLACES * size_of::<Place<T>>();

    /// The line's sample, remembered or made by `sample`.
    pub fn recall(&self, line: LinePoint, sample: impl FnOnce() -> T) -> T {
        self.get(&line).unwrap_or_else(|| self.put(line, sample()))
    }

    /// The line's sample, if it is remembered.
    pub fn get(&self, line: &LinePoint) -> Option<T> {
        let place = self.place(line).lock().unwrap_or_else(PoisonError::into_inner);
        place.as_ref().filter(|(known, _)| known == line).map(|(_, output)| output.clone())
    }

    /// Remembers a line's sample, and returns it.
    pub fn put(&self, line: LinePoint, output: T) -> T {
        *self.place(&line).lock().unwrap_or_else(PoisonError::into_inner) = Some((line, output.clone()));
        output
    }

    fn place(&self, line: &LinePoint) -> &Place<T> {
        let places = self.places.get_or_init(|| (0..PLACES).map(|_| Mutex::new(None)).collect());
        &places[place_of(line)]
    }
}

/// splitmix64's last step over the line's bits.
fn place_of(line: &LinePoint) -> usize {
    let mix = |hash: u64, x: f64| {
        let z = (hash ^ x.to_bits()).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    };
    line.stuv.iter().fold(line.pair.index() as u64, |hash, &x| mix(hash, x)) as usize % PLACES
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linespace::PlanePair;

    #[test]
    fn a_line_is_sampled_once_and_every_line_gets_its_own_sample() {
        let (memo, mut taken) = (Memo::<f64>::default(), 0);
        for round in 0..2 {
            for i in 0..3 * PLACES {
                let line = LinePoint { pair: PlanePair::ALL[i % 6], stuv: [i as f64, 0.5, -1.0, 2.0] };
                let value = memo.recall(line, || {
                    taken += 1;
                    i as f64
                });
                assert_eq!(value, i as f64, "round {round}");
            }
        }
        // More lines than places: each is remembered until another takes its place.
        assert!(taken > 3 * PLACES && taken < 6 * PLACES, "{taken}");
        let line = LinePoint { pair: PlanePair::ALL[0], stuv: [0.25; 4] };
        assert_eq!(memo.recall(line, || 1.0), memo.recall(line, || panic!("it is remembered")));
    }
}
