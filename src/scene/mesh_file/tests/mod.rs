//! Readers against files from memory, against independent readers and writers, and against damage.

mod obj;
mod ply;
mod stl;

use std::path::Path;

use glam::DVec3;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

use super::*;

/// Four vertices, four faces, volume 1/6.
const TETRAHEDRON: &str = "\
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
";

fn read_as(name: &str, bytes: impl AsRef<[u8]>, options: &ReadOptions) -> Result<MeshFile> {
    read_bytes(Path::new(name), bytes.as_ref(), options)
}

fn read_well(name: &str, bytes: impl AsRef<[u8]>) -> MeshFile {
    read_as(name, bytes, &ReadOptions::default()).expect("a mesh")
}

/// Subject, problem and remedy of the refusal, in one line.
fn refusal(name: &str, bytes: impl AsRef<[u8]>) -> String {
    refusal_with(name, bytes, &ReadOptions::default())
}

fn refusal_with(name: &str, bytes: impl AsRef<[u8]>, options: &ReadOptions) -> String {
    match read_as(name, bytes, options).expect_err("a refusal") {
        Error::Input { subject, problem, remedy } => format!("{subject}: {problem}; {remedy}"),
        other => panic!("not an input error: {other}"),
    }
}

fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "“{part}” is missing in: {message}");
    }
}

/// A binary STL: any header, the announced count, the triangles' corners.
fn binary_stl(header: &[u8], announced: u32, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend(announced.to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

#[derive(Clone, Copy, Debug)]
enum PlyKind {
    Text,
    Little,
    Big,
}

/// A PLY file with double coordinates and polygons of any size.
fn ply_file(kind: PlyKind, vertices: &[DVec3], polygons: &[Vec<i32>]) -> Vec<u8> {
    let format = match kind {
        PlyKind::Text => "ascii",
        PlyKind::Little => "binary_little_endian",
        PlyKind::Big => "binary_big_endian",
    };
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment by hand\nelement vertex {}\nproperty double x\nproperty double y\n\
         property uchar red\nproperty double z\nelement face {}\nproperty list uchar int vertex_indices\n\
         end_header\n",
        vertices.len(),
        polygons.len()
    )
    .into_bytes();
    for v in vertices {
        match kind {
            PlyKind::Text => bytes.extend(format!("{} {} 255 {}\n", v.x, v.y, v.z).bytes()),
            PlyKind::Little => {
                bytes.extend([v.x, v.y].iter().flat_map(|x| x.to_le_bytes()));
                bytes.push(255);
                bytes.extend(v.z.to_le_bytes());
            }
            PlyKind::Big => {
                bytes.extend([v.x, v.y].iter().flat_map(|x| x.to_be_bytes()));
                bytes.push(255);
                bytes.extend(v.z.to_be_bytes());
            }
        }
    }
    for polygon in polygons {
        match kind {
            PlyKind::Text => {
                bytes.extend(polygon.len().to_string().bytes());
                bytes.extend(polygon.iter().flat_map(|i| format!(" {i}").into_bytes()));
                bytes.push(b'\n');
            }
            PlyKind::Little => {
                bytes.push(polygon.len() as u8);
                bytes.extend(polygon.iter().flat_map(|i| i.to_le_bytes()));
            }
            PlyKind::Big => {
                bytes.push(polygon.len() as u8);
                bytes.extend(polygon.iter().flat_map(|i| i.to_be_bytes()));
            }
        }
    }
    bytes
}

const PLY_KINDS: [PlyKind; 3] = [PlyKind::Text, PlyKind::Little, PlyKind::Big];

/// A unit cube of six quadrilaterals.
fn cube() -> (Vec<DVec3>, Vec<Vec<i32>>) {
    let vertices =
        (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
    let polygons = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (vertices, polygons.map(Vec::from).to_vec())
}

fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).expect("the text to replace");
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

#[test]
fn an_unknown_extension_is_refused_with_the_list() {
    assert_says(&refusal("mesh.gltf", "v 0 0 0"), &["mesh.gltf", ".obj, .stl or .ply"]);
    assert_says(&refusal("mesh", "hello"), &[".obj, .stl or .ply"]);
    assert_eq!(read_well("mesh", TETRAHEDRON), read_well("mesh.OBJ", TETRAHEDRON));
    let options = ReadOptions { format: Some(Format::Obj), ..ReadOptions::default() };
    assert!(read_as("mesh.txt", TETRAHEDRON, &options).is_ok());
}

#[test]
fn folders_missing_files_and_large_files_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("t.obj");
    let options = ReadOptions { max_bytes: TETRAHEDRON.len() as u64, ..ReadOptions::default() };
    assert!(matches!(read(&path, &options), Err(Error::Io { action: "read", .. })));
    std::fs::write(&path, TETRAHEDRON).expect("written");
    assert!(read(&path, &options).is_ok());
    std::fs::write(&path, format!("{TETRAHEDRON}\n")).expect("written");
    assert_says(&read(&path, &options).expect_err("too large").to_string(), &["t.obj", "limit of"]);
    assert_says(&read(folder.path(), &options).expect_err("a folder").to_string(), &["not a regular file"]);
}

