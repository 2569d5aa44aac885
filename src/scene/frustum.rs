//! The region that the rays of a tile of pixels can reach, to skip what they cannot.
//!
//! ```text
//!      source          Six planes: left, right, top and bottom through the rays of the tile's corner pixels
//!        ○             (between pixel centres there are no rays), the plane of starts, and the detector.
//!       ╱│╲
//!      ╱ │ ╲  ┌───┐    A box is missed when it lies wholly beyond one of the planes. The test can keep a box
//!     ╱  │  ╲ │box│    that no ray touches (beyond an edge of the region), never drop one that a ray does.
//!    ▔▔▔▔▔▔▔▔ └───┘
//! ```
//!
//! Every plane is moved outwards by a margin that bounds the rounding of the pixel centres, of the normals and of the test, so
//! that "beyond" is a proof about the rays as they are computed, not only as they are meant.

use glam::DVec3;

use crate::geometry::Bounds;

/// Rounding units by which planes are moved out, per millimetre of coordinate. A pixel centre takes 4 roundings per coordinate, a
/// point of a segment 6 more, a normal (difference, cross product, normalization) 9, its product with a difference 6: under
/// 32 in all. Eight times that is still under a micrometre at ten kilometres, too little to keep a box that matters.
const ROUNDING: f64 = 256.0 * f64::EPSILON;

/// A convex region that holds every segment of a tile of pixels. Patient LPS, mm.
#[derive(Clone, Debug)]
pub struct Frustum {
    planes: [HalfSpace; 6],
}

/// Points `x` with `inward · (x − point) ≥ −margin`.
#[derive(Clone, Copy, Debug)]
struct HalfSpace {
    point: DVec3,
    inward: DVec3,
    margin_mm: f64,
}

impl Frustum {
    /// The region of the rays (start, target) of a tile's corners: first and last column of the first row, then of the last.
    pub(super) fn around(corners: [(DVec3, DVec3); 4], column_step: DVec3, row_step: DVec3) -> Self {
        let scale =
            corners.iter().map(|(start, target)| start.length().max(target.length())).fold(0.0, f64::max);
        let reach = corners.iter().map(|(start, target)| (*target - *start).length()).fold(0.0, f64::max);
        // The plane of a ray and a pixel direction. Where they are nearly parallel the normal is less certain, as
        // the error of the cross product stays while its length falls.
        let side = |(start, target): (DVec3, DVec3), along: DVec3, towards: DVec3| {
            let normal = along.normalize().cross(target - start);
            let inward = normal.normalize() * normal.dot(towards).signum();
            HalfSpace { point: target, inward, margin_mm: ROUNDING * scale * (1.0 + reach / normal.length()) }
        };
        let [first, last_column, last_row, _] = corners;
        let normal = column_step.normalize().cross(row_step.normalize()).normalize();
        let downstream = normal * normal.dot(first.1 - first.0).signum();
        let end = |point, inward| HalfSpace { point, inward, margin_mm: 2.0 * ROUNDING * scale };
        Self {
            planes: [
                side(first, row_step, column_step),
                side(last_column, row_step, -column_step),
                side(first, column_step, row_step),
                side(last_row, column_step, -row_step),
                end(first.0, downstream),
                end(first.1, -downstream),
            ],
        }
    }

    /// Whether the box is certainly touched by no segment of the tile. `false` proves nothing. An empty box is missed.
    pub fn misses(&self, bounds: &Bounds) -> bool {
        if bounds.min.cmpgt(bounds.max).any() {
            return true;
        }
        // Rounding of the test itself grows with the box's coordinates.
        let box_rounding = ROUNDING * bounds.min.abs().max(bounds.max.abs()).max_element();
        self.planes.iter().any(|plane| plane.most_inside(bounds) < -(plane.margin_mm + box_rounding))
    }
}

