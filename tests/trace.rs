//! Scenes to be rendered, from files to pictures.

use chordfield::scene::trace::{Recipe, open};

const RECIPE: Recipe = Recipe { seed: 1, count: 4 };

fn problem(text: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    let error = open(&path.to_string_lossy(), RECIPE).expect_err("refused");
    let line = error.line().map(|line| format!("line {line}: ")).unwrap_or_default();
    format!("{line}{error}")
}

const HEAD: &str = "sky = { radius = 100, colours = [\"#000000\", \"#ffffff\"] }
cameras = [{ eye = [0, -10, 0], target = [0, 0, 0] }]
[[object]]
name = \"ball\"
";

#[test]
fn what_is_wrong_with_a_scene_is_told_with_its_line() {
    let of = |rest: &str| problem(&format!("{HEAD}{rest}\n"));
    let sphere = "shape = { kind = \"sphere\", centre = [0, 0, 0], radius = -1 }";
    assert!(of(sphere).starts_with("line 5: object `ball`: the numbers make no surface"), "{}", of(sphere));
    let far = "shape = { kind = \"sphere\", centre = [900, 0, 0], radius = 1 }";
    assert!(of(far).contains("outside the sky"), "{}", of(far));
    let glass = "shape = { kind = \"disc\", centre = [0, 0, 0], normal = [0, 0, 1], radius = 1 }
material = { glass = { index = 1.5 } }";
    assert!(
        of(glass).starts_with("line 6: object `ball`: only closed smooth bodies refract"),
        "{}",
        of(glass)
    );
    let unknown = "shape = { kind = \"sphere\", center = [0, 0, 0], radius = 1 }";
    assert!(of(unknown).contains("unknown field `center`"), "{}", of(unknown));
    let outside = "shape = { kind = \"mesh\", file = \"../secret.obj\" }";
    assert!(of(outside).contains("leaves the scene's folder"), "{}", of(outside));
    let profile = "shape = { kind = \"revolution\", at = [0, 0, 0], profile = [[0, 0], [1, 1]] }";
    assert!(of(profile).contains("the profile makes no body"), "{}", of(profile));
}

#[test]
fn generated_scenes_are_those_of_their_seed() {
    let places = |seed: u64| {
        let world = open("random-volumes", Recipe { seed, count: 5 }).expect("a world");
        world.objects.iter().map(|object| object.surface.bounds()).collect::<Vec<_>>()
    };
    let volumes = places(3);
    assert_eq!(volumes, places(3));
    assert_ne!(volumes, places(4));
    for (i, a) in volumes.iter().enumerate() {
        assert!(volumes[..i].iter().all(|b| !a.touches(b)), "volumes lie apart");
    }
    assert!(open("giraffe", RECIPE).is_err());
    assert!(open("random-volumes", Recipe { seed: 1, count: 0 }).is_err());
}
