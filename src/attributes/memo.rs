//! Samples that are asked for again.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use crate::linespace::LinePoint;

/// The samples remembered, at most: little more than a megabyte of exit rays, made when the first line is sampled. They stand beside the cache of
/// nodes, and do not grow.
const PLACES: usize = 1 << 13;

/// The two latest samples of the lines whose bits say this pair of places, the latest first.
type Pair<T> = Mutex<[Option<(LinePoint, T)>; 2]>;

/// The latest samples of lines, each in one of the two places that its line's bits say: of cells that touch, but are no halves of
/// one, corners are the same lines. What is sampled is a pure function of the line, so it does not matter which threads
/// remember what.
pub struct Memo<T> {
    pairs: OnceLock<Vec<Pair<T>>>,
}

impl<T> Default for Memo<T> {
    fn default() -> Self {
        Self { pairs: OnceLock::new() }
    }
}

impl<T: Clone> Memo<T> {
    /// Bytes that it holds once it is used, beside any cache: they do not grow.
    pub const BYTES: usize = PLACES / 2 * size_of::<Pair<T>>();

    /// The line's sample, remembered or made by `sample`.
    pub fn recall(&self, line: LinePoint, sample: impl FnOnce() -> T) -> T {
        self.get(&line).unwrap_or_else(|| self.put(line, sample()))
    }

    /// The line's sample, if it is remembered.
    pub fn get(&self, line: &LinePoint) -> Option<T> {
        let mut pair = self.lock(line);
        let is_it = |place: &Option<(LinePoint, T)>| place.as_ref().is_some_and(|(known, _)| known == line);
        if !is_it(&pair[0]) {
            if !is_it(&pair[1]) {
                return None;
            }
            pair.swap(0, 1);
        }
        pair[0].as_ref().map(|(_, output)| output.clone())
    }

    /// Remembers a line's sample, and returns it.
    pub fn put(&self, line: LinePoint, output: T) -> T {
        let mut pair = self.lock(&line);
        // What is known of a line takes the place of what was known of it before.
        if pair[0].as_ref().is_none_or(|(known, _)| *known != line) {
            pair.swap(0, 1);
        }
        pair[0] = Some((line, output.clone()));
        output
    }

    fn lock(&self, line: &LinePoint) -> MutexGuard<'_, [Option<(LinePoint, T)>; 2]> {
        let pairs = self.pairs.get_or_init(|| (0..PLACES / 2).map(|_| Mutex::new([None, None])).collect());
        pairs[pair_of(line)].lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// splitmix64's last step over the line's bits.
fn pair_of(line: &LinePoint) -> usize {
    let mix = |hash: u64, x: f64| {
        let z = (hash ^ x.to_bits()).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    };
    line.stuv.iter().fold(line.pair.index() as u64, |hash, &x| mix(hash, x)) as usize % (PLACES / 2)
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
