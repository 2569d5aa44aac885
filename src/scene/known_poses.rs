//! Known poses, one per convention, worked out by hand: a sign that flips in the code flips a test.
//!
//! Patient LPS: +x left, +y posterior (back), +z superior (head).

use glam::DVec3;

use super::beam::BeamSpec;
use super::{BeamProblem, View};

const LEFT: DVec3 = DVec3::X;
const RIGHT: DVec3 = DVec3::NEG_X;
const BACK: DVec3 = DVec3::Y;
const FRONT: DVec3 = DVec3::NEG_Y;
const HEAD: DVec3 = DVec3::Z;
const FEET: DVec3 = DVec3::NEG_Z;

fn spec(text: &str) -> BeamSpec {
    toml::from_str(text).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

fn views(text: &str) -> Vec<View> {
    spec(text).views().unwrap_or_else(|problem| panic!("{text}\n{problem}"))
}

fn view(text: &str) -> View {
    let mut views = views(text);
    assert_eq!(views.len(), 1, "{text}");
    views.remove(0)
}

fn problem(text: &str) -> BeamProblem {
    spec(text).views().expect_err(text)
}

/// The source's direction from the isocentre, and where columns and rows increase.
fn assert_pose(text: &str, source: DVec3, columns: DVec3, rows: DVec3) {
    let view = view(text);
    assert_eq!(view.source_mm() / 1000.0, source, "source of {text}");
    let [column, row, normal] = view.direction();
    assert_eq!(column, columns, "columns of {text}");
    assert_eq!(row, rows, "rows of {text}");
    assert_eq!(normal, -source, "the normal points downstream: {text}");
    assert!((view.panel().centre_mm() - -500.0 * source).length() < 1e-10, "detector of {text}");
}

#[test]
fn gantry_0_looks_from_the_front_with_the_patients_left_on_the_right() {
    assert_pose("", FRONT, LEFT, FEET);
    assert_pose("gantry_deg = 0", FRONT, LEFT, FEET);
    assert_pose("gantry_deg = 360", FRONT, LEFT, FEET);
}

#[test]
fn gantry_90_looks_from_the_patients_left() {
    assert_pose("gantry_deg = 90", LEFT, BACK, FEET);
    assert_pose("gantry_deg = -270", LEFT, BACK, FEET);
}

#[test]
fn gantry_180_looks_from_the_back() {
    assert_pose("gantry_deg = 180", BACK, RIGHT, FEET);
}

#[test]
fn gantry_270_looks_from_the_patients_right() {
    assert_pose("gantry_deg = 270", RIGHT, FRONT, FEET);
}

#[test]
fn between_quarters_the_source_is_at_sine_and_minus_cosine() {
    let source = view("gantry_deg = 30").source_mm();
    assert!((source - DVec3::new(500.0, -1000.0 * 0.75_f64.sqrt(), 0.0)).length() < 1e-10);
}

#[test]
fn couch_90_lets_gantry_90_look_from_the_feet() {
    assert_pose("gantry_deg = 90\ncouch_deg = 90", FEET, BACK, RIGHT);
    assert_pose("gantry_deg = 90\ncouch_deg = 270", HEAD, BACK, LEFT);
    assert_pose("gantry_deg = 270\ncouch_deg = 90", HEAD, FRONT, RIGHT);
}

#[test]
fn couch_90_turns_the_patient_under_a_beam_from_above() {
    // The head, which pointed to the gantry (up in the image), turns counter-clockwise from above: to X_f −, image left.
    assert_pose("couch_deg = 90", FRONT, FEET, RIGHT);
}

#[test]
fn collimator_90_turns_the_detector_counter_clockwise_seen_from_the_source() {
    // Right-handed about Z_b: X_b goes to where Y_b was (the head), Y_b to where −X_b was (the patient's right).
    assert_pose("collimator_deg = 90", FRONT, HEAD, LEFT);
    assert_pose("gantry_deg = 90\ncollimator_deg = 90", LEFT, HEAD, BACK);
}

#[test]
fn each_patient_position_has_its_own_front_and_left() {
    assert_pose("patient_position = 'HFS'", FRONT, LEFT, FEET);
    assert_pose("patient_position = 'HFP'", BACK, RIGHT, FEET);
    assert_pose("patient_position = 'FFS'", FRONT, RIGHT, HEAD);
    assert_pose("patient_position = 'FFP'", BACK, LEFT, HEAD);
    assert_pose("patient_position = 'HFP'\ngantry_deg = 90", RIGHT, FRONT, FEET);
    assert_pose("patient_position = 'FFS'\ngantry_deg = 90", RIGHT, BACK, HEAD);
    assert_pose("patient_position = 'FFP'\ngantry_deg = 90", LEFT, FRONT, HEAD);
}

#[test]
fn the_isocentre_moves_everything() {
    let (here, there) = (view("gantry_deg = 30"), view("gantry_deg = 30\nisocentre_mm = [10, -20, 300]"));
    let moved = DVec3::new(10.0, -20.0, 300.0);
    assert!((there.source_mm() - here.source_mm() - moved).length() < 1e-12);
    assert!((there.origin_mm() - here.origin_mm() - moved).length() < 1e-12);
}

#[test]
fn magnification_at_the_isocentre_is_sdd_over_sad() {
    let view = view("sad_mm = 800\nsdd_mm = 1000\ngantry_deg = 77\nisocentre_mm = [1, 2, 3]");
    let magnification = view.magnification_at(DVec3::new(1.0, 2.0, 3.0)).expect("downstream");
    assert!((magnification - 1.25).abs() < 1e-12);
    assert!((view.source_to_detector_mm() - 1000.0).abs() < 1e-9);
}

#[test]
fn offsets_shift_the_detector_along_x_b_and_y_b() {
    let at_0 = "detector = { offset_mm = [10, 20] }";
    assert!((view(at_0).panel().centre_mm() - (500.0 * BACK + 10.0 * LEFT + 20.0 * HEAD)).length() < 1e-10);
    let turned = format!("collimator_deg = 90\n{at_0}");
    assert!(
        (view(&turned).panel().centre_mm() - (500.0 * BACK + 10.0 * HEAD + 20.0 * RIGHT)).length() < 1e-10
    );
    assert_eq!(view(at_0).source_mm(), 1000.0 * FRONT, "the source stays");
}

#[test]
fn pixels_divide_the_detector_from_edge_to_edge() {
    let view = view("detector = { size_mm = [400, 300], pixels = [4, 2] }");
    assert_eq!(view.size(), (4, 2));
    assert_eq!(view.spacing_mm(), (100.0, 150.0));
    assert_eq!(view.origin_mm(), 150.0 * RIGHT + 500.0 * BACK + 75.0 * HEAD);
    assert_eq!(view.pixel_centre(3, 1), 150.0 * LEFT + 500.0 * BACK + 75.0 * FEET);
}

#[test]
fn the_default_detector_has_square_pixels_and_frames_an_adult_trunk() {
    for (text, size) in [("", (512, 512)), ("detector.pixels = [1024, 768]", (1024, 768))] {
        let view = view(text);
        assert_eq!(view.size(), size);
        let (column, row) = view.spacing_mm();
        assert!((column - row).abs() < 1e-12);
        assert!(column * f64::from(size.0) / 1.5 > 400.0, "mm seen at the isocentre");
    }
}

#[test]
fn parallel_rays_run_along_the_cones_axis() {
    for angles in ["gantry_deg = 30\ncouch_deg = 15", "gantry_deg = 270\ncollimator_deg = 45"] {
        let cone = view(&format!("{angles}\ndetector.pixels = [3, 3]"));
        let parallel = view(&format!("{angles}\nkind = 'parallel'\ndetector.pixels = [3, 3]"));
        let axis = cone.segment(1, 1);
        for (column, row) in [(0, 0), (1, 1), (2, 0)] {
            let ray = parallel.segment(column, row);
            assert!((ray.line().dir() - axis.line().dir()).length() < 1e-12);
            assert!((ray.length_mm() - 1500.0).abs() < 1e-9);
            assert_eq!(parallel.pixel_centre(column, row), cone.pixel_centre(column, row));
        }
        assert!((parallel.segment(1, 1).line().origin() - cone.source_mm()).length() < 1e-9);
    }
}

#[test]
fn a_matrix_written_by_hand_gives_the_rays_of_its_angles() {
    // Gantry 90°: the source at x = 1000 looks along −x, columns grow with y, rows with −z. Pixels of 2 mm on a
    // 400 mm × 300 mm detector at 1500 mm: 750 pixels per unit slope, centres at (200 − 1)/2 = 99.5 and (150 − 1)/2 = 74.5.
    //   w = 1000 − x;  column = 99.5 + 750 y/w;  row = 74.5 − 750 z/w
    let by_hand = "sdd_mm = 1500\ndetector.pixels = [200, 150]\nmatrices = [[
        [-99.5, 750, 0, 99500],
        [-74.5, 0, -750, 74500],
        [-1, 0, 0, 1000]]]";
    let by_angles = "gantry_deg = 90\ndetector = { size_mm = [400, 300], pixels = [200, 150] }";
    let (matrix, angles) = (view(by_hand), view(by_angles));
    for (column, row) in [(0, 0), (199, 0), (0, 149), (199, 149), (100, 75)] {
        let (m, a) = (matrix.segment(column, row), angles.segment(column, row));
        assert!((m.line().origin() - a.line().origin()).length() < 1e-9, "source");
        assert!((m.line().at(m.length_mm()) - a.line().at(a.length_mm())).length() < 1e-9, "pixel");
    }
    let p = angles.matrix().expect("a cone");
    let expected = [[-99.5, 750.0, 0.0, 99500.0], [-74.5, 0.0, -750.0, 74500.0], [-1.0, 0.0, 0.0, 1000.0]];
    for (entry, expected) in p.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((entry - expected).abs() < 1e-9 * 99500.0, "{entry} is not {expected}");
    }
}

