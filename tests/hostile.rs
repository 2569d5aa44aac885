//! Input that means harm, or none: bombs, odd names, links that lead away.

mod common;

use std::process::{Command, Output};

use common::nested_balls;
use common::run::chordfield;

const PROGRAM: &str = env!("CARGO_BIN_EXE_chordfield");

fn said(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr].concat();
    let text = String::from_utf8_lossy(&text).replace(['|', '\n'], " ");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A scene of one ball, `shape` in place of its shape.
fn with_inner(inner: &str) -> String {
    nested_balls(16).replace(
        "shape = { kind = \"ellipsoid\", half_axes_mm = [20, 15, 10], faces = 400, move_mm = [10, 5, -8] }",
        inner,
    )
}

/// A scene to be rendered of one mesh.
fn traced_mesh(file: &str) -> String {
    format!(
        "name = \"bild\"\nsky = {{ radius = 900, colours = [\"#000000\", \"#ffffff\"] }}\n\
         cameras = [{{ eye = [0, -60, 0], target = [0, 0, 0] }}]\n[[object]]\nname = \"mesh\"\n\
         shape = {{ kind = \"mesh\", file = \"{file}\" }}\n"
    )
}

const LIST_OF_PATHS: &str =
    "source_x_mm,source_y_mm,source_z_mm,target_x_mm,target_y_mm,target_z_mm\n0,-90,0,1,90,2\n";

const TETRAHEDRON: &str = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[cfg(target_os = "linux")]
#[test]
fn bombs_are_refused_in_a_sentence_and_in_little_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("a file");
    let balls = nested_balls(16);
    let four_billion = 4_000_000_000_u32;
    write("faces.stl", &[&[b' '; 80][..], &four_billion.to_le_bytes(), &[0; 50]].concat());
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n";
    write("list.ply", &[head.as_bytes(), &[0; 36], &four_billion.to_le_bytes(), &[0; 12]].concat());
    write("faces.ply", head.replace("face 1", "face 4000000000").as_bytes());
    write("vertices.ply", head.replace("vertex 3", "vertex 18446744073709551615").as_bytes());
    write("corner.obj", format!("{TETRAHEDRON}f 1 2 4000000000\n").as_bytes());
    write("polygon.obj", format!("{TETRAHEDRON}f {}\n", "1 2 3 4 ".repeat(200_000)).as_bytes());
    write("nested.toml", format!("x = {}{}\n{balls}", "[".repeat(100_000), "]".repeat(100_000)).as_bytes());
    write(
        "tables.toml",
        format!("x = {}1{}\n{balls}", "{x = ".repeat(100_000), "}".repeat(100_000)).as_bytes(),
    );
    write("dotted.toml", format!("{} = 1\n{balls}", vec!["x"; 100_000].join(".")).as_bytes());
    write("key.toml", format!("{} = 1\n{balls}", "x".repeat(4_000_000)).as_bytes());
    write("long.toml", format!("# {}\n{balls}", "x".repeat(20_000_000)).as_bytes());
    write("pixels.toml", balls.replace("pixels = [16, 16]", "pixels = [31623, 31623]").as_bytes());
    write("angles.toml", balls.replace("kind = \"parallel\"", "gantry_deg = \"0..360:1e-9\"").as_bytes());
    write("shape.toml", balls.replace("faces = 600", "faces = 4000000000").as_bytes());
    write("balls.toml", balls.as_bytes());
    let commands: [(&[&str], &str); 16] = [
        (&["check", "faces.stl"], "4000000000 triangles"),
        (&["check", "list.ply"], "ends before the last face row"),
        (&["check", "faces.ply"], "limit of 20000000 triangles"),
        (&["check", "vertices.ply"], "vertex"),
        (&["check", "corner.obj"], "vertex 4000000000"),
        (&["check", "polygon.obj"], "cannot be used"),
        (&["project", "nested.toml"], "recurs"),
        (&["project", "tables.toml"], "recurs"),
        (&["project", "dotted.toml"], "recursion limit"),
        (&["project", "key.toml"], "unknown field"),
        (&["project", "long.toml"], "larger than the limit"),
        (&["project", "pixels.toml"], "GB of memory"),
        (&["project", "angles.toml"], "360000000000 values"),
        (&["project", "shape.toml"], "4000000000 faces"),
        (&["project", "balls.toml", "--size", "31623x31623"], "GB of memory"),
        (&["audit", "balls.toml", "--gantry", "0..360:1e-6"], "angles"),
    ];
    for (args, words) in commands {
        // 600 MB of addresses: the program, its threads' stacks, and what it reads.
        let script = "ulimit -v 600000; exec \"$0\" \"$@\"";
        let run = Command::new("sh")
            .current_dir(folder.path())
            .args(["-c", script, PROGRAM, "--threads", "2"])
            .args(args)
            .output()
            .expect("sh");
        let said = said(&run);
        assert_eq!(run.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains(words) && said.len() < 1_500, "{args:?}, {} bytes: {said:.500}", said.len());
    }
    assert!(!folder.path().join("out").exists());
}

