//! The faces that the last rays of many rows went through, ready for rays from the same source: see [`cone`](super::cone).

use glam::DVec3;
use pulp::Simd;

use super::abreast::{ABREAST, MOST_STEPS, OfRays, ROUND};
use super::{Face, STEEP, Walker};

/// No ray's, as yet.
pub(super) const NONE: OfRays = [0.0; ABREAST];

/// The faces that rays go through in one way, one of each row.
pub(super) struct HeldFaces {
    /// −1 if rays enter through them, 1 if they leave.
    pub sign: f64,
    /// 4 · face + the edge that planes are counted from.
    pub half_edges: [u32; ABREAST],
    /// Normals, inward, of the planes through the source and each edge, by edge and axis.
    sides: [[OfRays; 3]; 3],
    normals: [OfRays; 3],
    /// Of the faces' planes over the source, mm.
    heights: OfRays,
    /// Those of the rays' directions with the normals of the sides.
    products: [OfRays; 3],
    /// Positive where the face is surely pierced, and not seen nearly edge-on.
    pub margins: OfRays,
    /// Where rays go through the faces' planes, in the unit of their directions.
    pub crossings: OfRays,
}

impl HeldFaces {
    pub fn new(sign: f64) -> Self {
        Self {
            sign,
            half_edges: [0; ABREAST],
            sides: [[NONE; 3]; 3],
            normals: [NONE; 3],
            heights: NONE,
            products: [NONE; 3],
            margins: NONE,
            crossings: NONE,
        }
    }

    /// Finds out which faces are pierced.
    #[inline(always)]
    pub fn look<S: Simd>(&mut self, simd: S, groups: usize, dirs: &[OfRays; 3], sizes: &OfRays, sure: f64) {
        for group in 0..groups {
            let dir = load_vector(simd, dirs, group);
            let product = |edge: usize| dot(simd, load_vector(simd, &self.sides[edge], group), dir);
            let products = [product(0), product(1), product(2)];
            let least = simd.min_f64s(simd.min_f64s(products[0], products[1]), products[2]);
            let doubt = simd.mul_f64s(simd.splat_f64s(sure), load(simd, sizes, group));
            store(simd, &mut self.margins, group, simd.sub_f64s(least, doubt));
            store_vector(simd, &mut self.products, group, products);
        }
    }

    /// Finds out where.
    #[inline(always)]
    pub fn cross<S: Simd>(&mut self, simd: S, groups: usize, dirs: &[OfRays; 3], sizes: &OfRays) {
        for group in 0..groups {
            let slope = dot(simd, load_vector(simd, &self.normals, group), load_vector(simd, dirs, group));
            let crossing = simd.div_f64s(load(simd, &self.heights, group), slope);
            store(simd, &mut self.crossings, group, crossing);
            let steep = simd.mul_f64s(simd.splat_f64s(STEEP), load(simd, sizes, group));
            let over = simd.sub_f64s(simd.mul_f64s(slope, simd.splat_f64s(self.sign)), steep);
            let margin = simd.min_f64s(load(simd, &self.margins, group), over);
            store(simd, &mut self.margins, group, margin);
        }
    }

    /// Walks to the face that a row's ray surely pierces; at the outline, and where that is in doubt, it stays where it is.
    #[inline(always)]
    pub fn walk(&mut self, walker: &Walker, source: DVec3, j: usize, dir: DVec3, sure: f64) {
        let mut at = Footing {
            half_edge: self.half_edges[j],
            corners: corners_from(walker, source, self.half_edges[j]),
            sides: [dir_of(&self.sides[0], j), dir_of(&self.sides[1], j), dir_of(&self.sides[2], j)],
        };
        let mut products = [self.products[0][j], self.products[1][j], self.products[2][j]];
        for _ in 0..MOST_STEPS {
            let edge = least_of(products);
            if products[edge] > -sure {
                break;
            }
            let next = at.beyond(walker, source, edge, self.sign);
            products = [next.sides[0].dot(dir), next.sides[1].dot(dir), next.sides[2].dot(dir)];
            let is_on = products[0] + products[1] + products[2] > 0.0;
            if !is_on {
                break;
            }
            at = next;
        }
        self.stand_on(walker, source, j, &at);
        self.margins[j] = products[least_of(products)] - sure;
    }

