//! Lines in no order, some of them at a time: their ways to memory overlap, where each line on its own would wait for its own.

use super::{ChordLeaf, SquaredChord};
use crate::geometry::Line;
use crate::linespace::PlanePair;
use crate::ritree::{Cache, FittedTree};

/// Lines that are looked up together.
const TOGETHER: usize = 32;

/// What answers a line: its leaf, and its place there.
pub type Asked<'l> = (&'l ChordLeaf, PlanePair, &'l [f64; 4]);

impl SquaredChord<'_> {
    /// Asks `tree` for the leaf of each of some lines; `ask` is told which line, and what answers it: nothing if it passes the
    /// body's box by. Answers are those of single lines, and come in no order.
    pub fn ask_all<'l>(
        tree: &FittedTree<Self>,
        lines: impl IntoIterator<Item = (usize, &'l Line)>,
        cache: &Cache,
        mut ask: impl FnMut(usize, &Line, Option<Asked>),
    ) {
        let mut waiting = Vec::with_capacity(TOGETHER);
        let mut places = Vec::with_capacity(TOGETHER);
        let mut answer = |waiting: &mut Vec<(usize, &Line)>, places: &mut Vec<(PlanePair, [f64; 4])>| {
            tree.ask_all(places, cache, |i, leaf| {
                let ((number, line), (pair, stuv)) = (waiting[i], &places[i]);
                ask(number, line, Some((leaf, *pair, stuv)));
            });
            waiting.clear();
            places.clear();
        };
        let mut past = Vec::new();
        for (number, line) in lines {
            let Some(place) = tree.fit().place_of(line) else {
                past.push((number, line));
                continue;
            };
            waiting.push((number, line));
            places.push(place);
            if waiting.len() == TOGETHER {
                answer(&mut waiting, &mut places);
            }
        }
        answer(&mut waiting, &mut places);
        past.into_iter().for_each(|(number, line)| ask(number, line, None));
    }
}
