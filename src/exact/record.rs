//! What is kept of the crossings of many rays with one surface, and no more: engines are generic over it, so a caller who
//! wants lengths pays for lengths.
//!
//! | record | per ray |
//! |---|---|
//! | [`Lengths`] | the length within the body |
//! | [`Spans`] | every entry and exit |
//! | [`Pierced`] | every face gone through |

use crate::geometry::Interval;

/// Which way a ray goes through a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Way {
    /// Out of the body.
    Out,
    /// Into the body.
    In,
}

/// Takes the crossings of numbered rays with a surface.
///
/// Engines report each crossing once, those of one ray in any order, and cut to the ray's segment: a source inside the
/// body is an entry at 0. Entries and exits of a ray are as many.
pub trait Record {
    /// Whether the faces gone through are asked for. If not, an engine that would have to look for them reports any.
    const ASKS_FACES: bool;

    /// Whether places of crossings are asked for, and not only lengths.
    const ASKS_ENDS: bool = true;

    /// Ray `ray` goes through `face`, `t_mm` from its source.
    fn crossing(&mut self, ray: usize, t_mm: f64, face: u32, way: Way);

    /// The rays from `first` on go through one face, at these places.
    fn run(&mut self, first: usize, t_mm: &[f64], face: u32, way: Way) {
        for (i, &t) in t_mm.iter().enumerate() {
            self.crossing(first + i, t, face, way);
        }
    }

    /// The rays from `first` on pass so, through faces that are not told.
    fn passes(&mut self, first: usize, passes: &Passes) {
        let [entries, exits] = passes.ends_mm;
        for (i, (&entry, &exit)) in entries.iter().zip(exits).enumerate().filter(|(_, (a, b))| a < b) {
            self.crossing(first + i, entry, 0, Way::In);
            self.crossing(first + i, exit, 0, Way::Out);
        }
    }
}

/// Rays that go through a body once at most, one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Passes<'a> {
    /// The length within the body, mm. None for those that miss.
    pub lengths_mm: &'a [f64],
    /// Where they enter, mm from the source, and where they leave: not the entry before the exit for those that miss. Empty
    /// unless [asked for](Record::ASKS_ENDS).
    pub ends_mm: [&'a [f64]; 2],
}

/// Adds each ray's length within the body to its entry, mm.
///
/// Of single crossings the sum is Σ t over exits less Σ t over entries, so its error grows with the distance from the
/// source: γₙ · Σ|t| for n crossings.
#[derive(Debug)]
pub struct Lengths<'a>(pub &'a mut [f64]);

impl Record for Lengths<'_> {
    const ASKS_FACES: bool = false;
    const ASKS_ENDS: bool = false;

    #[inline]
    fn crossing(&mut self, ray: usize, t_mm: f64, _face: u32, way: Way) {
        // Without a branch: the faces of an image's front and back come in no order that could be foreseen.
        let sign = u64::from(way == Way::In) << 63;
        self.0[ray] += f64::from_bits(t_mm.to_bits() ^ sign);
    }

    #[inline]
    fn run(&mut self, first: usize, t_mm: &[f64], _face: u32, way: Way) {
        let lengths = self.0[first..first + t_mm.len()].iter_mut().zip(t_mm);
        match way {
            Way::Out => lengths.for_each(|(length, t)| *length += t),
            Way::In => lengths.for_each(|(length, t)| *length -= t),
        }
    }

    #[inline]
    fn passes(&mut self, first: usize, passes: &Passes) {
        let lengths = self.0[first..first + passes.lengths_mm.len()].iter_mut();
        lengths.zip(passes.lengths_mm).for_each(|(length, of_pass)| *length += of_pass);
    }
}

/// Keeps every entry and exit.
#[derive(Clone, Debug, Default)]
pub struct Spans {
    /// Ray, place and way.
    ends: Vec<(u32, f64, Way)>,
}

impl Record for Spans {
    const ASKS_FACES: bool = false;

    #[inline]
    fn crossing(&mut self, ray: usize, t_mm: f64, _face: u32, way: Way) {
        self.ends.push((ray as u32, t_mm, way));
    }
}

