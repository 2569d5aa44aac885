//! How two closed surfaces lie to each other, and whether one crosses itself.
//!
//! Whether faces meet is decided by exact signs. Where they do, probes (vertices, a point of each face, the middles of
//! edge pieces between crossings, a point inside each component) tell contact from crossing: bodies whose flat faces
//! lie on each other touch, bodies that share a volume deeper than rounding explains cross.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use glam::DVec3;

use super::predicates::{Meeting, meeting};
use super::{Bounds, ClosedMesh, Side};

/// How the body `a` lies to the body `b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relation {
    /// They share no volume; their surfaces may touch.
    Disjoint,
    /// All of `a` lies in `b`; their surfaces may touch.
    Inside,
    /// All of `b` lies in `a`; their surfaces may touch.
    Around,
    /// They share some volume, and each has some of its own (or both have none).
    Crossing {
        /// A place of both, about the deepest found.
        place: DVec3,
        /// How deep it lies under the surface of the other body, mm.
        depth_mm: f64,
    },
}

/// The pairs of faces after which more crossings tell nothing new.
const ENOUGH_CROSSINGS: usize = 10_000;

/// How `a` lies to `b`. Contact within the rounding of the vertices counts as touching.
pub fn relation(a: &ClosedMesh, b: &ClosedMesh) -> Relation {
    if !a.bounds().touches(&b.bounds()) {
        return Relation::Disjoint;
    }
    let contact = surface_contact(a, b);
    let tolerance = a.rounding_tolerance_mm() + b.rounding_tolerance_mm();
    let a_in_b = Spread::of(&Probes::of(a, contact.surfaces_meet, &contact.on_edges_of_a), b, tolerance);
    let b_in_a = Spread::of(&Probes::of(b, contact.surfaces_meet, &contact.on_edges_of_b), a, tolerance);

    let share_volume = !a_in_b.inside.is_empty() || !b_in_a.inside.is_empty();
    // On the other side of a surface of `b` that runs within `a`, `a` is out of `b`: a ball that fills a cavity and
    // part of the wall around it has not one probe out of the shell.
    let a_reaches_out = a_in_b.reaches_out || b_in_a.surface_runs_within;
    let b_reaches_out = b_in_a.reaches_out || a_in_b.surface_runs_within;
    match (share_volume, a_reaches_out, b_reaches_out) {
        (false, ..) => Relation::Disjoint,
        (true, false, true) => Relation::Inside,
        (true, true, false) => Relation::Around,
        (true, ..) => {
            let deepest = [a_in_b.deepest_in(b), b_in_a.deepest_in(a)];
            let (depth_mm, place) = if deepest[0].0 >= deepest[1].0 { deepest[0] } else { deepest[1] };
            Relation::Crossing { place, depth_mm }
        }
    }
}