#[test]
fn a_free_pose_written_by_hand_gives_the_rays_of_its_angles() {
    let free = "source_mm = [1000, 0, 0]\ndetector_centre_mm = [-500, 0, 0]\n
        column_direction = [0, 2, 0]\nrow_direction = [0, 0, -7]\ndetector.pixels = [32, 16]";
    for kind in ["cone", "parallel"] {
        let free = view(&format!("kind = '{kind}'\n{free}"));
        let angles = view(&format!("kind = '{kind}'\ngantry_deg = 90\ndetector.pixels = [32, 16]"));
        for (column, row) in [(0, 0), (31, 15), (5, 9)] {
            let (f, a) = (free.segment(column, row), angles.segment(column, row));
            assert!((f.line().origin() - a.line().origin()).length() < 1e-12, "{kind} source");
            assert!((f.line().dir() - a.line().dir()).length() < 1e-15, "{kind} direction");
        }
    }
}

#[test]
fn lists_multiply_with_the_collimator_turning_fastest() {
    let labels: Vec<String> = views("gantry_deg = '0..180:90'\ncouch_deg = [0, 10]\ncollimator_deg = '0,5'")
        .iter()
        .map(View::label)
        .collect();
    assert_eq!(labels.len(), 12);
    assert_eq!(labels[..4], ["g000", "g000-t000-c005", "g000-t010-c000", "g000-t010-c005"]);
    assert_eq!(labels[11], "g180-t010-c005");
}

