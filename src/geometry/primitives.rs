//! Simple closed surfaces for tests, benches and examples.

use std::collections::HashMap;

use glam::DVec3;

use super::TriMesh;

/// A cube of the given side about the origin, 12 faces.
pub fn cube(side_mm: f64) -> TriMesh {
    let h = 0.5 * side_mm;
    let vertices = super::Bounds { min: DVec3::splat(-h), max: DVec3::splat(h) }.corners().to_vec();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { vertices, faces }
}

/// A box between two corners, 12 faces.
pub fn block(low: [f64; 3], high: [f64; 3]) -> TriMesh {
    let (low, high) = (DVec3::from(low), DVec3::from(high));
    cube(1.0).map_vertices(|v| low + (v + 0.5) * (high - low))
}

/// The same surface with every face turned over: a cavity's from a solid's.
pub fn inside_out(mut mesh: TriMesh) -> TriMesh {
    mesh.faces.iter_mut().for_each(|f| f.swap(0, 1));
    mesh
}

/// A unit sphere about the origin: an icosahedron whose faces are split in four `subdivisions` times,
/// 20 · 4ⁿ faces with all vertices on the sphere.
pub fn icosphere(subdivisions: u32) -> TriMesh {
    let phi = 0.5 * (1.0 + 5f64.sqrt());
    let mut vertices = Vec::new();
    for (a, b) in [(1.0, phi), (-1.0, phi), (1.0, -phi), (-1.0, -phi)] {
        vertices.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    let vertices = vertices.into_iter().map(DVec3::normalize).collect();
    let mut mesh = TriMesh { vertices, faces: ICOSAHEDRON.to_vec() };
    for _ in 0..subdivisions {
        mesh = subdivide(&mesh);
    }
    mesh
}

/// A prism of radius 1 and height 2 about the z axis, `sides` sides: its ends are fans of triangles in one plane.
pub fn prism(sides: u32) -> TriMesh {
    let ring = |z: f64| {
        (0..sides).map(move |i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(sides)).sin_cos();
            DVec3::new(cos, sin, z)
        })
    };
    let ends = (1..sides - 1).flat_map(|i| [[0, i + 1, i], [sides, sides + i, sides + i + 1]]);
    let walls = (0..sides).flat_map(|i| {
        let j = (i + 1) % sides;
        [[i, j, j + sides], [i, j + sides, i + sides]]
    });
    TriMesh { vertices: ring(-1.0).chain(ring(1.0)).collect(), faces: ends.chain(walls).collect() }
}

/// A torus about the z axis, `n` × `n` quads cut in two: a tube of radius `tube` whose middle runs at `radius`.
pub fn torus(radius: f64, tube: f64, n: u32) -> TriMesh {
    let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let vertex = |i: u32, j: u32| {
        let ((s, c), (t, d)) = (angle(i).sin_cos(), angle(j).sin_cos());
        DVec3::new((radius + tube * d) * c, (radius + tube * d) * s, tube * t)
    };
    let vertices = (0..n * n).map(|k| vertex(k / n, k % n)).collect();
    let at = |i: u32, j: u32| i % n * n + j % n;
    let quad = |i, j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
    let quads = (0..n * n).map(|k| quad(k / n, k % n));
    TriMesh { vertices, faces: quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect() }
}

/// The faces of the icosahedron whose vertices `icosphere` lists.
#[rustfmt::skip]
const ICOSAHEDRON: [[u32; 3]; 20] = [
    [0, 2, 1], [0, 1, 4], [0, 3, 2], [0, 8, 3], [0, 4, 8],
    [1, 2, 5], [1, 6, 4], [1, 5, 6], [2, 3, 7], [2, 7, 5],
    [3, 10, 7], [3, 8, 10], [4, 6, 11], [4, 11, 8], [5, 9, 6],
    [5, 7, 9], [6, 9, 11], [7, 10, 9], [8, 11, 10], [9, 10, 11],
];

fn subdivide(mesh: &TriMesh) -> TriMesh {
    let mut vertices = mesh.vertices.clone();
    let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
            vertices.len() as u32 - 1
        })
    };
    let faces = mesh
        .faces
        .iter()
        .flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        })
        .collect();
    TriMesh { vertices, faces }
}
