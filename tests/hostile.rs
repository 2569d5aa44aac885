//! Input that means harm, or none: bombs, odd names, links that lead away, and mutations of a corpus.

mod common;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use chordfield::exact::{Body, Engine};
use chordfield::geometry::ClosedMesh;
use chordfield::modes::Control;
use chordfield::modes::stability::{Effort, sweep};
use chordfield::physics::Spectrum;
use chordfield::scene::mesh_file::{ReadOptions, read_bytes};
use chordfield::scene::{Folder, Scene, SceneText};
use common::nested_balls;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const PROGRAM: &str = env!("CARGO_BIN_EXE_chordfield");

fn chordfield(folder: &Path, args: &[&str]) -> Output {
    Command::new(PROGRAM).current_dir(folder).args(args).output().expect("the program starts")
}

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
    link("loop.obj", "loop.obj");
    let refused = |scene: String, words: &str| {
        std::fs::write(scenes.join("scene.toml"), scene).expect("a scene");
        let run = chordfield(root.path(), &["check", "scenes/scene.toml"]);
        assert_eq!(run.status.code(), Some(2), "{}", said(&run));
        assert!(said(&run).contains(words), "{}", said(&run));
    };
    for file in ["mesh.obj", "up/secret.obj"] {
        refused(with_inner(&format!("mesh = {{ file = \"{file}\" }}")), "leaves the scene's folder");
    }
    refused(with_inner("mesh = { file = \"loop.obj\" }"), "cannot read");
    refused(
        nested_balls(16).replace("energy_keV = 60", "file = \"spectrum.csv\""),
        "leaves the scene's folder",
    );
    // A named pipe in place of the materials: to open it would be to wait for ever.
    assert!(Command::new("mkfifo").arg(root.path().join("colours.mtl")).status().expect("mkfifo").success());
    let mesh = format!("mtllib ../colours.mtl\nusemtl red\n{TETRAHEDRON}");
    std::fs::write(scenes.join("coloured.obj"), mesh).expect("a mesh");
    let run = chordfield(root.path(), &["check", "scenes/coloured.obj"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
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

/// What mutations like to insert: borders of types, and words of the formats.
const TOKENS: [&str; 32] = [
    "0",
    "-1",
    "1e308",
    "-1e309",
    "nan",
    "inf",
    "4294967295",
    "4294967296",
    "18446744073709551616",
    "1e-320",
    "\0",
    "\n",
    "\r\n",
    "[",
    "]]",
    "{",
    "}",
    "\"",
    "#",
    "..",
    "/",
    "é",
    " ",
    ",",
    "v 0 0 0\n",
    "f 1 1 1\n",
    "g x\n",
    "end_header\n",
    "element face 4000000000\n",
    "property list int int x\n",
    "endsolid\n",
    "solid\n",
];

/// Changes bytes in a few places; `others` lend parts of theirs.
fn mutate(bytes: &mut Vec<u8>, others: &[(PathBuf, Vec<u8>)], rng: &mut Pcg64) {
    for _ in 0..rng.random_range(1..6) {
        let at = rng.random_range(0..=bytes.len());
        let end = (at + rng.random_range(0..24)).min(bytes.len());
        match rng.random_range(0..8) {
            0 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
            1 if at < bytes.len() => bytes[at] = rng.random(),
            2 => drop(bytes.splice(at..end, TOKENS[rng.random_range(0..TOKENS.len())].bytes())),
            3 => drop(bytes.splice(at..at, TOKENS[rng.random_range(0..TOKENS.len())].bytes())),
            4 => drop(bytes.drain(at..end)),
            5 => drop(bytes.splice(at..at, bytes[at..end].to_vec())),
            6 => {
                let other = &others[rng.random_range(0..others.len())].1;
                let from = rng.random_range(0..other.len());
                let part = other[from..(from + rng.random_range(0..80)).min(other.len())].to_vec();
                drop(bytes.splice(at..end, part));
            }
            _ if rng.random_range(0..8) == 0 => bytes.truncate(at),
            _ => {}
        }
    }
}

/// Every file of the corpus.
fn corpus() -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let paths = std::fs::read_dir(folder).expect("the corpus").map(|entry| entry.expect("an entry").path());
    let mut files: Vec<_> = paths.map(|path| (path.clone(), std::fs::read(path).expect("a file"))).collect();
    files.sort();
    files
}

/// How far a mutated file got.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    Refused,
    Read,
    Traced,
}

