//! STL files of both kinds, good and bad.

use super::*;

const TEXT: &str = "solid left kidney\n facet normal nan 0 0\n  OUTER LOOP\n   vertex 0 0 0\n   vertex 1 0 0\n   \
                    vertex 0 1e0 0\n  endloop\n endfacet\nendsolid left kidney\n";

#[test]
fn text_and_binary_give_the_same_mesh() {
    let text = read_well("t.stl", TEXT);
    assert_eq!(text.mesh, read_well("b.STL", binary_stl(b"", 1, &[TRIANGLE])).mesh);
    assert_eq!(text.groups, ["left kidney"]);
    assert_eq!(read_well("no extension", TEXT), text);
}

#[test]
fn a_binary_file_that_begins_with_solid_is_binary() {
    let second = TRIANGLE.map(|[x, y, z]| [x - 3.5, y, z + 0.1]);
    let expected = read_well("s.stl", binary_stl(b"", 2, &[TRIANGLE, second])).mesh;
    assert_eq!(expected.vertices[3], DVec3::new(-3.5, 0.0, f64::from(0.1f32)));
    for name in [&b"solid torus"[..], b"solid x\n", b"solid ", b"SOLID\r\nfacet normal 0 0 1"] {
        let mut header = name.to_vec();
        header.resize(80, b' ');
        let file = read_well("s.stl", binary_stl(&header, 2, &[TRIANGLE, second]));
        assert_eq!((file.mesh, file.groups.len()), (expected.clone(), 0));
    }
}

#[test]
fn a_text_keeps_the_digits_that_f32_would_lose() {
    let file = read_well("d.stl", TEXT.replace("vertex 0 0 0", "vertex 0.1 -1133.590001 1e-50"));
    assert_eq!(file.mesh.vertices[0], DVec3::new(0.1, -1133.590001, 1e-50));
}

#[test]
fn stl_io_reads_the_same_text_up_to_its_f32() {
    let text = TEXT.to_lowercase().replace("nan", "1").replace("vertex 0 0 0", "vertex 0.1 -7.7 1e-5");
    let theirs = stl_io::read_stl(&mut std::io::Cursor::new(&text)).expect("a mesh");
    let ours = read_well("t.stl", &text).mesh;
    let narrow: Vec<[f32; 3]> = ours.vertices.iter().map(|v| v.as_vec3().to_array()).collect();
    assert_eq!(narrow, theirs.vertices.iter().map(|v| v.0).collect::<Vec<_>>());
    assert_eq!(theirs.faces[0].vertices, [0, 1, 2]);
}

#[test]
fn every_solid_of_a_text_is_read_and_can_be_chosen() {
    let two = format!("{TEXT}{}", TEXT.replace("left", "right").replace("vertex 0 0 0", "vertex 0 0 9"));
    let both = read_well("k.stl", &two);
    assert_eq!(both.mesh.faces.len(), 2);
    assert_eq!(both.groups, ["left kidney", "right kidney"]);
    assert_eq!(both.notices, ["2 solids were found"]);
    let options = ReadOptions { groups: Some(vec!["right kidney".into()]), ..ReadOptions::default() };
    let right = read_as("k.stl", &two, &options).expect("a mesh").mesh;
    assert_eq!(right.vertices[0].z, 9.0);

    let nameless = two.replace(" left kidney", "").replace(" right kidney", "").replace('\n', "\r\n");
    assert_eq!(read_well("k.stl", nameless).mesh, both.mesh);
}

#[test]
fn four_billion_announced_triangles_on_a_short_file_fail_at_once() {
    let message = refusal("huge.stl", binary_stl(b"", u32::MAX, &[TRIANGLE]));
    assert_says(
        &message,
        &["huge.stl", "4294967295 triangles", "214748364834 bytes", "134 bytes", "cut short"],
    );
}

#[test]
fn damaged_files_are_refused_with_the_place() {
    let mut wrong = TRIANGLE;
    wrong[2][1] = f32::NAN;
    let message = refusal("n.stl", binary_stl(b"", 2, &[TRIANGLE, wrong]));
    assert_says(&message, &["n.stl, triangle 2 of 2", "finite"]);
    assert_says(&refusal("s.stl", b"short"), &["5 bytes", "84"]);
    assert_says(&refusal("z.stl", binary_stl(b"solid", 0, &[])), &["0 triangles"]);
    assert_says(&refusal("e.stl", "solid Empty\nendsolid Empty\n"), &["no triangles"]);
    assert_says(&refusal("i.stl", TEXT.replace("0 1e0 0", "0 inf 0")), &["line 8", "finite"]);
    assert_says(&refusal("w.stl", TEXT.replace("0 1e0 0", "0 1e0")), &["line 6", "three numbers"]);
    assert_says(&refusal("v.stl", TEXT.replace("   vertex 1 0 0\n", "")), &["line 7", "2 vertices"]);
    assert_says(&refusal("o.stl", TEXT.replace("endfacet", "facet")), &["line 8", "“facet”"]);
    assert_says(&refusal("c.stl", TEXT.replace("endsolid left kidney\n", "")), &["endsolid", "cut short"]);
    assert_says(&refusal("c.stl", &TEXT[..60]), &["line 4", "“vert” is out of place inside a facet"]);
}

#[test]
fn bytes_after_the_last_triangle_are_announced() {
    let mut bytes = binary_stl(b"", 1, &[TRIANGLE]);
    bytes.extend(b"tail");
    assert_says(&read_well("t.stl", bytes).notices.join(""), &["4 bytes after the last triangle"]);
}
