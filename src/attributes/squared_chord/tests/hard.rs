//! Where rounding decides: lines along faces, through vertices and edges. What a tree knows of them is what rounding leaves open,
//! or within the tolerance of that; single lines and pixels alike.

use super::*;
use crate::exact::judge::length_in_parallel_body;
use crate::geometry::TriMesh;
use crate::geometry::numeric::gamma;

/// Of half the longest side of the box.
const TOLERANCE: f64 = 1e-3;

/// How far a length is from those that rounding explains, mm.
fn excess_mm(body: &Body, ray: &Segment, length_mm: f64) -> f64 {
    let convex = body.convexity().expect("convex");
    // A line's intercepts and a pixel's forms are rounded in the frame as vertices are in the raster's image.
    let shift = gamma(2 * 96) * (ray.length_mm() + body.bounds().diagonal()) + convex.reflex_depth_mm();
    let [least, most] = [-shift, shift].map(|shift| length_in_parallel_body(convex, ray, shift));
    (least - shift - length_mm).max(length_mm - most - shift).max(0.0)
}

fn bodies() -> Vec<(&'static str, Body)> {
    let turned =
        |mesh: TriMesh, size: [f64; 3]| body(mesh.map_vertices(|v| turn() * (v * DVec3::from(size))));
    vec![
        ("box", turned(cube(1.0), [100.0, 60.0, 30.0])),
        ("prism", body(prism(64).map_vertices(|v| v * DVec3::new(40.0, 40.0, 90.0)))),
        ("plate", turned(cube(1.0), [100.0, 100.0, 0.01])),
        ("ellipsoid", ellipsoid(3)),
        ("cut ellipsoid", cut_ellipsoid()),
    ]
}

fn tree(body: &Body) -> (FittedTree<SquaredChord<'_>>, f64) {
    let tolerance_mm = TOLERANCE * 0.5 * body.bounds().size().max_element();
    (FittedTree::new(SquaredChord::new(body, tolerance_mm, false).expect("convex")), tolerance_mm)
}

/// From before the body to behind it.
fn across(body: &Body, at: DVec3, dir: DVec3) -> Option<Segment> {
    let reach = 3.0 * body.bounds().diagonal() * dir.try_normalize()?;
    Segment::between(at - reach, at + reach)
}

/// In a face, along one of its edges, and through a corner and an edge of it.
fn aimed(body: &Body, count: usize) -> Vec<Segment> {
    let mesh = body.surface().mesh();
    let mut rng = Pcg64::seed_from_u64(12);
    let mut rays = Vec::new();
    for _ in 0..count {
        let [a, b, c] = mesh.triangle(rng.random_range(0..mesh.faces.len()));
        let [i, j] = [0; 2].map(|_| rng.random_range(-1.0..1.0));
        let anywhere = DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0)));
        let within = (a + b + c) / 3.0;
        let dirs = [
            (within, i * (b - a) + j * (c - a)),
            (a, b - a),
            (a, anywhere),
            (a + i.abs() * (b - a), anywhere),
        ];
        rays.extend(dirs.into_iter().filter_map(|(at, dir)| across(body, at, dir)));
    }
    rays
}

#[test]
fn lines_along_faces_and_through_edges_are_as_long_as_rounding_allows() {
    let (mut known, mut asked) = (0, 0);
    for (name, body) in bodies() {
        let (tree, tolerance_mm) = tree(&body);
        let rays = aimed(&body, 500);
        let lines: Vec<Line> = rays.iter().map(|ray| *ray.line()).collect();
        SquaredChord::ask_all(&tree, lines.iter().enumerate(), &Cache::new(1 << 28), |i, line, place| {
            let of_leaf = |(leaf, pair, stuv): Asked| tree.fit().known(leaf, line, pair, stuv);
            let length_mm = match place.map_or(Known::Miss, of_leaf) {
                Known::Miss => 0.0,
                Known::Length(length_mm) => length_mm,
                Known::Nothing => return,
            };
            let excess = excess_mm(&body, &rays[i], length_mm);
            assert!(
                excess <= 5.0 * tolerance_mm,
                "{name}: {length_mm} mm is {excess} mm too much of {:?}",
                rays[i]
            );
            known += 1;
        });
        asked += rays.len();
    }
    // Most of these lines are near an outline, and traced; so are all of the cut ellipsoid's, whose faces are large.
    assert!(10 * known > asked, "{known} of {asked} are known");
}

/// An image whose middle row lies in a face's plane: of parallel rays, and from a point of that plane.
fn along_face(body: &Body, face: usize) -> Option<[RayGrid; 2]> {
    const SIZE: u32 = 33;
    let [a, b, c] = body.surface().mesh().triangle(face);
    let normal = (b - a).cross(c - a).try_normalize()?;
    let along = (b - a).try_normalize()?;
    let (middle, reach) = ((a + b + c) / 3.0, 3.0 * body.bounds().diagonal());
    let step = (b - a).length().max((c - a).length()) / f64::from(SIZE - 1);
    let steps = [step * normal.cross(along), 1e-3 * step * normal];
    let half = f64::from(SIZE - 1) / 2.0;
    let corner = middle + reach * along - half * (steps[0] + steps[1]);
    let grid = |upstream| RayGrid::new(upstream, corner, steps, [SIZE, SIZE]);
    Some([grid(Upstream::Source(middle - reach * along))?, grid(Upstream::Path(2.0 * reach * along))?])
}

#[test]
fn pixels_along_faces_are_as_long_as_rounding_allows() {
    for (name, body) in bodies() {
        let (tree, tolerance_mm) = tree(&body);
        let cache = Cache::new(1 << 28);
        let faces = body.surface().mesh().faces.len();
        let (mut known, mut asked) = (0, 0);
        for grid in
            (0..faces).step_by(faces.div_ceil(12)).filter_map(|face| along_face(&body, face)).flatten()
        {
            let image = ImageChords::new(tree.fit(), &grid).expect("between source and pixels");
            let region = grid.whole();
            let (mut lengths, mut open) = (vec![0.0; region.pixels()], Vec::new());
            image.trace(&tree, &region, &cache, &mut lengths, &mut open);
            let mut is_open = vec![false; region.pixels()];
            open.iter().for_each(|run| is_open[places_of(&region, run).1].fill(true));
            for (i, (column, row)) in region.places().enumerate().filter(|(i, _)| !is_open[*i]) {
                let ray = grid.segment(column, row);
                let excess = excess_mm(&body, &ray, lengths[i]);
                assert!(
                    excess <= 5.0 * tolerance_mm,
                    "{name}, {column} {row}: {} mm is {excess} mm too much",
                    lengths[i]
                );
                known += 1;
            }
            asked += region.pixels();
        }
        assert!(4 * known > asked, "{name}: {known} of {asked} are known");
    }
}