    /// Holds the face for a row.
    #[inline(always)]
    pub fn stand_on(&mut self, walker: &Walker, source: DVec3, j: usize, at: &Footing) {
        let Face { corners, normal, .. } = walker.faces[at.half_edge as usize / 4];
        self.half_edges[j] = at.half_edge;
        for (of_side, side) in self.sides.iter_mut().zip(at.sides) {
            set(of_side, j, side);
        }
        set(&mut self.normals, j, normal);
        self.heights[j] = normal.dot(walker.vertices[corners[0] as usize] - source);
    }
}

/// A face that a walk has come to.
#[derive(Clone, Copy)]
pub(super) struct Footing {
    /// 4 · face + the edge that corners and sides are counted from.
    half_edge: u32,
    /// From the source, mm.
    corners: [DVec3; 3],
    /// As of [`HeldFaces`].
    sides: [DVec3; 3],
}

impl Footing {
    pub fn new(walker: &Walker, source: DVec3, face: u32, sign: f64) -> Self {
        let corners = corners_from(walker, source, 4 * face);
        let [a, b, c] = corners;
        let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|side| sign * side);
        Self { half_edge: 4 * face, corners, sides }
    }

    /// The face beyond an edge, counted from that.
    #[inline(always)]
    fn beyond(&self, walker: &Walker, source: DVec3, edge: usize, sign: f64) -> Self {
        let Face { twins, apexes, .. } = &walker.faces[self.half_edge as usize / 4];
        let edge_of_face = ROUND[(self.half_edge as usize % 4 + edge).min(4)];
        let apex = walker.vertices[apexes[edge_of_face] as usize] - source;
        let (a, b) = (self.corners[ROUND[edge + 1]], self.corners[edge]);
        Self {
            half_edge: twins[edge_of_face],
            corners: [a, b, apex],
            sides: [-self.sides[edge], sign * b.cross(apex), sign * apex.cross(a)],
        }
    }
}

/// The corners of a face from the source, mm, counted from an edge.
#[inline(always)]
fn corners_from(walker: &Walker, source: DVec3, half_edge: u32) -> [DVec3; 3] {
    let corners = walker.faces[half_edge as usize / 4].corners;
    let first = half_edge as usize % 4;
    let corner = |i: usize| walker.vertices[corners[ROUND[(first + i).min(4)]] as usize] - source;
    [corner(0), corner(1), corner(2)]
}

/// Which of three is the least.
#[inline(always)]
fn least_of([s0, s1, s2]: [f64; 3]) -> usize {
    if s0 <= s1 && s0 <= s2 { 0 } else { 1 + usize::from(s2 < s1) }
}

/// The vector of a row.
#[inline(always)]
pub(super) fn dir_of(vectors: &[OfRays; 3], j: usize) -> DVec3 {
    DVec3::new(vectors[0][j], vectors[1][j], vectors[2][j])
}

#[inline(always)]
pub(super) fn set(vectors: &mut [OfRays; 3], j: usize, vector: DVec3) {
    (vectors[0][j], vectors[1][j], vectors[2][j]) = (vector.x, vector.y, vector.z);
}

#[inline(always)]
pub(super) fn load<S: Simd>(_: S, of_rows: &OfRays, group: usize) -> S::f64s {
    S::as_simd_f64s(of_rows).0[group]
}

#[inline(always)]
fn load_vector<S: Simd>(simd: S, [x, y, z]: &[OfRays; 3], group: usize) -> [S::f64s; 3] {
    [load(simd, x, group), load(simd, y, group), load(simd, z, group)]
}

#[inline(always)]
pub(super) fn store<S: Simd>(_: S, of_rows: &mut OfRays, group: usize, values: S::f64s) {
    S::as_mut_simd_f64s(of_rows).0[group] = values;
}

#[inline(always)]
pub(super) fn store_vector<S: Simd>(
    simd: S,
    vectors: &mut [OfRays; 3],
    group: usize,
    [x, y, z]: [S::f64s; 3],
) {
    store(simd, &mut vectors[0], group, x);
    store(simd, &mut vectors[1], group, y);
    store(simd, &mut vectors[2], group, z);
}

/// The products of vectors, summed as those of one are.
#[inline(always)]
pub(super) fn dot<S: Simd>(simd: S, [ax, ay, az]: [S::f64s; 3], [bx, by, bz]: [S::f64s; 3]) -> S::f64s {
    let of_two = simd.add_f64s(simd.mul_f64s(ax, bx), simd.mul_f64s(ay, by));
    simd.add_f64s(of_two, simd.mul_f64s(az, bz))
}