#[test]
fn names_with_spaces_quotes_and_other_alphabets_work_from_scene_to_output() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenes = folder.path().join("Größe & 'Maß' 大");
    std::fs::create_dir_all(scenes.join("mesh es")).expect("a folder");
    std::fs::write(scenes.join("mesh es/печень 肝.obj"), TETRAHEDRON).expect("a mesh");
    std::fs::write(scenes.join("szene 1.toml"), with_inner("mesh = { file = \"mesh es/печень 肝.obj\" }"))
        .expect("a scene");
    let scene = "Größe & 'Maß' 大/szene 1.toml";
    let run = chordfield(folder.path(), &["project", scene, "-o", "aus gabe/ö", "--write", "p"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    assert!(folder.path().join("aus gabe/ö/balls.json").exists());
    let study = "scene = \"szene 1.toml\"\npaths = { csv = \"mesh es/дорожки 路.csv\" }\n";
    std::fs::write(scenes.join("étude.toml"), study).expect("a study");
    std::fs::write(scenes.join("mesh es/дорожки 路.csv"), LIST_OF_PATHS).expect("a list");
    let run = chordfield(folder.path(), &["dose", "Größe & 'Maß' 大/étude.toml", "-o", "aus gabe/ö"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    assert!(folder.path().join("aus gabe/ö/paths.csv").exists());
    std::fs::write(scenes.join("bild.toml"), traced_mesh("mesh es/печень 肝.obj")).expect("a scene");
    let bild = "Größe & 'Maß' 大/bild.toml";
    let run = chordfield(folder.path(), &["trace", bild, "--size", "8x8", "-o", "aus gabe/ö"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let run = chordfield(folder.path(), &["audit", scene, "--limit-mm", "0", "--max-depth", "8"]);
    assert_eq!(run.status.code(), Some(1), "{}", said(&run));
    // The command that finds the worst ray again is one for a shell.
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    let command = said.split("to see it again: ").nth(1).expect("a command").trim();
    let by_shell = command.replacen("chordfield", PROGRAM, 1);
    let again = Command::new("sh").current_dir(folder.path()).args(["-c", &by_shell]).output().expect("sh");
    assert_eq!(again.status.code(), Some(0), "{command}: {}", String::from_utf8_lossy(&again.stderr));
}

#[cfg(unix)]
#[test]
fn links_that_lead_out_of_the_scenes_folder_are_not_followed_and_what_meshes_name_is_not_opened() {
    let root = tempfile::tempdir().expect("a folder");
    let scenes = root.path().join("scenes");
    std::fs::create_dir(&scenes).expect("a folder");
    std::fs::write(root.path().join("secret.obj"), TETRAHEDRON).expect("a mesh");
    std::fs::write(root.path().join("secret.csv"), "energy_keV,weight\n60,1\n").expect("a spectrum");
    let link = |to: &str, name: &str| std::os::unix::fs::symlink(to, scenes.join(name)).expect("a link");
    link("../secret.obj", "mesh.obj");
    link("..", "up");
    link("../secret.csv", "spectrum.csv");
    std::fs::write(root.path().join("secret.toml"), nested_balls(16)).expect("a scene");
    link("loop.obj", "loop.obj");
    let refused_by = |command: &str, scene: String, words: &str| {
        std::fs::write(scenes.join("scene.toml"), scene).expect("a scene");
        let run = chordfield(root.path(), &[command, "scenes/scene.toml"]);
        assert_eq!(run.status.code(), Some(2), "{}", said(&run));
        assert!(said(&run).contains(words), "{}", said(&run));
    };
    let refused = |scene, words| refused_by("check", scene, words);
    for file in ["mesh.obj", "up/secret.obj"] {
        refused_by("trace", traced_mesh(file), "leaves the scene's folder");
        refused(with_inner(&format!("mesh = {{ file = \"{file}\" }}")), "leaves the scene's folder");
    }
    refused(with_inner("mesh = { file = \"loop.obj\" }"), "cannot read");
    refused(
        nested_balls(16).replace("energy_keV = 60", "file = \"spectrum.csv\""),
        "leaves the scene's folder",
    );
    for (key, file) in [("scene", "up/secret.toml"), ("paths = { csv", "spectrum.csv")] {
        let rest = if key == "scene" { "\npaths = { points = [{ at_mm = [0, 0, 0] }] }" } else { " }" };
        refused_by("dose", format!("{key} = \"{file}\"{rest}\n"), "leaves the scene's folder");
    }
    // A named pipe in place of the materials: to open it would be to wait for ever.
    assert!(Command::new("mkfifo").arg(root.path().join("colours.mtl")).status().expect("mkfifo").success());
    let mesh = format!("mtllib ../colours.mtl\nusemtl red\n{TETRAHEDRON}");
    std::fs::write(scenes.join("coloured.obj"), mesh).expect("a mesh");
    let run = chordfield(root.path(), &["check", "scenes/coloured.obj"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
}

#[cfg(unix)]
#[test]
fn named_pipes_are_refused_wherever_a_file_is_read_or_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("balls.toml", &nested_balls(16));
    write("study.toml", "scene = \"balls.toml\"\npaths = { points = [{ at_mm = [0, 0, 0] }] }\n");
    write("list.toml", "scene = \"balls.toml\"\npaths = { csv = \"pipe\" }\n");
    std::fs::create_dir_all(folder.path().join("parts/shard-1-of-2")).expect("a folder");
    for pipe in ["pipe", "pipe.toml", "pipe.obj", "parts/shard-1-of-2/sums.json"] {
        assert!(Command::new("mkfifo").arg(folder.path().join(pipe)).status().expect("mkfifo").success());
    }
    let commands: [&[&str]; 7] = [
        &["project", "balls.toml", "--load-trees", "pipe"],
        &["project", "balls.toml", "--save-trees", "pipe"],
        &["dose", "study.toml", "--join", "-o", "parts"],
        &["dose", "list.toml"],
        &["dose", "pipe"],
        &["trace", "pipe.toml"],
        &["check", "pipe.obj"],
    ];
    for args in commands {
        // To open one would be to wait for ever.
        let run =
            Command::new("timeout").current_dir(folder.path()).args(["20", PROGRAM]).args(args).output();
        let run = run.expect("timeout");
        assert_eq!(run.status.code(), Some(2), "{args:?}: {}", said(&run));
        assert!(said(&run).contains("not a regular file"), "{args:?}: {}", said(&run));
    }
    assert!(!folder.path().join("out").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn a_name_that_is_no_unicode_is_refused_not_a_crash() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().expect("a folder");
    let name = std::ffi::OsStr::from_bytes(b"scene-\xff.toml");
    std::fs::write(folder.path().join(name), nested_balls(16)).expect("a scene");
    let run = Command::new(PROGRAM).current_dir(folder.path()).arg("project").arg(name).output();
    let run = run.expect("the program starts");
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    assert!(said(&run).contains("UTF-8"), "{}", said(&run));
}
