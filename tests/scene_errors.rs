//! What a wrong scene is told, and where.

mod common;

use chordfield::Error;
use common::{nested_balls, scene};

/// The messages of all that is wrong, and the lines they mark.
fn complaints(toml: &str) -> Vec<(String, Option<usize>)> {
    fn flatten(error: Error) -> Vec<(String, Option<usize>)> {
        match error {
            Error::Several { errors, .. } => errors.into_iter().flat_map(flatten).collect(),
            error => vec![(error.to_string(), error.line())],
        }
    }
    flatten(scene(toml).expect_err("the scene is wrong"))
}

/// The one complaint about the balls with `from` replaced by `to`.
fn complaint(from: &str, to: &str) -> (String, Option<usize>) {
    let text = nested_balls(16);
    assert!(text.contains(from), "{from}");
    let mut all = complaints(&text.replacen(from, to, 1));
    assert_eq!(all.len(), 1, "{all:?}");
    all.remove(0)
}

fn line_of(needle: &str) -> Option<usize> {
    nested_balls(16).lines().position(|l| l.contains(needle)).map(|i| i + 1)
}

#[test]
fn crossing_organs_are_named_with_place_and_depth() {
    let (message, _) = complaint("[10, 5, -8]", "[40, 0, 0]");
    assert!(message.contains("`outer` and `inner` cross") && message.contains("mm deep"), "{message}");
}

#[test]
fn inside_that_geometry_contradicts_is_refused_at_its_line() {
    let (message, line) = complaint("inside = \"outer\"", "inside = \"inner\"");
    assert!(message.contains("`inner` lies directly inside `outer`"), "{message}");
    assert_eq!(line, line_of("inside"));
    let (message, _) = complaint("inside = \"outer\"", "inside = \"liver\"");
    assert!(message.contains("no organ of this scene"), "{message}");
}

#[test]
fn unknown_keys_materials_and_energies_are_marked() {
    let (message, line) = complaint("extinction_per_mm", "extinction_per_cm");
    assert!(message.contains("unknown field `extinction_per_cm`"), "{message}");
    assert_eq!(line, line_of("extinction_per_mm"));
    let (message, line) = complaint("bone_cortical", "bone");
    assert!(message.contains("organ `inner`") && message.contains("bone"), "{message}");
    assert_eq!(line, line_of("bone_cortical"));
    let (message, line) = complaint("energy_keV = 60", "energy_keV = 5");
    assert!(message.contains("spectrum") && message.contains('5'), "{message}");
    assert_eq!(line, line_of("energy_keV"));
}

#[test]
fn nan_and_infinity_in_toml_are_refused() {
    for (from, to) in [
        ("[50, 40, 45]", "[50, nan, 45]"),
        ("[10, 5, -8]", "[inf, 5, -8]"),
        ("size_mm = [120, 120]", "size_mm = [nan, 120]"),
        ("energy_keV = 60", "energy_keV = nan"),
        ("opacity = 0.5", "opacity = nan"),
        ("extinction_per_mm = 0.02", "extinction_per_mm = inf"),
        ("material = \"water\"", "material = \"water\"\ndensity_g_cm3 = nan"),
    ] {
        assert!(!complaint(from, to).0.is_empty());
    }
}

#[test]
fn all_that_is_wrong_is_told_at_once() {
    let text = nested_balls(16)
        .replace("\"water\"", "\"watter\"")
        .replace("#ff0000", "red")
        .replace("energy_keV = 60", "energy_keV = 1e9");
    assert_eq!(complaints(&text).len(), 3);
}

#[test]
fn names_given_twice_and_organs_without_a_body_are_refused() {
    let (message, _) = complaint("name = \"inner\"", "name = \"outer\"");
    assert!(message.contains("two organs are called `outer`"), "{message}");
    let text = "[[organ]]\nname = \"ghost\"\nmaterial = \"water\"\n";
    assert!(complaints(text)[0].0.contains("`ghost`: organ: it needs one body"));
    assert!(complaints("name = \"empty\"\n")[0].0.contains("0 organs"));
}

#[test]
fn sizes_that_overflow_are_refused_before_memory_is() {
    let (message, line) = complaint("pixels = [16, 16]", "pixels = [4000000000, 4000000000]");
    assert!(message.contains("beam"), "{message}");
    assert_eq!(line, line_of("pixels"));
    // 46340² is just below 2³¹: no count overflows, but no desk computer has the memory.
    let (message, line) = complaint("pixels = [16, 16]", "pixels = [46340, 46340]");
    assert!(message.contains("46340 × 46340 pixels would take some 103.1 GB"), "{message}");
    assert_eq!(line, line_of("pixels"));
    let (message, _) = complaint("pixels = [16, 16]", "pixels = [0, 16]");
    assert!(message.contains("no image"), "{message}");
}

#[test]
fn densities_that_no_matter_has_are_refused_at_their_line() {
    for density in ["-1.0", "nan", "inf", "1e308"] {
        let said = format!("density_g_cm3 = {density}\n");
        let text = nested_balls(16).replace("inside = \"outer\"\n", &format!("inside = \"outer\"\n{said}"));
        let (message, line) = complaints(&text).remove(0);
        assert!(message.contains("is no density"), "{density}: {message}");
        assert_eq!(line, text.lines().position(|l| l.contains("density")).map(|i| i + 1));
    }
}

#[test]
fn shapes_of_one_organ_that_overlap_flush_are_refused_and_face_to_face_are_not() {
    let organ = |low: f64| {
        let high = low + 40.0;
        format!(
            r#"
[[organ]]
name = "slab"
material = "water"
shapes = [
    {{ kind = "box", min_mm = [0, 0, 0], max_mm = [40, 20, 20] }},
    {{ kind = "box", min_mm = [{low:?}, 0, 0], max_mm = [{high:?}, 20, 20] }},
]
"#
        )
    };
    let (message, line) = complaints(&organ(30.0)).remove(0);
    assert!(
        message.contains("organ `slab`")
            && message.contains("components 1 and 2 of 2 overlap")
            && message.contains("near ("),
        "{message}"
    );
    assert_eq!(line, Some(5));
    assert!(scene(&organ(40.0)).is_ok());
}

#[test]
fn group_and_groups_together_are_refused() {
    let text = "[[organ]]\nname = \"a\"\nmaterial = \"water\"\n\
                mesh = { file = \"a.obj\", group = \"x\", groups = [\"y\"] }\n";
    let (message, line) = complaints(text).remove(0);
    assert!(message.contains("both `group` and `groups` are given"), "{message}");
    assert_eq!(line, Some(4));
}
