//! What is wrong with a mesh, and what was mended, in words.

use std::fmt;

use glam::DVec3;

/// Why a mesh is not a closed surface. Vertices, faces and components are counted from 1.
#[derive(Clone, Debug, PartialEq)]
pub enum MeshFault {
    /// There is no face.
    Empty,
    /// A vertex has a coordinate that is NaN or infinite.
    NotFinite {
        /// The vertex.
        vertex: usize,
    },
    /// A vertex lies beyond what can be measured exactly.
    TooFar {
        /// The vertex.
        vertex: usize,
        /// The largest coordinate accepted, mm.
        limit_mm: f64,
    },
    /// A face names a vertex that is not there.
    IndexOutOfRange {
        /// The face.
        face: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// Some edges have a face on one side only.
    Open {
        /// How many such edges there are.
        edges: usize,
        /// The end points of one of them.
        example: [DVec3; 2],
    },
    /// An edge has more than two faces.
    NotManifold {
        /// How many faces share it.
        faces: usize,
        /// Its end points.
        example: [DVec3; 2],
    },
    /// The surface has only one side, like a Möbius strip or a Klein bottle.
    NotOrientable {
        /// An edge at which the windings disagree whichever way faces are turned.
        example: [DVec3; 2],
    },
    /// A component encloses no volume.
    Flat {
        /// The component.
        component: usize,
        /// How many components there are.
        of: usize,
    },
    /// A component lies inside another and looks the same way: solid within solid.
    OverlappingComponents {
        /// The inner component.
        component: usize,
        /// How many components there are.
        of: usize,
    },
    /// Two components share some volume, and each has some of its own (or they are equal).
    CrossingComponents {
        /// The two components.
        components: [usize; 2],
        /// How many components there are.
        of: usize,
        /// A place of both, about the deepest found.
        place: DVec3,
        /// How deep it lies under the surface of one of them, mm.
        depth_mm: f64,
    },
    /// Two faces of the surface pass through each other.
    SelfCrossing {
        /// How many pairs of faces do.
        pairs: usize,
        /// One of the places.
        place: DVec3,
    },
}

impl fmt::Display for MeshFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the mesh has no faces"),
            Self::NotFinite { vertex } => {
                write!(f, "vertex {vertex} has a coordinate that is not a finite number")
            }
            Self::TooFar { vertex, limit_mm } => {
                write!(f, "vertex {vertex} has a coordinate beyond {limit_mm:e} mm")
            }
            Self::IndexOutOfRange { face, vertices } => {
                write!(f, "face {face} names a vertex that is not among the {vertices} there are")
            }
            Self::Open { edges, example: [a, b] } => {
                let (edges_have, it) = if *edges == 1 { ("edge has", "it") } else { ("edges have", "one") };
                write!(
                    f,
                    "the surface is open: {edges} {edges_have} a face on one side only; {it} runs from {} to {}",
                    Place(*a),
                    Place(*b)
                )
            }
            Self::NotManifold { faces, example: [a, b] } => {
                write!(f, "the edge from {} to {} is shared by {faces} faces", Place(*a), Place(*b))
            }
            Self::NotOrientable { example: [a, b] } => {
                let (a, b) = (Place(*a), Place(*b));
                write!(
                    f,
                    "the surface has only one side; its windings cannot agree across the edge from {a} to {b}"
                )
            }
            Self::Flat { of: 1, .. } => write!(f, "the surface encloses no volume"),
            Self::Flat { component, of } => write!(f, "component {component} of {of} encloses no volume"),
            Self::OverlappingComponents { component, of } => write!(
                f,
                "component {component} of {of} lies inside another and faces the same way, so its volume would count twice"
            ),
            Self::CrossingComponents { components: [a, b], of, place, depth_mm } => write!(
                f,
                "components {a} and {b} of {of} overlap: they share volume near {}, {depth_mm:.3} mm deep, and it would \
                 count twice",
                Place(*place)
            ),
            Self::SelfCrossing { pairs, place } => {
                let s = if *pairs == 1 { "" } else { "s" };
                write!(f, "the surface crosses itself: {pairs} pair{s} of faces, one near {}", Place(*place))
            }
        }
    }
}

impl MeshFault {
    /// What a user can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Empty => "export the surface as triangles; a point cloud or an empty file has no inside",
            Self::NotFinite { .. } => "export the mesh again; NaN and infinity are no places",
            Self::TooFar { .. } => "check the units of the mesh",
            Self::IndexOutOfRange { .. } => "the file is damaged or cut short; export it again",
            Self::Open { .. } => {
                "close the holes (\"fill holes\" in MeshLab or Meshmixer, \"Make Manifold\" in Blender), weld with \
                 `weld_mm` if neighbouring faces only nearly share their corners, or take the surface out of the scene"
            }
            Self::NotManifold { .. } => {
                "remove doubled and inner faces (\"Remove Non-Manifold Edges\" in MeshLab), or part solids that share an edge, \
                 so that each edge has two faces"
            }
            Self::NotOrientable { .. } => "rebuild the surface; an organ needs an inside and an outside",
            Self::Flat { .. } => "give the organ a thickness, or take it out of the scene",
            Self::OverlappingComponents { .. } => {
                "turn the inner component inside out if it is a cavity, or make it an organ of its own"
            }
            Self::CrossingComponents { .. } => {
                "move them apart or face to face, unite them into one surface (\"Boolean union\" in Blender), or make one of \
                 them an organ of its own"
            }
            Self::SelfCrossing { .. } => {
                "repair the surface (\"Self Intersecting Faces\" in MeshLab finds them), or rebuild it by remeshing"
            }
        }
    }
}

impl std::error::Error for MeshFault {}

/// A repair that changed nothing about the enclosed body, to be told to the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Faces with two equal corners were left out.
    CollapsedFaces(usize),
    /// Vertices of no face were left out.
    UnusedVertices(usize),
    /// Faces wound against their neighbours were turned.
    TurnedFaces {
        /// How many.
        turned: usize,
        /// Out of how many.
        of: usize,
    },
    /// Components that looked inwards were turned outwards (and cavities inwards).
    TurnedInsideOut {
        /// How many.
        components: usize,
        /// Out of how many.
        of: usize,
    },
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CollapsedFaces(1) => write!(f, "1 face without area was left out"),
            Self::CollapsedFaces(n) => write!(f, "{n} faces without area were left out"),
            Self::UnusedVertices(1) => write!(f, "1 vertex belongs to no face and was left out"),
            Self::UnusedVertices(n) => write!(f, "{n} vertices belong to no face and were left out"),
            Self::TurnedFaces { turned, of } => {
                write!(f, "{turned} of {of} faces were wound against their neighbours and were turned")
            }
            Self::TurnedInsideOut { of: 1, .. } => write!(f, "the surface was inside out and was turned"),
            Self::TurnedInsideOut { components, of } => {
                write!(f, "{components} of {of} components were inside out and were turned")
            }
        }
    }
}

/// A point in words: `(1.5, -20, 33.25) mm`.
pub struct Place(pub DVec3);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Rounded to a micrometre: enough to find, short enough to read.
        let round = |x: f64| (x * 1e3).round() / 1e3 + 0.0;
        write!(f, "({}, {}, {}) mm", round(self.0.x), round(self.0.y), round(self.0.z))
    }
}
