//! From each organ's chords along one ray to the stretches of path that belong to one organ alone.
//!
//! ```text
//! trunk   |───────────────────────|
//! liver        |────────|
//! tumour          |──|
//! own     trunk| liver |tumour|liver| trunk      the deepest organ owns the path
//! ```

use crate::geometry::Interval;
use crate::physics::Stretch;

/// The share of the distance from the source below which a piece of path is rounding: chord ends err by γ₈ of the
/// distance over the cosine at the face, so by less than this wherever a face is seen 10⁻⁶ from edge-on or steeper.
const ROUNDING_SHARE: f64 = 1e-9;

/// Orders the chords of one ray by entry and gives each piece of path to the deepest organ there.
///
/// `chords` holds organ indices and their chords, mm, in any order; `depth` tells how many organs enclose one. Pieces of
/// one organ that touch are joined. Pieces shorter than rounding, as between the flush surfaces of a parent and its
/// child, are left out: they would count as crossings. The result is in `own`, in order and disjoint.
pub fn own_stretches(
    chords: &[(usize, Interval)],
    depth: impl Fn(usize) -> usize,
    stops: &mut Vec<f64>,
    own: &mut Vec<Stretch>,
) {
    own.clear();
    stops.clear();
    stops.extend(chords.iter().flat_map(|(_, c)| [c.start(), c.end()]));
    stops.sort_unstable_by(f64::total_cmp);
    stops.dedup();
    for ends in stops.windows(2) {
        let (start, end) = (ends[0], ends[1]);
        let covering = chords.iter().filter(|(_, c)| c.start() <= start && end <= c.end());
        let Some(&(organ, _)) = covering.max_by_key(|(organ, _)| (depth(*organ), *organ)) else { continue };
        let rounding_mm = ROUNDING_SHARE * start.abs().max(end.abs());
        if end - start <= rounding_mm {
            continue;
        }
        match own.last_mut() {
            Some(last) if last.organ == organ && start - last.exit_mm <= rounding_mm => last.exit_mm = end,
            _ => own.push(Stretch { organ, entry_mm: start, exit_mm: end }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(chords: &[(usize, f64, f64)], depths: &[usize]) -> Vec<(usize, f64, f64)> {
        let chords: Vec<_> =
            chords.iter().map(|&(o, a, b)| (o, Interval::new(a, b).expect("ordered"))).collect();
        let mut stretches = Vec::new();
        own_stretches(&chords, |o| depths[o], &mut Vec::new(), &mut stretches);
        stretches.iter().map(|s| (s.organ, s.entry_mm, s.exit_mm)).collect()
    }

    #[test]
    fn the_deepest_organ_owns_the_path() {
        let chords = [(2, 4.0, 5.0), (0, 0.0, 10.0), (1, 2.0, 7.0)];
        let expected = [(0, 0.0, 2.0), (1, 2.0, 4.0), (2, 4.0, 5.0), (1, 5.0, 7.0), (0, 7.0, 10.0)];
        assert_eq!(own(&chords, &[0, 1, 2]), expected);
    }

    #[test]
    fn organs_face_to_face_follow_each_other_and_gaps_belong_to_none() {
        let chords = [(1, 3.0, 5.0), (0, 1.0, 3.0), (2, 6.0, 7.0)];
        assert_eq!(own(&chords, &[0, 0, 0]), [(0, 1.0, 3.0), (1, 3.0, 5.0), (2, 6.0, 7.0)]);
        assert_eq!(own(&[], &[]), []);
    }

    #[test]
    fn a_child_flush_with_its_parent_leaves_it_nothing_there() {
        assert_eq!(own(&[(0, 0.0, 4.0), (1, 0.0, 3.0)], &[0, 1]), [(1, 0.0, 3.0), (0, 3.0, 4.0)]);
    }

    #[test]
    fn slivers_of_rounding_are_no_crossings() {
        let e = 1e-12;
        let flush = own(&[(0, 1000.0, 1010.0), (1, 1000.0 + e, 1010.0 - e)], &[0, 1]);
        assert_eq!(flush, [(1, 1000.0 + e, 1010.0 - e)]);
        let touched = own(&[(0, 1000.0, 1010.0), (1, 1005.0, 1005.0 + e)], &[0, 1]);
        assert_eq!(touched, [(0, 1000.0, 1010.0)]);
    }
}
