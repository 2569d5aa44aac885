//! The same bits everywhere: by every engine's image, for any number of threads, with the widest instructions of the machine
//! and with those of every machine, however the program was optimised.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

mod common;

use std::process::Command;

use chordfield::exact::Engine;
use chordfield::modes::Control;
use chordfield::modes::project::{Interpolation, Method, Projector, TreeSettings, Wanted};
use chordfield::ritree::Parameters;
use common::{nested_balls, scene};

/// Hashes (FNV-1a) of all images' bits. Both profiles hold them: `cargo test`, which optimises less, and `cargo test --release`.
/// Where a change is meant to move the last digits, the failing test tells the new ones.
const GOLDEN: [(&str, u64); 6] = [
    ("clip", 0x7c21_ef2e_60e5_efb3),
    ("walk", 0x7c21_ef2e_60e5_efb3),
    ("raster", 0x7c21_ef2e_60e5_efb3),
    ("bvh", 0x7c21_ef2e_60e5_efb3),
    ("quadrilinear", 0xcaaf_0916_f189_9181),
    ("squared-chord", 0xf506_b699_92ff_3e81),
];

fn method(name: &str) -> Method {
    match name {
        "clip" => Method::Exact(Some(Engine::Clip)),
        "walk" => Method::Exact(Some(Engine::Walk)),
        "raster" => Method::Exact(Some(Engine::Raster)),
        "bvh" => Method::Exact(Some(Engine::Bvh)),
        "quadrilinear" => by_trees(Interpolation::Quadrilinear { parameters: Parameters::default() }),
        // Less would leave nothing of balls of so few faces to be interpolated.
        _ => by_trees(Interpolation::SquaredChord { tolerance_mm: 3.0 }),
    }
}

fn by_trees(interpolation: Interpolation) -> Method {
    Method::RiTree(TreeSettings { interpolation, ..TreeSettings::default() })
}

fn hash_of_images(name: &str) -> u64 {
    let text = nested_balls(48).replace("kind = \"parallel\"", "gantry_deg = [20, 200]\ncouch_deg = 15");
    let scene = scene(&text).expect("a scene");
    let wanted = Wanted { lengths: true, attenuation: true, colour: true };
    let projector = Projector::new(&scene, wanted, None, method(name)).expect("a projector");
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for (i, view) in scene.beam.views().expect("views").iter().enumerate() {
        let image = projector.project(view, i as u64, &Control::none()).expect("a projection");
        let lengths =
            [image.own_length_mm(0), image.own_length_mm(1), image.line_integral().to_vec()].concat();
        let all = lengths.into_iter().chain(image.colour().concat());
        for byte in all.flat_map(|x: f32| x.to_le_bytes()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}

/// With the instructions that the environment allows: the test below runs this one.
#[test]
fn images_are_the_golden_bits_for_one_two_and_eight_threads() {
    for threads in [1, 2, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let found = GOLDEN.map(|(name, _)| (name, pool.install(|| hash_of_images(name))));
        assert_eq!(found, GOLDEN, "{threads} threads: {found:#018x?}");
    }
}

#[test]
fn images_are_the_golden_bits_with_wide_instructions_and_without() {
    for dispatch in ["baseline", "auto"] {
        let run = Command::new(std::env::current_exe().expect("this test"))
            .args(["--exact", "images_are_the_golden_bits_for_one_two_and_eight_threads"])
            .env("CHORDFIELD_DISPATCH", dispatch)
            .output()
            .expect("this test starts");
        let said = String::from_utf8_lossy(&run.stdout);
        assert!(run.status.success() && said.contains("1 passed"), "{dispatch}: {said}");
    }
}

#[test]
fn the_program_writes_the_same_image_either_way_and_refuses_words_that_mean_neither() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("balls.toml"), nested_balls(48)).expect("a scene");
    let run = |dispatch: &str| {
        Command::new(env!("CARGO_BIN_EXE_chordfield"))
            .current_dir(folder.path())
            .args(["project", "balls.toml", "--write", "p", "-o", dispatch])
            .env("CHORDFIELD_DISPATCH", dispatch)
            .output()
            .expect("the program starts")
    };
    let images = ["baseline", "auto"].map(|dispatch| {
        assert_eq!(run(dispatch).status.code(), Some(0), "{dispatch}");
        std::fs::read(folder.path().join(dispatch).join("balls-g000-p.mha")).expect("an image")
    });
    assert!(images[0] == images[1]);
    let refused = run("avx");
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("CHORDFIELD_DISPATCH") && said.contains("`baseline` or `auto`"), "{said}");
}