/// Feeds bytes to whoever reads such files. What is read must be sound; a surface must have the lengths of rationals.
fn feed(path: &Path, bytes: &[u8], seed: u64) -> Fate {
    let text = || String::from_utf8_lossy(bytes).into_owned();
    match path.extension().and_then(|e| e.to_str()) {
        Some("toml") => match Scene::build(&SceneText::new("scene.toml", text()), &Folder::of(path)) {
            Ok(scene) => {
                assert!(!scene.organs.is_empty());
                Fate::Read
            }
            Err(error) => refused(&error),
        },
        Some("csv") => match Spectrum::from_csv("spectrum.csv", &text()) {
            Ok(spectrum) => {
                let sum: f64 = spectrum.bins().iter().map(|bin| bin.weight).sum();
                assert!((sum - 1.0).abs() < 1e-9 && spectrum.mean_energy_kev().is_finite());
                Fate::Read
            }
            Err(error) => refused(&error),
        },
        _ => match read_bytes(path, bytes, &ReadOptions { max_faces: 10_000, ..ReadOptions::default() }) {
            Ok(file) => {
                let count = file.mesh.vertices.len() as u32;
                assert!(file.mesh.faces.as_flattened().iter().all(|&v| v < count));
                assert!(file.mesh.vertices.iter().all(|v| v.is_finite()));
                trace(file.mesh, seed)
            }
            Err(error) => refused(&error),
        },
    }
}

/// An error in words is what bad input gets.
fn refused(error: &chordfield::Error) -> Fate {
    assert!(!error.to_string().is_empty());
    Fate::Refused
}

/// Sweeps a surface that a mutation left closed, by all engines against rationals.
fn trace(mesh: chordfield::geometry::TriMesh, seed: u64) -> Fate {
    let Ok((surface, _)) = ClosedMesh::new(mesh) else { return Fate::Read };
    let size = surface.bounds().diagonal();
    let off = surface.bounds().centre().length();
    // The sizes that sweeps are made for; a few faces, as each takes its time; no crossings, which have no inside.
    let is_of_a_patient = (1e-6..1e6).contains(&size) && off < 1e6 && surface.mesh().faces.len() < 200;
    if !is_of_a_patient || chordfield::geometry::self_crossing(&surface).is_some() {
        return Fate::Read;
    }
    let body = Body::new(surface);
    let effort = Effort { rays: 8, recomputed: 8, seed };
    for found in sweep("mutant", &body, effort, &Control::none()).expect("not interrupted") {
        // The raster's depths over faces all but edge-on are known to be no better.
        assert!(found.figures.lost == 0, "{found:?} of {:?}", body.surface().mesh());
        assert!(
            found.figures.beyond == 0 || found.engine == Engine::Raster,
            "{found:?} of {:?}",
            body.surface().mesh()
        );
    }
    Fate::Traced
}

/// Mutates until `done` says so; returns how many there were, and of how many fates. A crash names the mutation that did it.
fn fuzz(seed: u64, done: impl Fn(u64) -> bool) -> [u64; 4] {
    let corpus = corpus();
    let mut counts = [0; 4];
    while !done(counts[0]) {
        let mutation = counts[0];
        let (path, original) = &corpus[mutation as usize % corpus.len()];
        let mut rng = Pcg64::seed_from_u64(seed ^ mutation.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut bytes = original.clone();
        mutate(&mut bytes, &corpus, &mut rng);
        let fate = catch_unwind(AssertUnwindSafe(|| feed(path, &bytes, mutation)));
        let fate = fate.unwrap_or_else(|_| {
            let shown = String::from_utf8_lossy(&bytes);
            panic!("mutation {mutation} of seed {seed}, of {}: {shown:?}", path.display())
        });
        counts[0] += 1;
        counts[1 + fate as usize] += 1;
    }
    counts
}

#[test]
fn the_corpus_itself_is_read() {
    for (path, bytes) in corpus() {
        let expected = match path.extension().and_then(|e| e.to_str()) {
            Some("toml" | "csv") => Fate::Read,
            _ => Fate::Traced,
        };
        assert_eq!(feed(&path, &bytes, 1), expected, "{}", path.display());
    }
}

#[test]
fn mutations_of_every_kind_of_file_are_read_soundly_or_refused_in_words() {
    let [all, refused, read, traced] = fuzz(11, |count| count >= 4_000);
    assert!(
        all == refused + read + traced && refused > 500 && read > 200 && traced > 50,
        "{refused} {read} {traced}"
    );
}

/// For `CHORDFIELD_FUZZ_SECONDS`, an hour if that is not said, from the seed `CHORDFIELD_FUZZ_SEED`; tells its counts.
#[test]
#[ignore = "an hour, or as long as CHORDFIELD_FUZZ_SECONDS says"]
fn an_hour_of_mutations() {
    let of = |name: &str, otherwise: u64| {
        std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(otherwise)
    };
    let end = Instant::now() + Duration::from_secs(of("CHORDFIELD_FUZZ_SECONDS", 3_600));
    let seed = of("CHORDFIELD_FUZZ_SEED", 12);
    let [all, refused, read, traced] = fuzz(seed, |_| Instant::now() >= end);
    let counts = format!("{all} mutations: {refused} refused, {read} read, {traced} traced\n");
    std::io::Write::write_all(&mut std::io::stderr(), counts.as_bytes()).expect("standard error");
    assert!(all > 1_000);
}