/// Both of two records.
impl<A: Record, B: Record> Record for (A, B) {
    const ASKS_FACES: bool = A::ASKS_FACES || B::ASKS_FACES;
    const ASKS_ENDS: bool = A::ASKS_ENDS || B::ASKS_ENDS;

    #[inline]
    fn crossing(&mut self, ray: usize, t_mm: f64, face: u32, way: Way) {
        self.0.crossing(ray, t_mm, face, way);
        self.1.crossing(ray, t_mm, face, way);
    }

    #[inline]
    fn run(&mut self, first: usize, t_mm: &[f64], face: u32, way: Way) {
        self.0.run(first, t_mm, face, way);
        self.1.run(first, t_mm, face, way);
    }

    #[inline]
    fn passes(&mut self, first: usize, passes: &Passes) {
        self.0.passes(first, passes);
        self.1.passes(first, passes);
    }
}

impl<R: Record> Record for &mut R {
    const ASKS_FACES: bool = R::ASKS_FACES;
    const ASKS_ENDS: bool = R::ASKS_ENDS;

    #[inline]
    fn crossing(&mut self, ray: usize, t_mm: f64, face: u32, way: Way) {
        (**self).crossing(ray, t_mm, face, way);
    }

    #[inline]
    fn run(&mut self, first: usize, t_mm: &[f64], face: u32, way: Way) {
        (**self).run(first, t_mm, face, way);
    }

    #[inline]
    fn passes(&mut self, first: usize, passes: &Passes) {
        (**self).passes(first, passes);
    }
}

impl Spans {
    /// The parts of the rays in the body, by ray, then in order along it; parts without length are left out. Ready for the
    /// next body afterwards.
    pub fn drain(&mut self, mut part: impl FnMut(usize, Interval)) {
        // Where one part ends as the next begins, the exit comes first.
        self.ends.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        for of_ray in self.ends.chunk_by(|a, b| a.0 == b.0) {
            let (mut depth, mut start) = (0, 0.0);
            for &(ray, t, way) in of_ray {
                let before = depth;
                depth += if way == Way::In { 1 } else { -1 };
                if (before, depth) == (0, 1) {
                    start = t;
                } else if (before, depth) == (1, 0)
                    && let Some(whole) = Interval::new(start, t).filter(|part| part.length() > 0.0)
                {
                    part(ray as usize, whole);
                }
            }
        }
        self.ends.clear();
    }
}

/// A face gone through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pierce {
    /// The ray's number.
    pub ray: u32,
    /// Where, mm from its source.
    pub t_mm: f64,
    /// The face's index in the surface's mesh.
    pub face: u32,
    /// Which way.
    pub way: Way,
}

/// Keeps every face gone through, in the order reported.
#[derive(Clone, Debug, Default)]
pub struct Pierced(pub Vec<Pierce>);

impl Record for Pierced {
    const ASKS_FACES: bool = true;

    #[inline]
    fn crossing(&mut self, ray: usize, t_mm: f64, face: u32, way: Way) {
        self.0.push(Pierce { ray: ray as u32, t_mm, face, way });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_in_any_order_make_parts_in_order() {
        let mut spans = Spans::default();
        let all = [
            (1, 9.0, Way::Out),
            (1, 2.0, Way::In),
            (0, 3.0, Way::In),
            (1, 5.0, Way::Out),
            (0, 4.0, Way::Out),
        ];
        for (ray, t, way) in all {
            spans.crossing(ray, t, 0, way);
        }
        // The second part begins where the first ends.
        spans.crossing(1, 5.0, 0, Way::In);
        let mut parts = Vec::new();
        spans.drain(|ray, part| parts.push((ray, part.start(), part.end())));
        assert_eq!(parts, [(0, 3.0, 4.0), (1, 2.0, 5.0), (1, 5.0, 9.0)]);
        spans.drain(|_, _| panic!("already drained"));
    }

    #[test]
    fn a_run_of_lengths_is_the_sum_of_its_crossings() {
        let mut lengths = [0.0; 4];
        let mut record = Lengths(&mut lengths);
        record.run(1, &[2.0, 3.0], 0, Way::In);
        record.run(1, &[7.0, 8.0], 0, Way::Out);
        record.crossing(3, 1.0, 0, Way::Out);
        assert_eq!(lengths, [0.0, 5.0, 5.0, 1.0]);
    }
}
