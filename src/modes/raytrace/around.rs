//! Which objects lie in which direction from a light.
//!
//! A cube around the point has on each cell of its sides the objects whose boxes are seen there, so that a ray is held against
//! these alone (light buffers, Haines & Greenberg 1986, doi:10.1109/MCG.1986.276832). Exact tracing and trees both ask it.

use glam::DVec3;

use super::cube::OnCube;
use crate::geometry::{Bounds, Real, Vec3};

/// Cells along each side of the cube: 1.4° at the most.
const CELLS: usize = 64;

/// With so few boxes, asking takes as much as holding rays against all.
const FEW: usize = 2;

/// The objects around a point.
pub struct Around {
    /// For each cell where its objects begin, one more at the end; empty if all are everywhere.
    starts: Vec<u32>,
    /// Indices of objects, in each cell in the order in which rays are held against them.
    objects: Vec<u32>,
}

impl Around {
    /// Boxes around a point, in an order.
    pub fn new(point: DVec3, boxes: &[Bounds], order: &[u32]) -> Self {
        if order.len() <= FEW {
            return Self { starts: Vec::new(), objects: order.to_vec() };
        }
        let mut cells = vec![Vec::new(); 6 * CELLS * CELLS];
        for &object in order {
            let bounds = &boxes[object as usize];
            for side in 0..6 {
                let Some([columns, rows]) = shadow(point, bounds, side) else { continue };
                for row in rows[0]..=rows[1] {
                    let first = (side * CELLS + row) * CELLS;
                    cells[first + columns[0]..=first + columns[1]].iter_mut().for_each(|c| c.push(object));
                }
            }
        }
        let mut starts = vec![0];
        let mut objects = Vec::new();
        for cell in cells {
            objects.extend(cell);
            starts.push(objects.len() as u32);
        }
        Self { starts, objects }
    }

    /// The objects that rays in this direction from the point may meet.
    #[inline]
    pub fn towards<R: Real>(&self, way: Vec3<R>) -> &[u32] {
        if self.starts.is_empty() {
            return &self.objects;
        }
        let OnCube { side, cell: [column, row], .. } = OnCube::of(way, CELLS);
        let cell = (side * CELLS + row) * CELLS + column;
        &self.objects[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// The columns and rows of a side, first and last, that hold all directions from the point to the box that leave the cube there.
/// `None` if there are none.
fn shadow(point: DVec3, bounds: &Bounds, side: usize) -> Option<[[usize; 2]; 2]> {
    let (k, sign) = (side / 2, if side % 2 == 1 { 1.0 } else { -1.0 });
    let ways = bounds.corners().map(|corner| corner - point);
    if ways.iter().all(|way| sign * way[k] <= 0.0) {
        return None;
    }
    // A box that reaches beside the point or behind it may be seen anywhere.
    let is_before = ways.iter().all(|way| sign * way[k] > 0.0);
    let mut reach = [[0, CELLS - 1]; 2];
    for (i, [first, last]) in reach.iter_mut().enumerate().filter(|_| is_before) {
        let slopes = ways.map(|way| way[(k + 1 + i) % 3] / (sign * way[k]));
        let low = slopes.into_iter().fold(f64::INFINITY, f64::min) - ROUNDING;
        let high = slopes.into_iter().fold(f64::NEG_INFINITY, f64::max) + ROUNDING;
        if high < -1.0 || low > 1.0 {
            return None;
        }
        let cell = |slope: f64| (((slope + 1.0) * 0.5 * CELLS as f64).max(0.0) as usize).min(CELLS - 1);
        (*first, *last) = (cell(low), cell(high));
    }
    Some(reach)
}

/// What slopes of rays from the point may be off by.
const ROUNDING: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::geometry::Ray;
    use crate::surface::{Reach, Slabs, Sphere, Surface};

    #[test]
    fn whatever_a_ray_meets_lies_in_its_direction() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(9);
        let mut vector = |scale: f64| DVec3::from([(); 3].map(|()| rng.random_range(-scale..scale)));
        let balls: Vec<Surface> = (0..30)
            .map(|i| Surface::Sphere(Sphere::new(vector(100.0), 1.0 + f64::from(i)).expect("a sphere")))
            .collect();
        let boxes: Vec<Bounds> = balls.iter().map(Surface::bounds).collect();
        let order: Vec<u32> = (0..30).rev().collect();
        let (mut met, mut held) = (0, 0);
        // From outside, from among them, and from within one.
        for point in [DVec3::new(300.0, -200.0, 90.0), DVec3::ZERO, boxes[29].centre()] {
            let around = Around::new(point, &boxes, &order);
            for _ in 0..3_000 {
                let dir = Vec3::<f64>::of(vector(1.0).normalize());
                let ray = Ray { origin: Vec3::of(point), dir };
                let objects = around.towards(dir);
                held += objects.len();
                for (index, ball) in (0_u32..).zip(&balls) {
                    let is_met = ball.hit(&ray, Reach::whole()).is_some();
                    met += usize::from(is_met);
                    assert!(!is_met || objects.contains(&index), "{index} from {point} along {dir:?}");
                }
                assert!(
                    objects.is_sorted_by(|a, b| a > b)
                        && Slabs::new(&ray)
                            .stretch(&boxes[0])
                            .is_none_or(|s| s.1 < 0.0 || objects.contains(&0))
                );
            }
        }
        assert!(met > 3_000 && held < 3 * 3_000 * balls.len() / 2, "{met} met, {held} held");
    }
}
