//! OBJ files, good and bad.

use super::*;

#[test]
fn a_tetrahedron_has_four_faces_and_a_sixth_of_volume() {
    let file = read_well("t.obj", TETRAHEDRON);
    assert_eq!((file.mesh.vertices.len(), file.mesh.faces.len()), (4, 4));
    assert!((file.mesh.signed_volume() - 1.0 / 6.0).abs() < 1e-15);
    assert_eq!((file.groups.len(), file.notices.len()), (0, 0));
}

#[test]
fn negative_numbers_count_back_from_the_last_vertex_above() {
    let relative = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -1 -2\nv 0 0 1\nf -4 -3 -1\nf -4 -1 -2\nf -3 -2 -1\n";
    assert_eq!(read_well("r.obj", relative).mesh, read_well("t.obj", TETRAHEDRON).mesh);
}

#[test]
fn a_face_may_stand_above_its_vertices() {
    let (vertices, faces) = TETRAHEDRON.split_at(TETRAHEDRON.find('f').expect("faces"));
    assert_eq!(read_well("r.obj", format!("{faces}{vertices}")).mesh, read_well("t.obj", TETRAHEDRON).mesh);
}

#[test]
fn decimals_arrive_as_the_nearest_f64() {
    let file = read_well("d.obj", "v 0.1 1e-3 -7.25\nv 1133.59000000000001 2 3\nv 4 5 6\nf 1 2 3");
    assert_eq!(file.mesh.vertices[0], DVec3::new(0.1, 0.001, -7.25));
    assert_eq!(file.mesh.vertices[1].x, 1133.59);
}

#[test]
fn a_material_library_is_never_opened() {
    // Were it opened, reading would wait for a pipe or fail on a missing file.
    let text = format!("mtllib /dev/stdin ../../missing.mtl\nusemtl\nusemtl skin\n{TETRAHEDRON}");
    assert_eq!(read_well("t.obj", text).mesh, read_well("t.obj", TETRAHEDRON).mesh);
}

#[test]
fn seams_between_texture_coordinates_and_colours_do_not_split_vertices() {
    let text = "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0.5 0.5 0.5\nv 0 0 1\nvt 0 0\nvt 1 1\nvn 0 0 1\n\
                f 1/1/1 3/2/1 2/1/1\nf 1/2 2/2 4/1\nf 1//1 4//1 3//1\nf 2/99999999999999 3/-7 4\n";
    assert_eq!(read_well("s.obj", text).mesh, read_well("t.obj", TETRAHEDRON).mesh);
}

#[test]
fn comments_continued_lines_and_foreign_line_ends_are_understood() {
    let text = TETRAHEDRON.replace("f 1 3 2", "# caf\u{e9}\nf 1 3 \\\n2 # first");
    let expected = read_well("t.obj", TETRAHEDRON).mesh;
    for end in ["\n", "\r\n", "\r"] {
        assert_eq!(read_well("c.obj", text.replace('\n', end)).mesh, expected);
    }
    let latin1: Vec<u8> = text.chars().map(|c| c as u8).collect();
    assert_eq!(read_well("c.obj", latin1).mesh, expected);
}

#[test]
fn a_notched_polygon_keeps_its_area() {
    // A U, which no fan of triangles covers without folding.
    let text = "v 0 0 0\nv 3 0 0\nv 3 2 0\nv 2 2 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6 7 8\n";
    let file = read_well("u.obj", text);
    assert_eq!(file.mesh.faces.len(), 6);
    assert!((file.mesh.area() - 5.0).abs() < 1e-14, "{}", file.mesh.area());
    assert_eq!(file.notices, ["1 polygon was split into triangles"]);
}

#[test]
fn a_polygon_that_crosses_itself_is_announced() {
    let text = "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 3 0\nf 1 2 3 4\n";
    assert_says(&read_well("b.obj", text).notices.join("\n"), &["line 5", "without overlap", "split it"]);
}

