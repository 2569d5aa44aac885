//! The faces of a surface in patches: faces that lie together, with corners of their own, so that a patch is seen in the image,
//! or passed over, as a whole.
//!
//! ```text
//!      ╱╲──╱╲──╱╲        A patch lists its points once, and its faces by their numbers in that list: a byte a corner.
//!     ╱__╲╱__╲╱__╲       Points that several patches share stand in each of them. Where they are seen is a function of
//!     ╲  ╱╲  ╱╲  ╱       the point alone, so that it is the same in all.
//!      ╲╱──╲╱──╲╱
//! ```

use super::projection::Place;
use crate::geometry::ClosedMesh;

/// Faces of a patch, at most.
pub const MOST_FACES: usize = 64;

/// Points of a patch, at most: no two faces need share any.
pub const MOST_POINTS: usize = 3 * MOST_FACES;

/// The points of a patch are filled up to a multiple of this by the last of them, so that no instruction need stop earlier.
const GROUP: usize = 8;

/// Faces by patches.
#[derive(Clone, Debug, Default)]
pub struct Patches {
    /// Where the faces and the points of each patch begin; one entry more than there are patches.
    starts: Vec<[u32; 2]>,
    corners: Vec<[u8; 3]>,
    /// In the surface.
    numbers: Vec<u32>,
    /// Three coordinates of the points, each on its own.
    points: [Vec<f64>; 3],
    /// Whether these are places in an image, and not vertices, mm.
    are_places: bool,
}

/// One of them.
#[derive(Clone, Copy, Debug)]
pub struct Patch<'a> {
    /// Corners of the faces, in `points`.
    pub corners: &'a [[u8; 3]],
    /// The faces' numbers in the surface.
    pub numbers: &'a [u32],
    /// Coordinates, as many of each, and a multiple of [`GROUP`].
    pub points: [&'a [f64]; 3],
}

impl Patches {
    /// Those of a surface: faces that lie together in its hierarchy of boxes.
    pub fn new(surface: &ClosedMesh) -> Self {
        let mesh = surface.mesh();
        let numbers = surface.tree().items_under(0);
        let faces = numbers.iter().map(|&number| (number, mesh.faces[number as usize]));
        Self::collect(faces, mesh.vertices.len(), |v| mesh.vertices[v as usize].to_array())
    }

    /// Those of faces with places in an image, in this order.
    pub fn of_places(corners: &[[u32; 3]], numbers: &[u32], places: &[Place]) -> Self {
        let faces = numbers.iter().copied().zip(corners.iter().copied());
        let place = |p: u32| {
            let Place { x, y, depth } = places[p as usize];
            [x, y, depth]
        };
        Self { are_places: true, ..Self::collect(faces, places.len(), place) }
    }

    fn collect(
        faces: impl ExactSizeIterator<Item = (u32, [u32; 3])>,
        point_count: usize,
        point: impl Fn(u32) -> [f64; 3],
    ) -> Self {
        let mut patches = Self::default();
        patches.corners.reserve_exact(faces.len());
        patches.numbers.reserve_exact(faces.len());
        // For each point, the patch that has listed it last, counted from 1, and where.
        let mut listed = vec![(0, 0); point_count];
        let mut patch = 0;
        for (i, (number, corners)) in faces.enumerate() {
            if i % MOST_FACES == 0 {
                patches.fill_up();
                patches.starts.push([i as u32, patches.points[0].len() as u32]);
                patch += 1;
            }
            let start = patches.starts[patch as usize - 1][1];
            patches.corners.push(corners.map(|corner| {
                let listed = &mut listed[corner as usize];
                if listed.0 != patch {
                    *listed = (patch, (patches.points[0].len() as u32 - start) as u8);
                    patches.points.iter_mut().zip(point(corner)).for_each(|(all, x)| all.push(x));
                }
                listed.1
            }));
            patches.numbers.push(number);
        }
        patches.fill_up();
        patches.starts.push([patches.corners.len() as u32, patches.points[0].len() as u32]);
        patches
    }

    /// Ends a patch.
    fn fill_up(&mut self) {
        for points in &mut self.points {
            let last = points.last().copied().unwrap_or_default();
            points.resize(points.len().next_multiple_of(GROUP), last);
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// How many faces they have.
    pub fn face_count(&self) -> usize {
        self.corners.len()
    }

    /// Whether points are places in an image.
    pub fn are_places(&self) -> bool {
        self.are_places
    }

    /// One of them.
    #[inline(always)]
    pub fn get(&self, patch: usize) -> Patch<'_> {
        let ([face, point], [last_face, last_point]) = (self.starts[patch], self.starts[patch + 1]);
        let (faces, points) = (face as usize..last_face as usize, point as usize..last_point as usize);
        Patch {
            corners: &self.corners[faces.clone()],
            numbers: &self.numbers[faces],
            points: self.points.each_ref().map(|all| &all[points.clone()]),
        }
    }
}