/// The pairs of faces of one surface that pass through each other: how many, and a place. `None` if it does not
/// cross itself.
pub fn self_crossing(surface: &ClosedMesh) -> Option<(usize, DVec3)> {
    let mut crossings = 0;
    let mut first = None;
    let mesh = surface.mesh();
    let _ = surface.tree().overlapping_pairs(surface.tree(), |f, g| {
        if f < g {
            let (s, t) = (mesh.triangle(f as usize), mesh.triangle(g as usize));
            if Bounds::of(s).touches(&Bounds::of(t))
                && let Meeting::Cross { place, .. } = meeting(s, t)
            {
                crossings += 1;
                first.get_or_insert(place);
            }
        }
        if crossings < ENOUGH_CROSSINGS { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    first.map(|place| (crossings, place))
}

#[derive(Default)]
struct Contact {
    surfaces_meet: bool,
    on_edges_of_a: EdgeCrossings,
    on_edges_of_b: EdgeCrossings,
}

/// The places at which an edge, given by its vertices, passes through the other surface.
type EdgeCrossings = BTreeMap<[u32; 2], Vec<DVec3>>;

fn surface_contact(a: &ClosedMesh, b: &ClosedMesh) -> Contact {
    let mut contact = Contact::default();
    let mut crossings = 0;
    let _ = a.tree().overlapping_pairs(b.tree(), |f, g| {
        let (s, t) = (a.mesh().triangle(f as usize), b.mesh().triangle(g as usize));
        if !Bounds::of(s).touches(&Bounds::of(t)) {
            return ControlFlow::Continue(());
        }
        match meeting(s, t) {
            Meeting::Apart => {}
            Meeting::Degenerate => contact.surfaces_meet = true,
            Meeting::Cross { edge_of_first, edge, place } => {
                contact.surfaces_meet = true;
                crossings += 1;
                let (list, corners) = match edge_of_first {
                    true => (&mut contact.on_edges_of_a, a.mesh().faces[f as usize]),
                    false => (&mut contact.on_edges_of_b, b.mesh().faces[g as usize]),
                };
                let (u, v) = (corners[edge], corners[(edge + 1) % 3]);
                list.entry([u.min(v), u.max(v)]).or_default().push(place);
            }
        }
        if crossings < ENOUGH_CROSSINGS { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    contact
}

/// Points of a body to be held against another: a few if the surfaces do not meet, many if they do.
struct Probes {
    on_surface: Vec<DVec3>,
    within: Vec<DVec3>,
}

impl Probes {
    fn of(body: &ClosedMesh, surfaces_meet: bool, crossings: &EdgeCrossings) -> Self {
        let mesh = body.mesh();
        let mut on_surface = one_vertex_per_component(body);
        if !surfaces_meet {
            return Self { on_surface, within: Vec::new() };
        }
        on_surface.extend(&mesh.vertices);
        on_surface.extend(mesh.triangles().map(odd_place));
        for (&[u, v], places) in crossings {
            let (start, end) = (mesh.vertices[u as usize], mesh.vertices[v as usize]);
            let mut stops = places.clone();
            stops.sort_by(|p, q| (p - start).length_squared().total_cmp(&(q - start).length_squared()));
            stops.insert(0, start);
            stops.push(end);
            on_surface.extend(stops.windows(2).map(|w| w[0].midpoint(w[1])));
        }
        Self { on_surface, within: points_inside(body) }
    }
}

/// A place in a triangle at no simple fraction of it: in bodies drawn on a grid, the centre of one's face lies on
/// the faces of others.
fn odd_place([a, b, c]: [DVec3; 3]) -> DVec3 {
    const SHARES: [f64; 3] = [0.4142, 0.3247, 0.2611];
    SHARES[0] * a + SHARES[1] * b + SHARES[2] * c
}

fn one_vertex_per_component(body: &ClosedMesh) -> Vec<DVec3> {
    body.first_faces().map(|f| body.mesh().triangle(f)[0]).collect()
}

/// A point well inside each solid component, below its first face.
fn points_inside(body: &ClosedMesh) -> Vec<DVec3> {
    let mesh = body.mesh();
    body.first_faces()
        .filter_map(|f| {
            let [a, b, c] = mesh.triangle(f);
            let inward = -(b - a).cross(c - a).normalize_or_zero();
            let start = odd_place([a, b, c]);
            // Halving from the body's size always ends inside or at the face itself.
            let reach = body.bounds().diagonal();
            (0..40)
                .map(|k| start + inward * reach * 0.5f64.powi(k))
                .find(|&p| body.side_of(p) == Side::Inside)
        })
        .collect()
}

/// Where the probes of one body lie in another.
struct Spread {
    /// Those that lie in it deeper than the tolerance.
    inside: Vec<DVec3>,
    /// Whether one of these is on the probed body's surface.
    surface_runs_within: bool,
    /// Whether some lie out of it farther than the tolerance.
    reaches_out: bool,
}

impl Spread {
    fn of(probes: &Probes, body: &ClosedMesh, tolerance_mm: f64) -> Self {
        let mut spread = Self { inside: Vec::new(), surface_runs_within: false, reaches_out: false };
        spread.add(&probes.on_surface, body, tolerance_mm);
        spread.surface_runs_within = !spread.inside.is_empty();
        spread.add(&probes.within, body, tolerance_mm);
        spread
    }

    fn add(&mut self, probes: &[DVec3], body: &ClosedMesh, tolerance_mm: f64) {
        for &p in probes {
            match body.side_of(p) {
                Side::On => {}
                Side::Inside if body.distance_mm(p) > tolerance_mm => self.inside.push(p),
                Side::Inside => {}
                // One far enough out tells all; distances are the costly part.
                Side::Outside => {
                    self.reaches_out = self.reaches_out || body.distance_mm(p) > tolerance_mm;
                }
            }
        }
    }

    /// The depth and the place of the deepest probe, mm.
    fn deepest_in(&self, body: &ClosedMesh) -> (f64, DVec3) {
        let depths = self.inside.iter().map(|&p| (body.distance_mm(p), p));
        depths.fold((0.0, DVec3::ZERO), |best, next| if next.0 > best.0 { next } else { best })
    }
}

#[cfg(test)]
mod tests {
    use super::super::TriMesh;
    use super::super::primitives::{cube, icosphere, inside_out};
    use super::*;

    fn closed(mesh: TriMesh) -> ClosedMesh {
        ClosedMesh::new(mesh).expect("closed").0
    }

    fn cube_at(side: f64, x: f64, y: f64, z: f64) -> ClosedMesh {
        closed(cube(side).map_vertices(|v| v + DVec3::new(x, y, z)))
    }

    fn is_crossing(r: Relation) -> bool {
        matches!(r, Relation::Crossing { .. })
    }

    #[test]
    fn cubes_apart_nested_and_crossing_are_told_apart() {
        let big = cube_at(4.0, 0.0, 0.0, 0.0);
        assert_eq!(relation(&big, &cube_at(2.0, 9.0, 0.0, 0.0)), Relation::Disjoint);
        assert_eq!(relation(&big, &cube_at(2.0, 0.1, 0.2, 0.3)), Relation::Around);
        assert_eq!(relation(&cube_at(2.0, 0.1, 0.2, 0.3), &big), Relation::Inside);
        let Relation::Crossing { depth_mm, place } = relation(&big, &cube_at(2.0, 2.5, 0.1, 0.2)) else {
            panic!("a crossing was missed")
        };
        assert!((0.4..=0.5).contains(&depth_mm), "{depth_mm} at {place}");
    }

    #[test]
    fn boxes_stacked_face_to_face_touch() {
        let a = cube_at(2.0, 0.0, 0.0, 0.0);
        assert_eq!(relation(&a, &cube_at(2.0, 0.0, 0.0, 2.0)), Relation::Disjoint);
        assert_eq!(relation(&a, &cube_at(1.0, 0.3, 0.2, 1.5)), Relation::Disjoint);
        assert_eq!(relation(&a, &cube_at(1.0, 0.3, 0.2, 0.5)), Relation::Around);
    }

    #[test]
    fn boxes_with_all_faces_flush_that_overlap_cross() {
        // No edge passes strictly through a face: only probes can tell.
        let (a, b) = (cube_at(2.0, 0.0, 0.0, 0.0), cube_at(2.0, 1.0, 0.0, 0.0));
        assert!(is_crossing(relation(&a, &b)));
        assert!(is_crossing(relation(&a, &a)), "equal bodies occupy the same space");
    }

    #[test]
    fn crossed_rods_without_a_vertex_in_each_other_cross() {
        let rod = |sx: f64, sy: f64| closed(cube(1.0).map_vertices(|v| v * DVec3::new(sx, sy, 0.9)));
        assert!(is_crossing(relation(&rod(10.0, 1.0), &rod(1.0, 10.1))));
    }

    #[test]
    fn a_body_half_inside_another_by_components_crosses() {
        let mut pair = cube(1.0);
        pair.append(&cube(1.0).map_vertices(|v| v + 20.0));
        assert!(is_crossing(relation(&closed(pair), &cube_at(4.0, 0.0, 0.0, 0.0))));
    }

    #[test]
    fn a_ball_in_a_cavity_is_disjoint_from_the_shell() {
        let mut shell = icosphere(2).map_vertices(|v| 10.0 * v);
        let hole = inside_out(icosphere(2).map_vertices(|v| 8.0 * v));
        shell.append(&hole);
        let ball = closed(icosphere(2).map_vertices(|v| 5.0 * v));
        assert_eq!(relation(&closed(shell), &ball), Relation::Disjoint);
    }

    #[test]
    fn a_ball_that_fills_a_cavity_and_half_its_wall_crosses_the_shell() {
        let mut skull = icosphere(2).map_vertices(|v| 10.0 * v);
        let hole = inside_out(icosphere(2).map_vertices(|v| 8.0 * v));
        skull.append(&hole);
        let (skull, brain) = (closed(skull), closed(icosphere(2).map_vertices(|v| 9.0 * v)));
        assert!(is_crossing(relation(&skull, &brain)));
        assert!(is_crossing(relation(&brain, &skull)));
    }

    /// A block of 6 × 5 × 1 with a notch of 2 × 3 × 1, whose walls' diagonals are chosen for the test below.
    fn notched_block() -> TriMesh {
        let outline = [(-3, -2), (3, -2), (3, 3), (1, 3), (1, 0), (-1, 0), (-1, 3), (-3, 3)];
        let corner = |z: f64| outline.map(|(x, y)| DVec3::new(f64::from(x), f64::from(y), z));
        let caps = [[0, 1, 4], [1, 2, 3], [1, 3, 4], [0, 4, 5], [0, 5, 6], [0, 6, 7]];
        let mut faces: Vec<[u32; 3]> =
            caps.iter().flat_map(|&[a, b, c]| [[a, c, b], [a + 8, b + 8, c + 8]]).collect();
        for i in 0..8 {
            let j = (i + 1) % 8;
            let is_wall_of_the_notch = i == 3 || i == 5;
            faces.extend(match is_wall_of_the_notch {
                true => [[i, j, i + 8], [j, j + 8, i + 8]],
                false => [[i, j, j + 8], [i, j + 8, i + 8]],
            });
        }
        TriMesh { vertices: [corner(0.0), corner(1.0)].concat(), faces }
    }

    #[test]
    fn a_bar_on_the_grid_of_a_notched_block_crosses_it_though_edges_meet_edges_only() {
        // The bar's vertices and face centres all lie on the block's surface, its diagonals cross the block's.
        let notched = closed(notched_block());
        for mirrored in [false, true] {
            let mut bar = cube(1.0).map_vertices(|v| {
                let z = if mirrored { -v.z } else { v.z };
                DVec3::new(6.0 * v.x, v.y + 0.5, z + 0.5)
            });
            if mirrored {
                bar = inside_out(bar);
            }
            assert!(is_crossing(relation(&notched, &closed(bar))), "{mirrored}");
        }
    }

    /// A cube one of whose corners was drawn out through the far side: edges meet edges only.
    #[test]
    fn a_surface_drawn_through_itself_along_its_own_edges_is_found() {
        let mut mesh = cube(2.0);
        let drawn = mesh.vertices.iter().position(|&v| v == DVec3::new(-1.0, 1.0, 1.0)).expect("a corner");
        mesh.vertices[drawn].x = 41.0;
        let (pairs, _) = self_crossing(&closed(mesh)).expect("a crossing");
        assert!(pairs > 0);
    }

    #[test]
    fn a_surface_drawn_through_itself_is_found() {
        let mut twisted = icosphere(2).map_vertices(|v| 10.0 * v);
        assert_eq!(self_crossing(&closed(twisted.clone())), None);
        twisted.vertices[20] *= -2.0;
        let (pairs, _) = self_crossing(&closed(twisted)).expect("a crossing");
        assert!(pairs > 1);
    }
}
