//! Mutations of a corpus, by every parser: what is read is sound and is traced as rationals say, all else is refused in words.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use chordfield::exact::Body;
use chordfield::geometry::{ClosedMesh, convex_hull};
use chordfield::modes::Control;
use chordfield::modes::project::{
    Interpolation, KeepsTrees, Method, Projector, TREES_BEGIN, TreeSettings, Wanted,
};
use chordfield::modes::stability::{Effort, sweep};
use chordfield::physics::Spectrum;
use chordfield::scene::mesh_file::{ReadOptions, read_bytes};
use chordfield::scene::trace::{Recipe, open};
use chordfield::scene::{Folder, Scene, SceneText};
use chordfield::study::Study;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use sha2::{Digest, Sha256};

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

/// Every file of the corpus, and one of trees, which is this program's own and is made anew.
fn corpus() -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let paths = std::fs::read_dir(folder).expect("the corpus").map(|entry| entry.expect("an entry").path());
    let mut files: Vec<_> = paths.map(|path| (path.clone(), std::fs::read(path).expect("a file"))).collect();
    let mut trees = Vec::new();
    let grown = projector();
    look(&grown);
    grown.save_trees(&mut trees).expect("written");
    files.push(("made/ball.trees".into(), trees));
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

/// Reads the bytes of a file of the corpus, of this path, as such files are read. What is read must be sound.
type Reader = fn(&Path, &[u8], u64) -> Fate;

/// Who reads what, by how the file's name ends; the first that fits.
const READERS: [(&str, Reader); 10] = [
    ("trace.toml", read_trace_scene),
    ("study.toml", read_study),
    ("paths.csv", read_list_of_paths),
    (".toml", read_scene),
    (".csv", read_spectrum),
    (".obj", read_mesh),
    (".stl", read_mesh),
    (".ply", read_mesh),
    (".trees", read_trees),
    (".points", read_points),
];

/// Feeds bytes to whoever reads such files.
fn feed(path: &Path, bytes: &[u8], seed: u64) -> Fate {
    let name = path.to_string_lossy();
    let (_, reader) = READERS.iter().find(|(end, _)| name.ends_with(end)).expect("a reader of such files");
    reader(path, bytes, seed)
}

fn text(name: &str, bytes: &[u8]) -> SceneText {
    SceneText::new(name, String::from_utf8_lossy(bytes))
}

fn read_scene(path: &Path, bytes: &[u8], _: u64) -> Fate {
    match Scene::build(&text("scene.toml", bytes), &Folder::of(path)) {
        Ok(scene) => {
            assert!(!scene.organs.is_empty());
            Fate::Read
        }
        Err(error) => refused(&error),
    }
}

fn read_study(path: &Path, bytes: &[u8], seed: u64) -> Fate {
    match Study::build(&text("study.toml", bytes), &Folder::of(path), &[], false) {
        Ok(study) => {
            assert!(study.paths() > 0 && !study.fields().is_empty());
            for field in study.fields().iter().take(50) {
                let shot = study.shot(field, seed % field.paths());
                assert!(shot.target_mm().is_finite() && field.share().is_finite(), "{shot:?}");
            }
            Fate::Read
        }
        Err(error) => refused(&error),
    }
}

/// By a study beside it.
fn read_list_of_paths(path: &Path, bytes: &[u8], seed: u64) -> Fate {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["scene.toml", "tetrahedron.obj"] {
        std::fs::copy(path.with_file_name(name), folder.path().join(name)).expect("a copy");
    }
    std::fs::write(folder.path().join("paths.csv"), bytes).expect("a file");
    let study = b"scene = \"scene.toml\"\npaths = { csv = \"paths.csv\" }";
    read_study(&folder.path().join("study.toml"), study, seed)
}

fn read_trace_scene(path: &Path, bytes: &[u8], _: u64) -> Fate {
    let folder = tempfile::tempdir().expect("a folder");
    let (mesh, scene) = (folder.path().join("tetrahedron.obj"), folder.path().join("trace.toml"));
    std::fs::copy(path.with_file_name("tetrahedron.obj"), mesh).expect("a copy");
    std::fs::write(&scene, bytes).expect("a file");
    match open(&scene.to_string_lossy(), Recipe { seed: 1, count: 1 }) {
        Ok(world) => {
            let bounds = world.objects.iter().map(|object| object.surface.bounds());
            assert!(bounds.into_iter().all(|b| b.min.is_finite() && b.max.is_finite()));
            Fate::Read
        }
        Err(error) => refused(&error),
    }
}

