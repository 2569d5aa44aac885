//! Trees written, read, damaged and mistaken for others.

use std::io::Cursor;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::modes::Control;
use crate::modes::project::{Method, Projector, TreeSettings, Wanted};
use crate::scene::{Folder, Scene, SceneText};

const COLOUR: Wanted = Wanted { lengths: true, attenuation: false, colour: true };
const LENGTHS: Wanted = Wanted { lengths: true, attenuation: false, colour: false };

fn scene(half_axis: f64) -> Scene {
    let text = format!(
        r#"
        beam = {{ gantry_deg = [0, 50], detector = {{ size_mm = [190, 150], pixels = [48, 40] }} }}
        spectrum = {{ energy_keV = 60 }}
        organ = [
            {{ name = "box", material = "water", density_g_cm3 = 1,
               shape = {{ kind = "box", min_mm = [-5, 60, -5], max_mm = [5, 70, 5] }} }},
            {{ name = "left", material = "water", density_g_cm3 = 1,
               shape = {{ kind = "ellipsoid", half_axes_mm = [{half_axis}, 30, 25], centre_mm = [-40, 0, 0], faces = 3000 }} }},
            {{ name = "right", material = "water", density_g_cm3 = 1,
               shape = {{ kind = "ellipsoid", half_axes_mm = [30, 30, 35], centre_mm = [40, 0, 0], faces = 5000 }} }},
        ]"#
    );
    Scene::build(&SceneText::new("pair.toml", text), &Folder::none()).expect("a scene")
}

fn chords(tolerance_mm: f64, cache_bytes: usize) -> Method {
    let interpolation = Interpolation::SquaredChord { tolerance_mm };
    Method::RiTree(TreeSettings { interpolation, cache_bytes, ..TreeSettings::default() })
}

fn paper(max_depth: u32) -> Method {
    let parameters = Parameters { max_depth, ..Parameters::default() };
    let interpolation = Interpolation::Quadrilinear { parameters };
    Method::RiTree(TreeSettings { interpolation, ..TreeSettings::default() })
}

fn projector(scene: &Scene, wanted: Wanted, method: Method) -> Projector<'_> {
    Projector::new(scene, wanted, None, method).expect("a projector")
}

/// The bits of all lengths and colours of all views.
fn look(projector: &Projector, scene: &Scene) -> Vec<u32> {
    let views = scene.beam.views().expect("views");
    let mut bits = Vec::new();
    for (i, view) in views.iter().enumerate() {
        let seen = projector.project(view, i as u64, &Control::none()).expect("projected");
        for organ in 0..scene.organs.len() {
            bits.extend(seen.own_length_mm(organ).into_iter().map(f32::to_bits));
        }
        bits.extend(seen.colour().into_iter().flatten().map(f32::to_bits));
    }
    bits
}

fn bytes_of(projector: &Projector) -> Vec<u8> {
    assert!(projector.forest().expect("trees").shape.smooth_leaves > 10, "{:?}", projector.forest());
    let mut bytes = Vec::new();
    projector.save_trees(&mut bytes).expect("written");
    bytes
}

fn load_into(projector: &mut Projector, bytes: &[u8]) -> Result<Loaded, Unreadable> {
    projector.load_trees(&mut Cursor::new(bytes))
}

fn refusal(projector: &mut Projector, bytes: &[u8]) -> String {
    match load_into(projector, bytes) {
        Err(Unreadable::Refused { problem, .. }) => problem,
        other => panic!("{other:?}"),
    }
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(work)
}