#[test]
fn impossible_beams_are_refused_by_key() {
    for (text, key) in [
        ("sad_mm = 0", "sad_mm"),
        ("sad_mm = nan", "sad_mm"),
        ("sdd_mm = -1", "sdd_mm"),
        ("sdd_mm = inf", "sdd_mm"),
        ("sdd_mm = 1000", "sdd_mm"),
        ("sad_mm = 1500", "sad_mm"),
        ("sad_mm = 1e10\nsdd_mm = 2e10", "sad_mm"),
        ("isocentre_mm = [0, nan, 0]", "isocentre_mm"),
        ("isocentre_mm = [0, 1e300, 0]", "isocentre_mm"),
        ("detector.size_mm = [0, 100]", "detector.size_mm"),
        ("detector.size_mm = [100, nan]", "detector.size_mm"),
        ("detector.size_mm = [1e-300, 100]", "detector.size_mm"),
        ("detector.pixels = [0, 100]", "detector.pixels"),
        ("detector.pixels = [4294967295, 4294967295]", "detector.pixels"),
        ("detector.offset_mm = [0, inf]", "detector.offset_mm"),
        ("gantry_deg = '0..360:0.1'\ncouch_deg = '0..90:1'", "gantry_deg"),
        ("matrices = []\nsdd_mm = 1500", "matrices"),
        ("matrices = [[[1,0,0,0],[0,1,0,0],[0,0,1,0]]]", "sdd_mm"),
        ("matrices = [[[1,0,0,0],[0,1,0,0],[0,0,1,0]]]\nsdd_mm = 1500", "isocentre_mm"),
        ("matrices = [[[1,0,0,0],[0,1,0,0],[0,0,1,0]]]\ngantry_deg = 5", "gantry_deg"),
        ("matrices = [[[1,0,0,0],[0,1,0,0],[0,0,1,0]]]\nsource_mm = [0, 0, 0]", "source_mm"),
        ("matrices = [[[1,0,0,0],[0,1,0,0],[0,0,1,0]]]\nsdd_mm = 9\nkind = 'parallel'", "kind"),
        ("source_mm = [0, 0, 0]", "detector_centre_mm"),
        ("source_mm = [0, 0, 0]\nsad_mm = 900", "sad_mm"),
        ("source_mm = [0, 0, 0]\nisocentre_mm = [0, 0, 0]", "isocentre_mm"),
    ] {
        assert_eq!(problem(text).key, key, "{text}: {}", problem(text));
    }
}

