//! Which face lies across which edge.

use super::TriMesh;
use super::fault::MeshFault;

/// The faces across each face's three edges.
#[derive(Clone, Debug)]
pub struct Edges {
    across: Vec<[u32; 3]>,
}

/// Which faces hang together.
pub struct Components {
    /// The component of each face.
    pub of_face: Vec<u32>,
    /// How many there are.
    pub count: usize,
}

impl Edges {
    /// Finds each edge's two faces, whichever way they are wound.
    ///
    /// # Errors
    /// An edge with one face ([`MeshFault::Open`]) or more than two ([`MeshFault::NotManifold`]).
    pub fn new(mesh: &TriMesh) -> Result<Self, MeshFault> {
        let mut sides: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * mesh.faces.len());
        for (face, corners) in mesh.faces.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                sides.push(([a.min(b), a.max(b)], face as u32, i as u8));
            }
        }
        // Sorted, not hashed: the same file gives the same message every time.
        sides.sort_unstable();
        let ends = |edge: [u32; 2]| edge.map(|v| mesh.vertices[v as usize]);
        let edges = || sides.chunk_by(|x, y| x.0 == y.0);
        if let Some(edge) = edges().find(|e| e.len() > 2) {
            return Err(MeshFault::NotManifold { faces: edge.len(), example: ends(edge[0].0) });
        }
        if let Some(edge) = edges().find(|e| e.len() == 1) {
            let count = edges().filter(|e| e.len() == 1).count();
            return Err(MeshFault::Open { edges: count, example: ends(edge[0].0) });
        }
        let mut across = vec![[u32::MAX; 3]; mesh.faces.len()];
        for pair in edges() {
            let ((_, f, i), (_, g, j)) = (pair[0], pair[1]);
            across[f as usize][i as usize] = g;
            across[g as usize][j as usize] = f;
        }
        Ok(Self { across })
    }

    /// The faces across the edges from corner `i` to corner `i + 1`, `i` = 0, 1, 2.
    pub fn neighbours(&self, face: usize) -> [u32; 3] {
        self.across[face]
    }

    /// The pieces joined by edges, numbered in the order of their first face.
    pub fn components(&self, faces: usize) -> Components {
        const UNSEEN: u32 = u32::MAX;
        let mut of_face = vec![UNSEEN; faces];
        let mut count = 0;
        for first in 0..faces {
            if of_face[first] != UNSEEN {
                continue;
            }
            of_face[first] = count;
            let mut pending = vec![first];
            while let Some(face) = pending.pop() {
                for next in self.across[face].map(|f| f as usize) {
                    if of_face[next] == UNSEEN {
                        of_face[next] = count;
                        pending.push(next);
                    }
                }
            }
            count += 1;
        }
        Components { of_face, count: count as usize }
    }

    /// Turns a face over, keeping the record of its neighbours.
    pub fn turn(&mut self, mesh: &mut TriMesh, face: usize) {
        mesh.faces[face].swap(1, 2);
        self.across[face].swap(0, 2);
    }

    /// Turns faces so that neighbours run along their common edge in opposite directions, the fewer faces of each
    /// component; returns how many were turned.
    ///
    /// # Errors
    /// [`MeshFault::NotOrientable`] if no choice agrees everywhere.
    pub fn make_winding_consistent(&mut self, mesh: &mut TriMesh) -> Result<usize, MeshFault> {
        let mut state: Vec<Option<bool>> = vec![None; mesh.faces.len()];
        let mut total = 0;
        for first in 0..mesh.faces.len() {
            if state[first].is_some() {
                continue;
            }
            state[first] = Some(false);
            let mut members = vec![first];
            let mut next = 0;
            while next < members.len() {
                let face = members[next];
                next += 1;
                let turned = state[face] == Some(true);
                for i in 0..3 {
                    let (a, b) = (mesh.faces[face][i], mesh.faces[face][(i + 1) % 3]);
                    let other = self.across[face][i] as usize;
                    let should_turn = turned ^ runs_along(mesh.faces[other], a, b);
                    match state[other] {
                        None => {
                            state[other] = Some(should_turn);
                            members.push(other);
                        }
                        Some(known) if known != should_turn => {
                            let example = [a, b].map(|v| mesh.vertices[v as usize]);
                            return Err(MeshFault::NotOrientable { example });
                        }
                        Some(_) => {}
                    }
                }
            }
            total += self.turn_the_fewer(&members, &state, mesh);
        }
        Ok(total)
    }

    fn turn_the_fewer(&mut self, members: &[usize], state: &[Option<bool>], mesh: &mut TriMesh) -> usize {
        let marked = members.iter().filter(|&&f| state[f] == Some(true)).count();
        let turn_marked = 2 * marked <= members.len();
        for &face in members.iter().filter(|&&f| (state[f] == Some(true)) == turn_marked) {
            self.turn(mesh, face);
        }
        if turn_marked { marked } else { members.len() - marked }
    }
}

fn runs_along(face: [u32; 3], a: u32, b: u32) -> bool {
    (0..3).any(|i| face[i] == a && face[(i + 1) % 3] == b)
}
