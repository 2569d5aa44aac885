//! Lines in no order, some of them at a time: they are placed in wide arithmetic, and their ways to memory overlap, where each line
//! on its own would wait for its own.

use pulp::{Simd, WithSimd};

use super::{ChordLeaf, SquaredChord, may_meet};
use crate::geometry::Line;
use crate::linespace::{LineFrame, PlanePair};
use crate::ritree::{Cache, FittedTree};

/// Lines that are looked up together.
const TOGETHER: usize = 64;

/// What answers a line: its leaf, and its place there.
pub type Asked<'l> = (&'l ChordLeaf, PlanePair, &'l [f64; 4]);

/// Lines as lists of their parts; those beyond the last line mean nothing.
struct Parts {
    origins: [[f64; TOGETHER]; 3],
    directions: [[f64; TOGETHER]; 3],
    axes: [u64; TOGETHER],
    intercepts: [[f64; TOGETHER]; 4],
}

struct Place<'p> {
    frame: &'p LineFrame,
    parts: &'p mut Parts,
}

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Parts { origins, directions, axes, intercepts } = self.parts;
        for i in 0..TOGETHER {
            let of_line = |parts: &[[f64; TOGETHER]; 3]| parts.each_ref().map(|part| part[i]);
            let (axis, stuv) = self.frame.place(of_line(origins), of_line(directions));
            axes[i] = axis;
            intercepts.iter_mut().zip(stuv).for_each(|(list, x)| list[i] = x);
        }
    }
}

impl SquaredChord<'_> {
    /// Asks `tree` for the leaf of each of some lines; `ask` is told which line, and what answers it: nothing if it passes the
    /// body's box by. Answers are those of single lines, and come in no order.
    pub fn ask_all<'l>(
        tree: &FittedTree<Self>,
        lines: impl IntoIterator<Item = (usize, &'l Line)>,
        cache: &Cache,
        mut ask: impl FnMut(usize, &Line, Option<Asked>),
    ) {
        let arch = crate::dispatch::arch();
        let mut lines = lines.into_iter();
        let mut parts = Parts {
            origins: [[0.0; TOGETHER]; 3],
            directions: [[0.0; TOGETHER]; 3],
            axes: [0; TOGETHER],
            intercepts: [[0.0; TOGETHER]; 4],
        };
        let mut taken = Vec::with_capacity(TOGETHER);
        let (mut waiting, mut places) = (Vec::with_capacity(TOGETHER), Vec::with_capacity(TOGETHER));
        loop {
            taken.clear();
            for (i, (number, line)) in lines.by_ref().take(TOGETHER).enumerate() {
                taken.push((number, line));
                let (o, d) = (line.origin(), line.dir());
                for a in 0..3 {
                    (parts.origins[a][i], parts.directions[a][i]) = (o[a], d[a]);
                }
            }
            if taken.is_empty() {
                return;
            }
            arch.dispatch(Place { frame: &tree.fit().frame, parts: &mut parts });
            waiting.clear();
            places.clear();
            for (i, &(number, line)) in taken.iter().enumerate() {
                let stuv = parts.intercepts.each_ref().map(|list| list[i]);
                if may_meet(&stuv) {
                    waiting.push((number, line));
                    places.push((LineFrame::pair(parts.axes[i] as usize), stuv));
                } else {
                    ask(number, line, None);
                }
            }
            tree.ask_all(&places, cache, |i, leaf| {
                let ((number, line), (pair, stuv)) = (waiting[i], &places[i]);
                ask(number, line, Some((leaf, *pair, stuv)));
            });
        }
    }
}