#[test]
fn trees_that_were_read_answer_as_trees_that_were_grown_to_the_last_bit() {
    let scene = scene(35.0);
    for (wanted, method) in
        [(COLOUR, chords(0.5, 1 << 26)), (LENGTHS, chords(0.3, 1 << 26)), (COLOUR, paper(20))]
    {
        let cold = projector(&scene, wanted, method);
        let lengths = on_threads(2, || look(&cold, &scene));
        let bytes = bytes_of(&cold);
        let grown = cold.forest().expect("trees");
        for threads in [1, 2] {
            let mut warm = projector(&scene, wanted, method);
            let loaded = load_into(&mut warm, &bytes).expect("read");
            let leaves = grown.shape.smooth_leaves + grown.shape.empty_leaves + grown.shape.traced_leaves;
            assert_eq!(loaded, Loaded { loaded_leaves: leaves, left_out_leaves: 0 });
            assert!(grown.shape.smooth_leaves > 30, "{grown:?}");
            assert!(bytes_of(&warm) == bytes, "what was read is written again");
            assert!(on_threads(threads, || look(&warm, &scene)) == lengths);
            assert_eq!(warm.forest().expect("trees").build.nodes_expanded, 0, "nothing is grown");
            warm.check_invariants();
        }
    }
}

#[test]
fn what_the_cache_has_no_room_for_is_left_out_and_lengths_are_the_same() {
    let scene = scene(35.0);
    let cold = projector(&scene, LENGTHS, chords(0.5, 1 << 26));
    let (lengths, bytes) = (look(&cold, &scene), bytes_of(&cold));
    let half = cold.forest().expect("trees").tree_bytes / 2;
    for room in [0, 1_000, half] {
        let mut warm = projector(&scene, LENGTHS, chords(0.5, room));
        let loaded = load_into(&mut warm, &bytes).expect("read");
        assert!(loaded.left_out_leaves > 0 && (loaded.loaded_leaves > 20) == (room == half), "{loaded:?}");
        let report = warm.forest().expect("trees");
        assert_eq!((report.loaded, report.tree_bytes <= room), (Some(loaded), true));
        warm.check_invariants();
        assert!(look(&warm, &scene) == lengths, "with room for {room} bytes");
        warm.check_invariants();
    }
}

#[test]
fn organs_that_a_run_finds_exactly_are_left_out() {
    let scene = scene(35.0);
    let cold = projector(&scene, LENGTHS, chords(0.5, 1 << 26));
    look(&cold, &scene);
    let Method::RiTree(settings) = chords(0.5, 1 << 26) else { unreachable!() };
    let mut warm =
        projector(&scene, LENGTHS, Method::RiTree(TreeSettings { least_planes: 4000, ..settings }));
    let loaded = load_into(&mut warm, &bytes_of(&cold)).expect("read");
    assert!(loaded.loaded_leaves > 0 && loaded.left_out_leaves > 0, "{loaded:?}");
    assert_eq!(warm.forest().expect("trees").trees, 1);
}

#[test]
fn trees_of_other_bodies_settings_and_versions_are_refused_by_name() {
    let (ours, other) = (scene(35.0), scene(35.000_000_000_001));
    let method = chords(0.5, 1 << 26);
    let cold = projector(&ours, COLOUR, method);
    look(&cold, &ours);
    let bytes = bytes_of(&cold);
    let says = |scene: &Scene, wanted, method, words: &str| {
        let problem = refusal(&mut projector(scene, wanted, method), &bytes);
        assert!(problem.contains(words), "{problem}");
    };
    says(&other, COLOUR, method, "other bodies");
    says(&ours, COLOUR, chords(0.25, 1 << 26), "--tolerance 0.5mm, with the places of chords");
    says(&ours, LENGTHS, method, "this run asks for --tolerance 0.5mm, without the places");
    says(&ours, COLOUR, paper(28), "--max-depth 28");
    says(&ours, COLOUR, Method::Exact(None), "the method makes none");
    let changed = |at: usize, byte: u8| {
        let mut changed = bytes.clone();
        changed[at] = byte;
        sealed(changed)
    };
    let mut warm = projector(&ours, COLOUR, method);
    let mut says = |bytes: &[u8], words: &str| {
        let problem = refusal(&mut warm, bytes);
        assert!(problem.contains(words), "{problem}");
    };
    says(&changed(0, b'C'), "not a file of trees");
    says(&changed(16, 9), &format!("version 9 of the format; this program reads {VERSION}"));
    says(&changed(20, bytes[20] ^ 1), "says that it is");
    says(&changed(27, 255), "says that it is");
    let program = bytes.windows(5).position(|w| w == env!("CARGO_PKG_VERSION").as_bytes()).expect("in it");
    says(&changed(program, b'7'), "was made by version 7");
    says(&bytes[..bytes.len() - 1], "says that it is");
    says(&bytes[..40], "too short");
    says(&[], "too short");
    says(&[&bytes[..], b"x"].concat(), "says that it is");
    assert_eq!(warm.forest().expect("trees").loaded, None, "nothing of all that was taken over");
    load_into(&mut warm, &bytes).expect("and the file itself is read");
}