impl HalfSpace {
    /// The signed distance of the box's corner that is farthest inside, mm: all eight are beyond if this one is.
    fn most_inside(&self, bounds: &Bounds) -> f64 {
        let corner = DVec3::select(self.inward.cmpgt(DVec3::ZERO), bounds.max, bounds.min);
        self.inward.dot(corner - self.point)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use crate::geometry::{Bounds, UnitDir};
    use crate::scene::{Panel, Pose, View};

    const SEED: u64 = 61_217;

    fn vector(reach: f64) -> impl Strategy<Value = DVec3> {
        [-reach..reach, -reach..reach, -reach..reach].prop_map(DVec3::from)
    }

    /// Any view that a constructor accepts: oblique, far from the origin, grazing, mirrored, cone or parallel.
    fn any_view() -> impl Strategy<Value = View> {
        let offset = prop_oneof![Just(0.0), Just(1e3), Just(1e6)];
        let steepness = prop_oneof![Just(1.0), Just(1e-3), Just(1e-6)];
        // Grazing rays that also run along the pixel rows have the least certain side planes.
        let along_rows = prop_oneof![Just(0.0), Just(1.0)];
        let away = (vector(1.0), steepness, along_rows);
        let poses = (vector(1.0), vector(1.0), away, vector(1.0), offset, 1e-3..2000.0, any::<bool>());
        let views = (poses, 1u32..200, 1u32..200).prop_map(
            |(
                (column, other, (away, steepness, along_rows), shift, offset, distance, parallel),
                columns,
                rows,
            )| {
                let column_step_mm = column.try_normalize()?;
                let row_step_mm =
                    0.7 * (other - other.dot(column_step_mm) * column_step_mm).try_normalize()?;
                let centre = offset * shift;
                let normal = column_step_mm.cross(row_step_mm);
                let away = away.lerp(row_step_mm, along_rows * (1.0 - steepness));
                let out_of_plane = away.dot(normal) / normal.length_squared() * normal;
                let downstream = UnitDir::new(away - (1.0 - steepness) * out_of_plane)?;
                let source = centre - distance * downstream.get();
                let panel = Panel::centred(centre, column_step_mm, row_step_mm, [columns, rows]);
                match parallel {
                    false => View::cone(source, panel, Pose::Free).ok(),
                    true => View::parallel(source, downstream, distance, panel, Pose::Free).ok(),
                }
            },
        );
        views.prop_filter_map("no view", |view| view)
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 20_000,
            rng_seed: RngSeed::Fixed(SEED),
            failure_persistence: None,
            ..Default::default()
        })]

        #[test]
        fn a_box_that_holds_a_point_of_a_ray_is_never_missed(
            view in any_view(),
            tile in [0.0..1.0, 0.0..1.0, 0.0..1.0, 0.0..1.0f64],
            pixel in prop_oneof![Just((0.0, 0.0)), Just((1.0, 1.0)), (0.0..=1.0, 0.0..=1.0f64)],
            along in prop_oneof![Just(0.0), Just(1.0), 0.0..1.0f64],
            (below, above) in prop_oneof![
                Just((DVec3::ZERO, DVec3::ZERO)),
                (vector(1.0), vector(1.0)),
                (vector(1e4), vector(1e-3)),
            ],
        ) {
            let (columns, rows) = view.size();
            let pick = |fraction: f64, size: u32| (fraction * f64::from(size)) as u32;
            let ordered = |a: u32, b: u32| a.min(b)..a.max(b) + 1;
            let tile_columns = ordered(pick(tile[0], columns), pick(tile[1], columns));
            let tile_rows = ordered(pick(tile[2], rows), pick(tile[3], rows));
            let within = |range: &std::ops::Range<u32>, fraction: f64| {
                range.start + (fraction * f64::from(range.end - range.start - 1)).round() as u32
            };
            let segment = view.segment(within(&tile_columns, pixel.0), within(&tile_rows, pixel.1));
            let point = segment.line().at(along * segment.length_mm());
            let bounds = Bounds { min: point - below.abs(), max: point + above.abs() };
            prop_assert!(!view.frustum(tile_columns, tile_rows).misses(&bounds));
        }
    }

    fn view_of_11_by_11() -> View {
        let panel = Panel::centred(DVec3::new(0.0, 500.0, 0.0), DVec3::X, -DVec3::Z, [11, 11]);
        View::cone(DVec3::new(0.0, -1000.0, 0.0), panel, Pose::Free).expect("a view")
    }

    #[test]
    fn boxes_just_beyond_any_of_the_six_planes_are_missed() {
        let frustum = view_of_11_by_11().frustum(0..11, 0..11);
        // Rays end 5 mm off the axis at the detector, so 3.333 mm off at the isocentre, 1000 mm from the source.
        let edge = 10.0 / 3.0;
        for (centre, half) in [
            (DVec3::new(-edge - 1.0, 0.0, 0.0), 1.0),
            (DVec3::new(edge + 1.0, 0.0, 0.0), 1.0),
            (DVec3::new(0.0, 0.0, -edge - 1.0), 1.0),
            (DVec3::new(0.0, 0.0, edge + 1.0), 1.0),
            (DVec3::new(0.0, -1001.0, 0.0), 1.0),
            (DVec3::new(0.0, 501.0, 0.0), 1.0),
        ] {
            // The side planes are not parallel to the box, so its corners 1 mm off in depth see them 5/1500 mm nearer.
            let apart = Bounds { min: centre - half, max: centre + half }.grown(-0.004);
            let close = Bounds { min: centre - half, max: centre + half }.grown(1e-9);
            assert!(frustum.misses(&apart), "{centre} apart");
            assert!(!frustum.misses(&close), "{centre} touching");
        }
    }

    #[test]
    fn the_planes_lie_within_a_micrometre_of_the_outermost_rays() {
        let view = view_of_11_by_11();
        let (first, last) = (view.segment(2, 3).line().at(1000.0), view.segment(4, 6).line().at(1000.0));
        let frustum = view.frustum(2..5, 3..7);
        for out in [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z] {
            let touches = |distance_mm: f64| {
                [first, last].iter().any(|point| !frustum.misses(&Bounds::of([*point + distance_mm * out])))
            };
            assert!(touches(0.0));
        }
        assert!(frustum.misses(&Bounds::of([first - 1e-6 * DVec3::X])));
        assert!(frustum.misses(&Bounds::of([first + 1e-6 * DVec3::Z])));
        assert!(frustum.misses(&Bounds::of([last + 1e-6 * DVec3::X])));
        assert!(frustum.misses(&Bounds::of([last - 1e-6 * DVec3::Z])));
    }

    #[test]
    fn an_empty_box_is_missed() {
        assert!(view_of_11_by_11().frustum(0..11, 0..11).misses(&Bounds::EMPTY));
    }
}