#[test]
fn impossible_free_poses_are_refused_by_key() {
    let pose = |source: &str, centre: &str, column: &str, row: &str, kind: &str| {
        problem(&format!(
            "source_mm = {source}\ndetector_centre_mm = {centre}\ncolumn_direction = {column}\nrow_direction = {row}\n{kind}"
        ))
        .key
    };
    assert_eq!(pose("[0,0,0]", "[0,0,9]", "[0,0,0]", "[0,1,0]", ""), "column_direction");
    assert_eq!(pose("[0,0,0]", "[0,0,9]", "[1,0,0]", "[1,1,0]", ""), "row_direction");
    assert_eq!(pose("[0,0,0]", "[0,0,0]", "[1,0,0]", "[0,1,0]", ""), "source_mm");
    assert_eq!(pose("[0,0,0]", "[0,0,0]", "[1,0,0]", "[0,1,0]", "kind = 'parallel'"), "source_mm");
    assert_eq!(pose("[5,0,0]", "[0,0,0]", "[1,0,0]", "[0,1,0]", "kind = 'parallel'"), "source_mm");
    assert_eq!(pose("[0,0,nan]", "[0,0,0]", "[1,0,0]", "[0,1,0]", ""), "source_mm");
}

#[test]
fn unknown_keys_and_wrong_types_are_refused_by_the_schema() {
    for text in [
        "gantry = 5",
        "detector = { pixel = [3, 3] }",
        "detector.pixels = [-1, 5]",
        "detector.pixels = [5]",
        "kind = 'fan'",
        "patient_position = 'hfs'",
        "gantry_deg = '0..360'",
        "matrices = [[[1, 2, 3]]]",
    ] {
        assert!(toml::from_str::<BeamSpec>(text).is_err(), "{text}");
    }
}

#[test]
fn a_problem_leads_to_its_place_in_the_text() {
    let text = "gantry_deg = 5\nsdd_mm = 900\n[detector]\npixels = [0, 3]\n";
    let spec = spec(text);
    let problem = spec.views().expect_err("refused");
    assert_eq!(&text[spec.span_of(problem.key).expect("a place")], "900");
    assert_eq!(&text[spec.span_of("detector.pixels").expect("a place")], "[0, 3]");
    assert_eq!(spec.span_of("sad_mm"), None, "not given");

    #[derive(serde::Deserialize)]
    struct Scene {
        beam: toml::Spanned<BeamSpec>,
    }
    let scene_text = "# a scene\n[beam]\nsdd_mm = 900\n[beam.detector]\nsize_mm = [1, 2]\n";
    let scene: Scene = toml::from_str(scene_text).expect("a scene");
    let place = scene.beam.get_ref().span_of("detector.size_mm").expect("a place");
    assert_eq!(&scene_text[place], "[1, 2]", "places count from the start of the whole text");
}

#[test]
fn the_command_line_overrides_what_the_scene_says() {
    let scene = spec("gantry_deg = 5\nsdd_mm = 1400\ndetector = { pixels = [8, 8], size_mm = [80, 80] }");
    let angles: super::ranges::Angles = "0,90".parse().expect("angles");
    let mut changes = BeamSpec { gantry_deg: Some(angles.into()), ..Default::default() };
    changes.detector.pixels = Some([4, 4].into());
    let views = scene.overridden_by(changes).views().expect("views");
    assert_eq!(views.iter().map(View::label).collect::<Vec<_>>(), ["g000", "g090"]);
    assert_eq!(views[0].size(), (4, 4));
    assert_eq!(views[0].spacing_mm(), (20.0, 20.0));
    assert!((views[0].source_to_detector_mm() - 1400.0).abs() < 1e-9);
}
