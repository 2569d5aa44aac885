//! Triangle meshes with smooth normals.

use glam::DVec3;

use super::frame::Slabs;
use super::{Hit, Reach};
use crate::geometry::numeric::gamma;
use crate::geometry::{Bounds, BoxTree, Ray, Real, Search, TriMesh, Vec3};

/// Triangles with a normal at each corner, interpolated over each face: one class.
#[derive(Clone, Debug)]
pub struct SmoothMesh {
    mesh: TriMesh,
    normals: Vec<DVec3>,
    tree: BoxTree,
    magnitude: f64,
}

impl SmoothMesh {
    /// The mesh with each corner's normal the mean of its faces', by their areas. `None` if it has no faces, an index is
    /// out of range or a coordinate is not finite.
    pub fn new(mesh: TriMesh) -> Option<Self> {
        let is_known = |face: &[u32; 3]| face.iter().all(|&i| (i as usize) < mesh.vertices.len());
        if mesh.faces.is_empty()
            || !mesh.faces.iter().all(is_known)
            || !mesh.vertices.iter().all(|v| v.is_finite())
        {
            return None;
        }
        let mut normals = vec![DVec3::ZERO; mesh.vertices.len()];
        let corners = |face: &[u32; 3]| face.map(|i| mesh.vertices[i as usize]);
        for face in &mesh.faces {
            let [a, b, c] = corners(face);
            face.iter().for_each(|&i| normals[i as usize] += (b - a).cross(c - a));
        }
        normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        let magnitude = mesh.vertices.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
        let boxes: Vec<Bounds> =
            mesh.faces.iter().map(|f| Bounds::of(corners(f)).grown(gamma(8) * magnitude)).collect();
        let tree = BoxTree::build(&boxes);
        Some(Self { mesh, normals, tree, magnitude })
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        self.tree.bounds()
    }

    /// The corners.
    pub fn corners(&self) -> &[DVec3] {
        &self.mesh.vertices
    }

    /// At most so many boxes around all of its faces.
    pub fn parts(&self, at_most: usize) -> Vec<Bounds> {
        self.tree.parts(at_most)
    }

    /// The nearest hit within reach. `None` if there is none. Shared edges are counted in at least one face (Woop, Benthin
    /// & Wald 2013: signs of edges are the same numbers from both sides).
    pub fn hit<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> Option<Hit<R>> {
        self.search(ray, reach, false)
    }

    /// Whether there is a hit within reach.
    pub fn is_met<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> bool {
        self.search(ray, reach, true).is_some()
    }

    fn search<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>, any: bool) -> Option<Hit<R>> {
        let d = ray.dir.get().abs();
        let k = if d.x >= d.y && d.x >= d.z { 0 } else { 1 + usize::from(d.z > d.y) };
        let axes = [(k + 1) % 3, (k + 2) % 3, k];
        let along = ray.dir.axis(k);
        let shear = [ray.dir.axis(axes[0]) / along, ray.dir.axis(axes[1]) / along];
        let mut search =
            Nearest { mesh: self, ray, slabs: Slabs::new(ray), axes, shear, reach, best: None, any };
        self.tree.search(&mut search);
        search.best
    }
}

struct Nearest<'a, R> {
    mesh: &'a SmoothMesh,
    ray: &'a Ray<R>,
    slabs: Slabs<R>,
    axes: [usize; 3],
    shear: [R; 2],
    reach: Reach<R>,
    best: Option<Hit<R>>,
    /// Whether any hit ends the search.
    any: bool,
}

impl<R: Real> Search for Nearest<'_, R> {
    type Distance = R;

    fn entry(&self, bounds: &Bounds) -> Option<R> {
        self.slabs.entry(bounds, self.reach.from, self.reach.to)
    }

    fn is_beyond(&self, entry: R) -> bool {
        entry > self.reach.to
    }

    fn item(&mut self, item: u32) {
        let face = self.mesh.mesh.faces[item as usize];
        let [i, j, k] = self.axes;
        let corners = face.map(|index| {
            let p = Vec3::of(self.mesh.mesh.vertices[index as usize]) - self.ray.origin;
            [p.axis(i) - self.shear[0] * p.axis(k), p.axis(j) - self.shear[1] * p.axis(k), p.axis(k)]
        });
        let edge = |p: [R; 3], q: [R; 3]| p[0] * q[1] - p[1] * q[0];
        let [a, b, c] = corners;
        let weights = [edge(b, c), edge(c, a), edge(a, b)];
        let zero = R::of(0.0);
        if weights.iter().any(|w| *w < zero) && weights.iter().any(|w| *w > zero) {
            return;
        }
        let sum = weights[0] + weights[1] + weights[2];
        if sum == zero {
            return;
        }
        let depth = weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2];
        let t = depth / (sum * self.ray.dir.axis(k));
        let [p, q, r] = face.map(|index| self.mesh.mesh.vertices[index as usize]);
        let flat = (q - p).cross(r - p);
        let enters = self.ray.dir.get().dot(flat) < 0.0;
        if !self.reach.admits(t, enters) {
            return;
        }
        let mut normal = Vec3::default();
        for (weight, index) in weights.into_iter().zip(face) {
            normal = normal + Vec3::of(self.mesh.normals[index as usize]) * (weight / sum);
        }
        self.reach.to = if self.any { R::of(f64::NEG_INFINITY) } else { t };
        let size = self.mesh.magnitude + self.ray.origin.get().abs().max_element();
        let error = gamma(32) * size;
        self.best = Some(Hit { t, normal: normal.normalized(), enters, class: 1, error, part: None });
    }
}