#[test]
fn groups_are_chosen_by_object_by_group_and_by_the_whole_text_of_several() {
    let text = TETRAHEDRON
        .replace("f 1 3 2", "o liver\ng left lobe\nf 1 3 2")
        .replace("f 1 4 3", "g back\nf 1 4 3")
        .replace("f 2 3 4", "o spleen\nf 2 3 4");
    let faces = |names: &[&str]| {
        let groups = Some(names.iter().map(ToString::to_string).collect());
        let options = ReadOptions { groups, ..ReadOptions::default() };
        read_as("g.obj", &text, &options).expect("a mesh").mesh.faces.len()
    };
    assert_eq!(read_well("g.obj", &text).groups, ["liver", "left lobe", "left", "lobe", "back", "spleen"]);
    assert_eq!(faces(&["liver"]), 3);
    assert_eq!(faces(&["left lobe"]), 2);
    assert_eq!(faces(&["lobe", "left"]), 2);
    // A group ends with the next `g`, not with the next object.
    assert_eq!(faces(&["back"]), 2);
    assert_eq!(faces(&["spleen", "liver"]), 4);
}

#[test]
fn an_unknown_group_is_refused_with_the_names_that_are_there() {
    let text = TETRAHEDRON.replace("f 1 3 2", "g empty\no liver\ng front\nf 1 3 2");
    let chosen = |name: &str| ReadOptions { groups: Some(vec![name.into()]), ..ReadOptions::default() };
    assert_says(&refusal_with("g.obj", &text, &chosen("kidney")), &["g.obj", "“kidney”", "“liver”, “front”"]);
    assert_says(&refusal_with("g.obj", &text, &chosen("empty")), &["no group “empty” with faces"]);
    assert_says(&refusal_with("t.obj", TETRAHEDRON, &chosen("liver")), &["names no groups"]);
    let none = ReadOptions { groups: Some(vec![]), ..ReadOptions::default() };
    assert_says(&refusal_with("g.obj", &text, &none), &["empty"]);
}

#[test]
fn lines_and_points_do_not_become_faces() {
    let file = read_well("l.obj", format!("{TETRAHEDRON}l 1 2 3\np 4\n"));
    assert_eq!(file.mesh.faces.len(), 4);
    assert_says(&file.notices.join("\n"), &["2 of lines", "line 9"]);
}

#[test]
fn wrong_statements_are_refused_with_their_line() {
    let with = |line: &str| refusal("w.obj", format!("{TETRAHEDRON}{line}\n"));
    assert_says(&with("v 0 nan 0"), &["w.obj, line 9", "finite"]);
    assert_says(&with("v 0 0 inf"), &["line 9", "finite"]);
    assert_says(&with("v 0 0 1e16"), &["line 9", "unit"]);
    assert_says(&with("v 0 0"), &["line 9", "2 numbers"]);
    assert_says(&with("v 0 0 0,5"), &["line 9", "“0,5”", "point"]);
    assert_says(&with("v 0 0 0 0.5"), &["line 9", "weight 0.5"]);
    assert_says(&with("f 1 2"), &["line 9", "2 of the three corners"]);
    assert_says(&with("f"), &["line 9", "0 of the three corners"]);
    assert_says(&with("f 1 2 5"), &["line 9", "vertex 5", "4 vertices"]);
    assert_says(&with("f 1 2 0"), &["line 9", "counts vertices from 1"]);
    assert_says(&with("f 1 2 -5"), &["line 9", "vertex -5"]);
    assert_says(&with("f 1 2 -9223372036854775808"), &["line 9", "vertex -9223372036854775808"]);
    assert_says(&with("f 1 2 99999999999999999999"), &["line 9", "not the number of a vertex"]);
    assert_says(&with("f 1 2 //3"), &["line 9", "“//3”"]);
}

#[test]
fn files_without_faces_are_refused() {
    assert_says(&refusal("e.obj", ""), &["e.obj", "empty"]);
    assert_says(&refusal("p.obj", "v 0 0 0\n"), &["no faces: a point cloud"]);
    assert_says(&refusal("x.obj", "hello\n"), &["neither vertices nor faces"]);
    assert_says(&refusal("z.obj", "v 0 0 0\nv 1 0 0\nf 1 2 1\n"), &["three distinct vertices"]);
}