fn read_spectrum(_: &Path, bytes: &[u8], _: u64) -> Fate {
    match Spectrum::from_csv("spectrum.csv", &String::from_utf8_lossy(bytes)) {
        Ok(spectrum) => {
            let sum: f64 = spectrum.bins().iter().map(|bin| bin.weight).sum();
            assert!((sum - 1.0).abs() < 1e-9 && spectrum.mean_energy_kev().is_finite());
            Fate::Read
        }
        Err(error) => refused(&error),
    }
}

/// A surface must have the lengths of rationals, too.
fn read_mesh(path: &Path, bytes: &[u8], seed: u64) -> Fate {
    match read_bytes(path, bytes, &ReadOptions { max_faces: 10_000, ..ReadOptions::default() }) {
        Ok(file) => {
            let count = file.mesh.vertices.len() as u32;
            assert!(file.mesh.faces.as_flattened().iter().all(|&v| v < count));
            assert!(file.mesh.vertices.iter().all(|v| v.is_finite()));
            trace(file.mesh, seed)
        }
        Err(error) => refused(&error),
    }
}

/// A scene of one ball, for kept trees.
fn ball() -> &'static Scene {
    static BALL: OnceLock<Scene> = OnceLock::new();
    const TEXT: &str = r#"
        beam = { detector = { size_mm = [150, 150], pixels = [6, 6] } }
        spectrum = { energy_keV = 60 }
        organ = [{ name = "ball", material = "water", density_g_cm3 = 1,
                   shape = { kind = "ellipsoid", half_axes_mm = [50, 40, 30], faces = 3000 } }]
    "#;
    BALL.get_or_init(|| Scene::build(&text("ball.toml", TEXT.as_bytes()), &Folder::none()).expect("a scene"))
}

fn projector() -> Projector<'static> {
    let interpolation = Interpolation::SquaredChord { tolerance_mm: 5.0 };
    let method = Method::RiTree(TreeSettings { interpolation, ..TreeSettings::default() });
    let wanted = Wanted { lengths: true, attenuation: false, colour: false };
    Projector::new(ball(), wanted, None, method).expect("a projector")
}

/// All lengths of the ball's view, which must be numbers of millimetres.
fn look(projector: &Projector) -> Vec<f32> {
    let view = &ball().beam.views().expect("a view")[0];
    let lengths = projector.project(view, 0, &Control::none()).expect("a projection").own_length_mm(0);
    assert!(lengths.iter().all(|length| *length >= 0.0), "{lengths:?}");
    lengths
}

/// Trees of the ball, mostly under a length and a checksum that are right, so that what is behind these is read, too.
fn read_trees(_: &Path, bytes: &[u8], seed: u64) -> Fate {
    const HEAD: usize = TREES_BEGIN.len() + 4 + 8;
    const CHECKSUM: usize = 32;
    let mut bytes = bytes.to_vec();
    if !seed.is_multiple_of(8) && bytes.len() >= HEAD + CHECKSUM {
        let end = bytes.len() - CHECKSUM;
        bytes[HEAD - 8..HEAD].copy_from_slice(&((end - HEAD) as u64).to_le_bytes());
        let checksum = Sha256::digest(&bytes[..end]);
        bytes[end..].copy_from_slice(&checksum);
    }
    let mut projector = projector();
    match projector.load_trees(&mut Cursor::new(bytes)) {
        Ok(_) => {
            look(&projector);
            Fate::Read
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            Fate::Refused
        }
    }
}

/// Points as numbers of 8 bytes: their convex hull must be proved convex, and clipped as rationals clip it.
fn read_points(_: &Path, bytes: &[u8], seed: u64) -> Fate {
    let (numbers, _) = bytes.as_chunks::<8>();
    let numbers: Vec<f64> = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let (points, _) = numbers.as_chunks::<3>();
    let points: Vec<DVec3> = points.iter().map(|point| DVec3::from(*point)).collect();
    match convex_hull(&points) {
        Ok(hull) => {
            let closed = ClosedMesh::new(hull.clone()).map(|(surface, _)| surface);
            if let Ok(surface) = closed {
                let size = surface.bounds().diagonal();
                let body = Body::new(surface);
                assert!(!(1e-6..1e6).contains(&size) || body.convexity().is_ok(), "{points:?}");
            }
            trace(hull, seed)
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            Fate::Refused
        }
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
        let is_explained = found.figures.beyond == 0 && found.figures.lost == 0;
        assert!(is_explained, "{found:?} of {:?}", body.surface().mesh());
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
        let is_surface = path
            .extension()
            .is_some_and(|e| ["obj", "stl", "ply", "points"].contains(&&*e.to_string_lossy()));
        let expected = if is_surface { Fate::Traced } else { Fate::Read };
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

/// 2026-11-25, beside other work, 2 404 s from the seed 77: 73 769 mutations, of which 65 908 were refused, 4 147 read and 3 714
/// traced; none crashed.
///
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