#[test]
fn a_welding_distance_that_is_no_distance_is_refused() {
    for distance in [-1.0, f64::NAN, f64::INFINITY] {
        let options = ReadOptions { weld_file_units: distance, ..ReadOptions::default() };
        assert_says(&refusal_with("t.obj", TETRAHEDRON, &options), &["welding distance"]);
    }
}

/// A runner whose cases are the same on every run.
fn runner(seed: u8) -> TestRunner {
    let config = ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]))
}

const ROUND_TRIP_SEED: u8 = 17;
const DAMAGE_SEED: u8 = 23;

/// Meshes of distinct vertices whose coordinates STL can hold, without collapsed faces.
fn meshes() -> impl Strategy<Value = TriMesh> {
    let coordinate = any::<f32>().prop_map(|x| f64::from(if x.is_finite() { x % 4096.0 } else { 0.5 }));
    let vertices = prop::collection::vec([coordinate.clone(), coordinate.clone(), coordinate], 3..40);
    let corners = prop::collection::vec([any::<u32>(), any::<u32>(), any::<u32>()], 1..60);
    (vertices, corners)
        .prop_map(|(vertices, corners)| {
            let vertices: Vec<DVec3> = vertices.into_iter().map(DVec3::from).collect();
            let count = vertices.len() as u32;
            let mut faces: Vec<[u32; 3]> = corners.into_iter().map(|f| f.map(|v| v % count)).collect();
            faces.push([0, 1, 2]);
            weld(&TriMesh { vertices, faces }, 0.0).mesh
        })
        .prop_filter("a face must be left", |mesh| !mesh.faces.is_empty())
}

#[test]
fn every_format_returns_the_mesh_that_was_written() {
    runner(ROUND_TRIP_SEED)
        .run(&meshes(), |mesh| {
            let polygons: Vec<Vec<i32>> = mesh.faces.iter().map(|f| f.map(|v| v as i32).to_vec()).collect();
            for kind in PLY_KINDS {
                prop_assert_eq!(&read_well("m.ply", ply_file(kind, &mesh.vertices, &polygons)).mesh, &mesh);
            }

            let narrow = |v: DVec3| stl_io::Vertex::new(v.as_vec3().to_array());
            let triangles: Vec<stl_io::Triangle> = mesh
                .triangles()
                .map(|t| stl_io::Triangle { normal: stl_io::Normal::new([0.0; 3]), vertices: t.map(narrow) })
                .collect();
            let mut binary = Vec::new();
            stl_io::write_stl(&mut binary, triangles.iter()).expect("written");
            prop_assert_eq!(&read_well("m.stl", &binary).mesh, &mesh);

            let facets: String = mesh
                .triangles()
                .map(|t| {
                    let corners = t.map(|v| format!("vertex {} {} {}\n", v.x, v.y, v.z)).concat();
                    format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
                })
                .collect();
            prop_assert_eq!(&read_well("m.stl", format!("solid\n{facets}endsolid\n")).mesh, &mesh);

            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("m.obj");
            crate::output::obj::write(
                &path,
                &[],
                &[crate::output::obj::NamedMesh { name: "m", mesh: &mesh }],
            )
            .expect("written");
            prop_assert_eq!(&read(&path, &ReadOptions::default()).expect("a mesh").mesh, &mesh);
            Ok(())
        })
        .expect("equal meshes");
}

#[test]
fn damaged_bytes_never_panic_and_never_give_a_wrong_index() {
    let (vertices, polygons) = cube();
    let mut files: Vec<(&str, Vec<u8>)> =
        PLY_KINDS.iter().map(|&kind| ("d.ply", ply_file(kind, &vertices, &polygons))).collect();
    files.push(("d.obj", TETRAHEDRON.as_bytes().to_vec()));
    files.push(("d.obj", format!("o a\n{TETRAHEDRON}g b c\nf 1 \\\n-1 2 3\nusemtl m\nl 1 2\n").into_bytes()));
    files.push(("d.stl", binary_stl(b"solid", 2, &[TRIANGLE, TRIANGLE])));
    let damage = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4);
    let cases = (prop::sample::select(files), damage, any::<prop::sample::Index>(), any::<bool>());
    runner(DAMAGE_SEED)
        .run(&cases, |((name, mut bytes), damage, end, cut)| {
            for (at, value) in damage {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            if cut {
                bytes.truncate(end.index(bytes.len()));
            }
            if let Ok(file) = read_as(name, &bytes, &ReadOptions::default()) {
                let count = file.mesh.vertices.len() as u32;
                prop_assert!(file.mesh.faces.as_flattened().iter().all(|&v| v < count));
                prop_assert!(file.mesh.vertices.iter().all(|v| v.is_finite()));
            }
            Ok(())
        })
        .expect("no panic");
}