#[test]
fn texture_coordinates_and_objects_leave_the_triangles_as_they_are() {
    let text =
        TETRAHEDRON.replace("f 1 3 2", "vt 0 0\nvt 1 0\no a\nf 1/1 3/2 2/1").replace("f 2", "o b\nf 2");
    let [o, x, y, z] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let triangles: Vec<[DVec3; 3]> = read_well("t.obj", text).mesh.triangles().collect();
    assert_eq!(triangles, [[o, y, x], [o, x, z], [o, z, y], [x, y, z]]);
}

#[test]
fn vertices_shared_between_groups_stay_shared() {
    let text = TETRAHEDRON.replace("f 1 3 2", "o a\nf 1 3 2").replace("f 1 4 3", "g b\nf 1 4 3");
    let file = read_well("t.obj", &text);
    assert_eq!(file.mesh, read_well("t.obj", TETRAHEDRON).mesh);
    assert_eq!(file.notices.len(), 0, "{:?}", file.notices);

    let options = ReadOptions { groups: Some(vec!["b".into()]), ..ReadOptions::default() };
    let part = read_as("t.obj", &text, &options).expect("a mesh").mesh;
    assert_eq!(part.vertices, [DVec3::ZERO, DVec3::Z, DVec3::Y, DVec3::X]);
    assert_eq!(part.faces, [[0, 1, 2], [3, 2, 1]]);
}

#[test]
fn triangles_and_polygons_may_be_mixed_in_any_order() {
    let text =
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 1 3 0\nf 1 2 3 4\ng roof\nf 4 3 5\nf 1 2 3 5 4\nf 1 2 4\n";
    let file = read_well("m.obj", text);
    assert_eq!(file.mesh.faces.len(), 2 + 1 + 3 + 1);
    assert_eq!(file.mesh.area(), 4.0 + 1.0 + 5.0 + 2.0);
    assert_eq!(file.notices, ["2 polygons were split into triangles"]);
    let options = ReadOptions { groups: Some(vec!["roof".into()]), ..ReadOptions::default() };
    assert_eq!(read_as("m.obj", text, &options).expect("a mesh").mesh.area(), 8.0);
}

#[test]
fn a_material_without_a_name_is_no_error() {
    for line in ["usemtl", "usemtl ", "mtllib", "usemtl\t"] {
        let text = TETRAHEDRON.replace("f 1 4 3", &format!("{line}\nf 1 4 3"));
        assert_eq!(read_well("t.obj", text), read_well("t.obj", TETRAHEDRON), "{line}");
    }
}

/// Whoever opens a pipe without a writer waits for one.
#[cfg(unix)]
#[test]
fn a_material_library_of_absolute_path_is_never_opened() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("skin.mtl");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs");
    assert!(made.success());
    let text = format!("mtllib {}\nusemtl skin\n{TETRAHEDRON}", pipe.display());
    let (done, wait) = std::sync::mpsc::channel();
    std::thread::spawn(move || done.send(read_well("t.obj", text).mesh.faces.len()));
    assert_eq!(wait.recv_timeout(std::time::Duration::from_secs(20)), Ok(4));
}

#[test]
fn names_that_no_person_wrote_are_refused_with_their_line() {
    let long = "x".repeat(2000);
    assert_says(
        &refusal("n.obj", format!("{TETRAHEDRON}g {long}\nf 1 2 3\n")),
        &["line 9", "2000 bytes", "xxx…", "at most 1024"],
    );
}

#[test]
fn a_file_of_more_triangles_than_the_limit_is_refused() {
    let limit = |max_faces| ReadOptions { max_faces, ..ReadOptions::default() };
    let quadrilateral = TETRAHEDRON.replace("f 2 3 4", "f 1 2 3 4");
    assert!(read_as("t.obj", &quadrilateral, &limit(5)).is_ok());
    assert_says(&refusal_with("t.obj", &quadrilateral, &limit(4)), &["limit of 4 triangles"]);
}
