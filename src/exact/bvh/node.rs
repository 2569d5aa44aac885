//! What a wide tree is made of: eight boxes or eight triangles side by side, sifted in f32.
//!
//! ```text
//!   Node     low x  │ b₀ b₁ b₂ b₃ b₄ b₅ b₆ b₇ │        Leaf   corner 0 x  │ t₀ t₁ t₂ t₃ t₄ t₅ t₆ t₇ │
//!            low y  │ ·  ·  ·  ·  ·  ·  ·  ·  │               corner 0 y  │ ·  ·  ·  ·  ·  ·  ·  ·  │
//!             …                                                 …
//!            child  │ node or leaf, each      │               face        │ its number, each        │
//! ```

use super::local::LocalLine;
use crate::geometry::Bounds;

/// Boxes or triangles side by side: one wide register of f32.
pub(super) const LANES: usize = 8;

/// A row: one number of each lane.
type Row = [f32; LANES];

/// Eight boxes of children. A lane without a child has a box that no line meets.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Node {
    low: [Row; 3],
    high: [Row; 3],
    pub children: [Child; LANES],
}

/// A node or a leaf, by its number.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Child(u32);

/// Marks a leaf.
const LEAF: u32 = 1 << 31;

impl Child {
    pub fn node(index: usize) -> Self {
        Self(index as u32)
    }

    pub fn leaf(index: usize) -> Self {
        Self(index as u32 | LEAF)
    }

    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & LEAF != 0
    }

    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & !LEAF) as usize
    }
}

impl Node {
    pub const EMPTY: Self = Self {
        low: [[f32::INFINITY; LANES]; 3],
        high: [[f32::NEG_INFINITY; LANES]; 3],
        children: [Child(0); LANES],
    };

    /// Gives a lane its child; `bounds` are in the body's frame and are rounded outwards.
    pub fn set(&mut self, lane: usize, bounds: &Bounds, child: Child) {
        for axis in 0..3 {
            self.low[axis][lane] = below(bounds.min[axis]);
            self.high[axis][lane] = above(bounds.max[axis]);
        }
        self.children[lane] = child;
    }

    /// The lanes whose boxes `line` may meet, a bit each (Ize 2013, <https://jcgt.org/published/0002/02/02/>; here the
    /// rounding is in the line's margin).
    #[inline(always)]
    pub fn sift(&self, line: &LocalLine) -> u32 {
        let mut enter = [f32::NEG_INFINITY; LANES];
        let mut leave = [f32::INFINITY; LANES];
        for axis in 0..3 {
            let (near, far) = if line.backwards[axis] {
                (&self.high[axis], &self.low[axis])
            } else {
                (&self.low[axis], &self.high[axis])
            };
            let (before, behind, inverse) = (line.before[axis], line.behind[axis], line.inverse[axis]);
            for i in 0..LANES {
                enter[i] = greater((near[i] - before) * inverse, enter[i]);
                leave[i] = lesser((far[i] - behind) * inverse, leave[i]);
            }
        }
        !signs(std::array::from_fn(|i| leave[i] - enter[i])) & ALL
    }
}

/// Eight triangles, in the body's frame. A lane without a face repeats the first.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Leaf {
    corners: [[Row; 3]; 3],
    pub faces: [u32; LANES],
    /// The longest side of the triangles' box.
    size: f32,
    /// The lanes that have faces, a bit each.
    used: u32,
}

impl Leaf {
    /// Of at most eight faces with these corners.
    pub fn of(faces: &[u32], corners: impl Fn(u32) -> [[f64; 3]; 3], size: f64) -> Self {
        let mut leaf = Self {
            corners: Default::default(),
            faces: [0; LANES],
            size: above(size),
            used: (1 << faces.len()) - 1,
        };
        for (lane, &face) in faces.iter().enumerate().take(LANES) {
            leaf.faces[lane] = face;
            for (rows, corner) in leaf.corners.iter_mut().zip(corners(face)) {
                for axis in 0..3 {
                    rows[axis][lane] = corner[axis] as f32;
                }
            }
        }
        leaf
    }

    /// The lanes whose triangles `line` may meet, a bit each: all but those that have it clearly on the left of one edge
    /// and clearly on the right of another.
    ///
    /// A corner's coordinates across the line are no larger than twice the box's longest side and a few margins, L, as
    /// the line meets the box. Each is off by no more than the margin m, so a cross product of two is off by 4mL + 2m², and by γ₂ of 2L²
    /// in f32, which with L ≤ 4 is less than 1.1 mL: together less than 6m(L + m).
    #[inline(always)]
    pub fn sift(&self, line: &LocalLine) -> u32 {
        let [x, y, z] = line.axes;
        let mut across = [[[0.0; LANES]; 2]; 3];
        for (p, corner) in across.iter_mut().zip(&self.corners) {
            let (px, py, pz) = (&corner[x], &corner[y], &corner[z]);
            for i in 0..LANES {
                let depth = pz[i] - line.origin[z];
                p[0][i] = (px[i] - line.origin[x]) - line.slopes[0] * depth;
                p[1][i] = (py[i] - line.origin[y]) - line.slopes[1] * depth;
            }
        }
        let [a, b, c] = &across;
        // L = 2 · size + 6 margins.
        let doubt = 12.0 * line.margin * (self.size + 4.0 * line.margin);
        let mut held = [0.0; LANES];
        for i in 0..LANES {
            let of_c = a[0][i] * b[1][i] - a[1][i] * b[0][i];
            let of_a = b[0][i] * c[1][i] - b[1][i] * c[0][i];
            let of_b = c[0][i] * a[1][i] - c[1][i] * a[0][i];
            let least = lesser(lesser(of_a, of_b), of_c);
            let greatest = greater(greater(of_a, of_b), of_c);
            held[i] = greater(least + doubt, doubt - greatest);
        }
        self.used & !signs(held)
    }
}

/// All lanes.
const ALL: u32 = (1 << LANES) - 1;

/// The signs of a row, a bit for each lane: what compilers know as one instruction.
#[inline(always)]
fn signs(row: Row) -> u32 {
    let mut bits = 0;
    for (i, x) in row.iter().enumerate() {
        bits |= (x.to_bits() >> 31) << i;
    }
    bits
}

/// The greater of two numbers, as one instruction: what becomes of NaN is of no matter here.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lesser of two numbers.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greatest f32 that is not above `x`.
fn below(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}

/// The least f32 that is not below `x`.
fn above(x: f64) -> f32 {
    -below(-x)
}