/// The checksum of what stands before it, put in its place.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let contents = bytes.len() - TAIL as usize;
    let hash = Sha256::digest(&bytes[..contents]);
    bytes[contents..].copy_from_slice(&hash);
    bytes
}

/// The right length in the head, and the checksum.
fn sealed_at_length(mut bytes: Vec<u8>) -> Vec<u8> {
    let length = bytes.len() as u64 - HEAD - TAIL;
    bytes[20..28].copy_from_slice(&length.to_le_bytes());
    sealed(bytes)
}

#[test]
fn a_damaged_file_is_refused_whatever_the_damage() {
    let scene = scene(35.0);
    let method = chords(2.0, 1 << 26);
    let cold = projector(&scene, LENGTHS, method);
    look(&cold, &scene);
    let bytes = bytes_of(&cold);
    let mut warm = projector(&scene, LENGTHS, method);
    let mut rng = Pcg64::seed_from_u64(1);
    for _ in 0..10_000 {
        let mut damaged = bytes.clone();
        if rng.random_bool(0.2) {
            damaged.truncate(rng.random_range(0..bytes.len()));
        } else {
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..damaged.len());
                damaged[at] ^= rng.random_range(1..=255_u8);
            }
        }
        // Two of the changes may undo each other.
        assert!(damaged == bytes || load_into(&mut warm, &damaged).is_err());
    }
    assert_eq!(warm.forest().expect("trees").loaded, None);
}

#[test]
fn contents_that_no_run_wrote_do_no_harm_under_a_right_checksum() {
    let scene = scene(35.0);
    for (method, rounds) in [(chords(5.0, 1 << 26), 1_500), (paper(12), 1_500)] {
        let cold = projector(&scene, COLOUR, method);
        look(&cold, &scene);
        let bytes = bytes_of(&cold);
        let mut rng = Pcg64::seed_from_u64(2);
        let mut accepted = 0;
        for _ in 0..rounds {
            let mut changed = bytes.clone();
            let contents = HEAD as usize..changed.len() - TAIL as usize;
            match rng.random_range(0..4) {
                0 => {
                    let cut = rng.random_range(contents.clone());
                    changed.drain(cut..contents.end);
                }
                1 => {
                    let (from, to) = (rng.random_range(contents.clone()), rng.random_range(contents.clone()));
                    changed.swap(from, to);
                }
                2 => {
                    // One part of the file over another.
                    let length = rng.random_range(1..200);
                    let [from, to] = [0; 2].map(|_| rng.random_range(contents.start..contents.end - length));
                    changed.copy_within(from..from + length, to);
                }
                _ => {
                    let at = rng.random_range(contents);
                    changed[at] = [0, 1, 0x7f, 0x80, 0xff, rng.random()][rng.random_range(0..6_usize)];
                }
            }
            let mut warm = projector(&scene, COLOUR, method);
            if load_into(&mut warm, &sealed_at_length(changed)).is_ok() {
                accepted += 1;
                // Lengths may be wrong, as whoever forged the file wished; the program goes on.
                look(&warm, &scene);
            }
        }
        assert!(accepted > 20 && accepted < rounds, "{accepted}");
    }
}
