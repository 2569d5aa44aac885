//! PLY files of all three encodings, good and bad.

use super::*;

#[test]
fn a_cube_of_quadrilaterals_is_read_in_all_three_encodings() {
    let (vertices, polygons) = cube();
    for kind in PLY_KINDS {
        let file = read_well("c.ply", ply_file(kind, &vertices, &polygons));
        assert_eq!((file.mesh.vertices.len(), file.mesh.faces.len()), (8, 12), "{kind:?}");
        assert!((file.mesh.signed_volume() - 1.0).abs() < 1e-15, "{kind:?}");
        assert_eq!(file.notices, ["6 polygons were split into triangles"]);
    }
}

#[test]
fn vertices_repeated_for_texture_seams_are_joined() {
    let (vertices, polygons) = cube();
    let repeated: Vec<DVec3> = polygons.iter().flatten().map(|&i| vertices[i as usize]).collect();
    let own: Vec<Vec<i32>> = (0..6).map(|f| (4 * f..4 * f + 4).collect()).collect();
    let file = read_well("c.ply", ply_file(PlyKind::Text, &repeated, &own));
    assert_eq!(file.mesh.vertices.len(), 8);
    assert_says(&file.notices.join("\n"), &["16 vertices were joined"]);
}

#[test]
fn a_point_cloud_is_refused_with_the_remedy() {
    let cloud = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n0 0 0\n";
    assert_says(&refusal("p.ply", cloud), &["p.ply", "no faces: a point cloud", "make a surface first"]);
}

#[test]
fn counts_beyond_the_file_are_refused_before_anything_is_allocated() {
    let (vertices, polygons) = cube();
    for kind in PLY_KINDS {
        let bytes = ply_file(kind, &vertices, &polygons);
        for (from, to) in [
            ("element vertex 8\n", "element vertex 18446744073709551615\n"),
            ("element face 6\n", "element face 4000000\n"),
            ("element vertex 8\n", "element nothing 4000000000\nelement vertex 8\n"),
        ] {
            let message = refusal("b.ply", replaced(&bytes, from, to));
            assert!(message.contains("announces") || message.contains("no properties"), "{message}");
        }
        let options = ReadOptions { max_faces: 3, ..ReadOptions::default() };
        assert_says(&refusal_with("b.ply", &bytes, &options), &["limit of 3 triangles"]);
    }
}

#[test]
fn wrong_headers_and_rows_are_refused_with_the_place() {
    let (mut vertices, mut polygons) = cube();
    let text = ply_file(PlyKind::Text, &vertices, &polygons);
    let with = |from: &str, to: &str| refusal("w.ply", replaced(&text, from, to));
    assert_says(&with("ply\n", "plx\n"), &["begin with"]);
    assert_says(&with("format ascii", "format martian"), &["line 2", "header"]);
    assert_says(&with("double z", "double w"), &["no coordinate “z”"]);
    assert_says(&with("double z", "double x"), &["declares", "twice"]);
    assert_says(&with("uchar red", "double x"), &["declares", "twice"]);
    assert_says(&with("vertex_indices", "strip"), &["vertex_indices"]);
    assert_says(
        &with("uchar int vertex", "uchar float vertex"),
        &["“vertex_indices” is not a list of whole numbers"],
    );
    assert_says(&with("0 0 255 0\n", "0 zero 255 0\n"), &["w.ply, line 12", "vertex row", "header"]);
    assert_says(&with("0 0 255 0\n", "0 nan 255 0\n"), &["line 12"]);
    assert_says(&with("end_header", "comment"), &["header"]);

    polygons[1] = vec![4, 5];
    assert_says(
        &refusal("f.ply", ply_file(PlyKind::Big, &vertices, &polygons)),
        &["face 1 (from 0)", "2 of the three"],
    );
    polygons[1] = vec![4, 5, 8];
    assert_says(
        &refusal("f.ply", ply_file(PlyKind::Big, &vertices, &polygons)),
        &["face 1 (from 0)", "vertex 8"],
    );
    polygons[1] = vec![4, 5, -1];
    assert_says(
        &refusal("f.ply", ply_file(PlyKind::Big, &vertices, &polygons)),
        &["face 1 (from 0)", "negative"],
    );
    vertices[3].y = f64::INFINITY;
    assert_says(
        &refusal("v.ply", ply_file(PlyKind::Little, &vertices, &polygons)),
        &["vertex 3 (from 0)", "finite"],
    );
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let (vertices, polygons) = cube();
    for kind in PLY_KINDS {
        let bytes = ply_file(kind, &vertices, &polygons);
        // The last byte of a text is a line end that nothing needs.
        let whole = if matches!(kind, PlyKind::Text) { bytes.len() - 1 } else { bytes.len() };
        for end in 0..whole {
            assert!(read_as("cut.ply", &bytes[..end], &ReadOptions::default()).is_err(), "{kind:?} {end}");
        }
    }
}
