//! Dose-path studies: closed forms, conventions worked out by hand, identities, splits and bad input.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use chordfield::geometry::{Interval, Segment};
use chordfield::modes::Control;
use chordfield::modes::dose::{Block, Dose, DoseReport, Keeper, OrganRow, PathRow, Shard, join};
use chordfield::modes::project::{Method, TreeSettings};
use chordfield::physics::{Attenuator, DetectorResponse, Stretch};
use chordfield::scene::{Folder, SceneText};
use chordfield::study::Study;
use glam::DVec3;

/// A water box of 100 × 200 × 300 mm about the origin, with a bone box on its left, near the front.
const BOXES: &str = r##"
name = "boxes"
[spectrum]
energy_keV = 60
[[organ]]
name = "water"
material = "water"
density_g_cm3 = 1.0
shape = { kind = "box", min_mm = [-50, -100, -150], max_mm = [50, 100, 150] }
[[organ]]
name = "bone"
material = "bone_cortical"
density_g_cm3 = 1.92
shape = { kind = "box", min_mm = [20, -90, -20], max_mm = [40, -60, 20] }
"##;

/// All rows of a run, and its report.
#[derive(Default)]
struct All {
    paths: Vec<PathRow>,
    organs: Vec<OrganRow>,
    stretches: Vec<Stretch>,
    places: Vec<(usize, usize)>,
}

impl All {
    fn organs_of(&self, path: usize) -> &[OrganRow] {
        let (from, to) = (self.places[path].0, self.places.get(path + 1).map_or(self.organs.len(), |p| p.0));
        &self.organs[from..to]
    }

    fn stretches_of(&self, path: usize) -> &[Stretch] {
        let (from, to) =
            (self.places[path].1, self.places.get(path + 1).map_or(self.stretches.len(), |p| p.1));
        &self.stretches[from..to]
    }
}

impl Keeper for All {
    type Kept = (Vec<PathRow>, Vec<OrganRow>, Vec<Stretch>);

    fn keep(&self, _: &Study, block: &Block) -> Self::Kept {
        (block.paths.clone(), block.organs.clone(), block.stretches.clone())
    }

    fn take(&mut self, (paths, organs, stretches): Self::Kept) -> chordfield::Result<()> {
        let (organs_from, stretches_from) = (self.organs.len(), self.stretches.len());
        self.places
            .extend(paths.iter().map(|p| (organs_from + p.organs.start, stretches_from + p.stretches.start)));
        self.paths.extend(paths);
        self.organs.extend(organs);
        self.stretches.extend(stretches);
        Ok(())
    }
}

/// A folder with the scene `boxes.toml` and others.
fn folder(scenes: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in scenes.iter().chain(&[("boxes.toml", BOXES)]) {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}

fn study_in(folder: &Path, text: &str, settings: &[&str], zip: bool) -> chordfield::Result<Study> {
    let settings: Vec<String> = settings.iter().map(|s| (*s).into()).collect();
    let file = folder.join("study.toml");
    Study::build(&SceneText::new("study.toml", text), &Folder::of(&file), &settings, zip)
}

fn follow(study: &Study, method: Method) -> (All, DoseReport) {
    let mut all = All::default();
    let report = Dose::new(study, method).expect("ready").run(&mut all, &Control::none()).expect("followed");
    (all, report)
}

fn run(text: &str) -> (All, DoseReport) {
    let folder = folder(&[]);
    follow(&study_in(folder.path(), text, &[], false).expect("a study"), Method::Exact(None))
}

fn near(found: f64, expected: f64, relative: f64) {
    let error = (found - expected).abs();
    assert!(error <= relative * expected.abs().max(f64::MIN_POSITIVE), "{found}, not {expected}");
}

#[test]
fn beams_from_all_sides_meet_organs_where_they_do_by_hand() {
    // Gantry, isocentre, entry and exit of the bone, of the water: mm from the source, which is 1000 mm from the isocentre.
    for (gantry, isocentre, bone, water) in [
        (0, "[30, 0, 0]", [910.0, 940.0], [900.0, 1100.0]),
        (180, "[30, 0, 0]", [1060.0, 1090.0], [900.0, 1100.0]),
        (90, "[0, -75, 0]", [960.0, 980.0], [950.0, 1050.0]),
        (270, "[0, -75, 0]", [1020.0, 1040.0], [950.0, 1050.0]),
    ] {
        let (all, _) = run(&format!(
            "scene = \"boxes.toml\"\n[beam]\ngantry_deg = {gantry}\nisocentre_mm = {isocentre}\n\
             [paths]\npoints = [{{ at_mm = {isocentre} }}]\nbeyond_mm = 1000\n"
        ));
        let rows = all.organs_of(0);
        assert_eq!(rows.len(), 2, "gantry {gantry}");
        let [first, second] = [&rows[0], &rows[1]];
        assert_eq!((first.organ, first.order, first.segments), (0, 1, 2));
        assert_eq!((second.organ, second.order, second.segments), (1, 2, 1));
        for (found, expected) in [(first.entry_mm, water[0]), (first.exit_mm, water[1])]
            .into_iter()
            .chain([(second.entry_mm, bone[0]), (second.exit_mm, bone[1])])
        {
            near(found, expected, 1e-13);
        }
        let thickness = [water[1] - water[0], bone[1] - bone[0]];
        near(first.own_length_mm, thickness[0] - thickness[1], 1e-12);
        let path = &all.paths[0];
        near(path.length_mm, 2000.0, 1e-15);
        near(path.outside_mm, 2000.0 - thickness[0], 1e-13);
        // NIST at 60 keV: water 0.2059, bone 0.3148 · 1.92 per cm.
        let exponent = 0.02059 * (thickness[0] - thickness[1]) + 0.03148 * 1.92 * thickness[1];
        near(path.mu_length, exponent, 1e-12);
        near(path.transmission_reference, (-exponent).exp(), 1e-12);
        near(path.mass_g_cm2, 0.1 * (thickness[0] - thickness[1]) + 0.192 * thickness[1], 1e-12);
        near(path.water_by_mu_mm, exponent / 0.02059, 1e-12);
        let electrons = 1.92 * 0.51478 / 0.55508;
        near(path.water_by_electrons_mm, thickness[0] - thickness[1] + electrons * thickness[1], 1e-12);
    }
}

#[test]
fn narrow_beam_water_has_the_tables_attenuation_and_is_its_own_equivalent() {
    let text = "scene = \"boxes.toml\"\n[beam]\nisocentre_mm = [-30, 0, 0]\n[paths]\nfan = { width_mm = 20, points = 9 }\n";
    let (all, report) = run(text);
    assert_eq!(report.paths, 9);
    for path in &all.paths {
        let length = path.length_mm - path.outside_mm;
        assert!(length >= 200.0);
        assert_eq!(((path.mu_length / length * 10.0) * 1e4).round() / 1e4, 0.2059);
        near(path.water_by_mu_mm, length, 1e-12);
        near(path.water_by_electrons_mm, length, 1e-12);
    }
    // A point in water, 100 mm deep, a metre from the source: fluence, and kerma with μ_en/ρ 0.0319 cm²/g.
    let point = "scene = \"boxes.toml\"\n[beam]\nisocentre_mm = [-30, 0, 0]\n[paths]\npoints = [{ at_mm = [-30, 0, 0] }]\n";
    let (all, _) = run(point);
    let path = &all.paths[0];
    near(path.fluence, (-2.059_f64).exp(), 1e-12);
    near(path.kerma_pgy_cm2.expect("in water"), 0.160_217_663_4 * 60.0 * 0.0319 * (-2.059_f64).exp(), 1e-12);
    assert_eq!(path.target_organ, Some(0));
    // Twice as far and in air: a quarter.
    let (all, _) = run(
        "scene = \"boxes.toml\"\n[paths]\nsegments_mm = [[0, 500, 0, 0, 2500, 0]]\nreference_distance_mm = 1000\n",
    );
    assert_eq!((all.paths[0].inverse_square, all.paths[0].fluence), (0.25, 0.25));
    assert!(all.paths[0].organs.is_empty() && all.paths[0].kerma_pgy_cm2.is_none());
}

/// Segments through the adult from all sides, some of which begin or end in it.
fn adult_segments(count: usize) -> String {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
    let mut point = |reach: f64| -> [f64; 3] {
        let mut along = |middle: f64| middle + rng.random_range(-reach..reach);
        [along(0.0), along(0.0), along(400.0)]
    };
    let segments: Vec<String> = (0..count)
        .map(|i| {
            let [a, b, c] = point(if i % 3 == 0 { 90.0 } else { 900.0 });
            let [d, e, f] = point(if i % 2 == 0 { 150.0 } else { 1000.0 });
            format!("[{a}, {b}, {c}, {d}, {e}, {f}]")
        })
        .collect();
    format!("[paths]\nsegments_mm = [{}]\n[spectrum]\nkvp = 100\n", segments.join(", "))
}

#[test]
fn own_lengths_and_the_part_outside_make_the_path_and_transmission_is_the_product() {
    let study = study_in(Path::new("."), &adult_segments(1500), &[], false).expect("a study");
    let (all, report) = follow(&study, Method::Exact(None));
    let scene = &study.scenes()[0];
    let attenuator = |response| {
        Attenuator::new(&study.cases()[0].organs, &study.cases()[0].spectrum, response).expect("in the table")
    };
    let [counting, integrating] =
        [DetectorResponse::Counting, DetectorResponse::EnergyIntegrating].map(attenuator);
    let mut parts = Vec::new();
    let (mut met, mut inside) = (0, 0);
    for (i, path) in all.paths.iter().enumerate() {
        let segment: Segment = path.shot.segment().expect("a segment");
        let mut chord = |organ: usize| -> f64 {
            scene.organs[organ].body.chords_of_segment(&segment, &mut parts);
            parts.iter().map(Interval::length).sum()
        };
        // The judge: chords less those of children, organ by organ.
        let own: Vec<f64> = (0..scene.organs.len())
            .map(|o| chord(o) - scene.organs[o].children.iter().map(|&child| chord(child)).sum::<f64>())
            .collect();
        let rows = all.organs_of(i);
        for (organ, judged) in own.iter().enumerate() {
            let found = rows.iter().find(|row| row.organ == organ).map_or(0.0, |row| row.own_length_mm);
            assert!(
                (found - judged).abs() < 1e-5,
                "path {i}, {}: {found} {judged}",
                scene.organs[organ].name
            );
        }
        let sum: f64 = rows.iter().map(|row| row.own_length_mm).sum();
        near(sum + path.outside_mm, path.length_mm, 1e-12);
        near(path.outside_mm + 1.0, path.length_mm - own.iter().sum::<f64>() + 1.0, 1e-6);
        let product: f64 = all
            .stretches_of(i)
            .iter()
            .map(|s| {
                let (material, density) = study.cases()[0].organs[s.organ];
                let mu = material.mu_per_cm(report.cases[0].reference_energy_kev, density).expect("in range");
                (-mu * (s.exit_mm - s.entry_mm) / 10.0).exp()
            })
            .product();
        near(product, path.transmission_reference, 1e-10);
        near(path.transmission_photons, counting.transmission(&own), 1e-6);
        near(path.transmission_signal, integrating.transmission(&own), 1e-6);
        // What is lost is removed, organ by organ; no more is absorbed than that. A beam hardens.
        let mean = report.cases[0].mean_energy_kev;
        let left = path.transmission_photons * path.mean_energy_kev.expect("something is left");
        near(left + rows.iter().map(|row| row.removed_kev).sum::<f64>(), mean, 1e-12);
        assert!(rows.iter().all(|row| row.absorbed_kev > 0.0 && row.absorbed_kev < row.removed_kev));
        if sum > 1.0 {
            met += 1;
            assert!(path.mean_energy_kev > Some(mean), "path {i} does not harden");
        }
        inside += usize::from(path.source_organ.is_some() && path.target_organ.is_some());
        let ordered = all.stretches_of(i).windows(2).all(|pair| pair[0].exit_mm <= pair[1].entry_mm);
        assert!(ordered && rows.windows(2).all(|pair| pair[0].entry_mm <= pair[1].entry_mm));
    }
    assert!(met > 500 && inside > 50, "{met} paths meet organs, {inside} run within");
}

#[test]
fn a_full_arc_about_a_cylinders_axis_is_the_same_from_every_angle() {
    let cylinder = "name = \"cylinder\"\n[spectrum]\nkvp = 80\n[[organ]]\nname = \"cylinder\"\nmaterial = \"muscle\"\n\
        shape = { kind = \"elliptic-cylinder\", half_axes_mm = [100, 100], bottom_centre_mm = [0, 0, -200], \
        top_centre_mm = [0, 0, 200], faces = 20000 }\n";
    let folder = folder(&[("cylinder.toml", cylinder)]);
    let text = "scene = \"cylinder.toml\"\n[beam]\nsad_mm = 800\ncontrol_points = [{ gantry_deg = \"0..360:7.5\" }]\n\
                [paths]\nfield = { circle_mm = 120, spacing_mm = 4 }\n";
    let study = study_in(folder.path(), text, &[], false).expect("a study");
    let (_, report) = follow(&study, Method::Exact(None));
    assert_eq!((report.fields.len(), report.cases.len()), (48, 1));
    let first = &report.fields[0].figures;
    assert!(first.absorbed_energy > 0.3 && first.transmitted_photons < 0.2);
    for field in &report.fields {
        // The cylinder is a prism of 5000 sides: radii differ by 1 − cos(π/5000) = 2e-7, lengths and exponents (up to 4) by some of it.
        let figures = &field.figures;
        near(figures.organs[0].mean_length_mm, first.organs[0].mean_length_mm, 1e-6);
        near(figures.transmitted_photons, first.transmitted_photons, 1e-5);
        near(figures.absorbed_energy, first.absorbed_energy, 1e-6);
    }
    near(report.cases[0].figures.absorbed_energy, first.absorbed_energy, 1e-6);
}

#[test]
fn cases_are_their_fields_by_weight() {
    let text = "scene = \"boxes.toml\"\n[beam]\nisocentre_mm = [30, -40, 0]\n\
                control_points = [{ gantry_deg = [0, 90], weight = [3, 1] }, { gantry_deg = 200, weight = 4 }]\n\
                [paths]\nfield = { rectangle_mm = [60, 40], spacing_mm = 5 }\n";
    let (_, report) = run(text);
    let shares: Vec<f64> = report.fields.iter().map(|field| field.share).collect();
    assert_eq!(shares, [0.375, 0.125, 0.5]);
    let mean = |of: &dyn Fn(&chordfield::modes::dose::BeamFigures) -> f64| -> f64 {
        report.fields.iter().map(|field| field.share * of(&field.figures)).sum()
    };
    let case = &report.cases[0].figures;
    near(case.transmitted_photons, mean(&|f| f.transmitted_photons), 1e-13);
    near(case.mean_outside_mm, mean(&|f| f.mean_outside_mm), 1e-13);
    for (i, organ) in case.organs.iter().enumerate() {
        near(organ.energy_imparted_kev, mean(&|f| f.organs[i].energy_imparted_kev), 1e-13);
        near(
            organ.volume_mm3.expect("a volume"),
            mean(&|f| f.organs[i].volume_mm3.expect("a volume")),
            1e-13,
        );
        let longest = report.fields.iter().map(|f| f.figures.organs[i].longest_mm).fold(0.0, f64::max);
        assert_eq!(
            (organ.paths, organ.longest_mm),
            (report.fields.iter().map(|f| f.figures.organs[i].paths).sum(), longest)
        );
    }
    // Mono-energetic: of what interacts, μ_en/μ is absorbed.
    let water = &case.organs[0];
    near(water.absorbed_share / water.removed_share, 0.0319 / 0.2059, 1e-12);
}

#[test]
fn fields_measure_volumes_and_areas_by_length() {
    for kind in ["cone", "parallel"] {
        let (_, report) = run(&format!(
            "scene = \"boxes.toml\"\nhistogram_bin_mm = 7\n[beam]\nkind = \"{kind}\"\ngantry_deg = 20\n\
             [paths]\nfield = {{ rectangle_mm = [420, 400], spacing_mm = 1 }}\n"
        ));
        let [water, bone] = [&report.fields[0].figures.organs[0], &report.fields[0].figures.organs[1]];
        let volumes = [100.0 * 200.0 * 300.0 - 20.0 * 30.0 * 40.0, 20.0 * 30.0 * 40.0];
        // Midpoints of cells of 1 mm: the outline of the bone, some 100 mm long and on average 15 mm deep, is cut.
        near(water.volume_mm3.expect("a volume"), volumes[0], 2e-4);
        near(bone.volume_mm3.expect("a volume"), volumes[1], 1e-2);
        for organ in [water, bone] {
            let sum = |of: fn(&chordfield::modes::dose::LengthBar) -> Option<f64>| -> f64 {
                organ.histogram.iter().filter_map(of).sum()
            };
            near(sum(|bar| bar.volume_mm3), organ.volume_mm3.expect("a volume"), 1e-12);
            near(sum(|bar| bar.area_mm2), organ.area_mm2.expect("an area"), 1e-12);
            assert_eq!(organ.histogram.iter().map(|bar| bar.paths).sum::<u64>(), organ.paths);
            let holds = |mm: f64| {
                organ.histogram.iter().any(|b| b.from_mm <= mm && b.to_mm.is_some_and(|to| mm < to))
            };
            assert!(holds(organ.shortest_mm) && holds(organ.longest_mm));
        }
    }
    // From the front, in parallel, the bone covers 20 × 40 mm, 30 mm deep.
    let (_, report) = run(
        "scene = \"boxes.toml\"\n[beam]\nkind = \"parallel\"\n[paths]\ngrid = { size_mm = [200, 400], points = [100, 200] }\n",
    );
    let bone = &report.fields[0].figures.organs[1];
    assert_eq!((bone.area_mm2, bone.paths), (Some(800.0), 200));
    near(bone.mean_length_mm, 30.0, 1e-12);
}

#[test]
fn sweeps_have_as_many_cases_fields_and_paths_as_they_say() {
    let folder = folder(&[]);
    let text = "scene = \"boxes.toml\"\n[beam]\ncontrol_points = [{ gantry_deg = [0, 10, 20] }]\n\
                [paths]\ngrid = { size_mm = [10, 10], points = [4, 3] }\n\
                [[sweep]]\nbeam.couch_deg = \"-30..30:30\"\n[[sweep]]\nspectrum.kvp = [80, 120]\nbeam.sad_mm = [900, 1000]\n";
    let study = study_in(folder.path(), text, &["organ.bone.density=1.8,1.9"], false).expect("a study");
    assert_eq!((study.cases().len(), study.fields().len(), study.paths()), (12, 36, 432));
    assert_eq!(
        study.parameters(),
        ["beam.couch_deg", "spectrum.kvp", "beam.sad_mm", "organ.bone.density_g_cm3"]
    );
    let (all, report) = follow(&study, Method::Exact(None));
    assert_eq!((all.paths.len(), report.paths, report.cases.len()), (432, 432, 12));
    assert!(all.paths.iter().enumerate().all(|(i, path)| path.number == i as u64));
    let zipped =
        study_in(folder.path(), text, &["beam.gantry=0,1", "beam.collimator=5,6"], true).expect("a study");
    assert_eq!(zipped.cases().len(), 12);
    // The number of pixels of a swept grid changes from case to case.
    let grids = study_in(folder.path(), text, &["paths.grid.points=[1,1],[2,5]"], false).expect("a study");
    assert_eq!(grids.paths(), 6 * 3 * (1 + 10));
}

#[test]
fn parts_of_a_study_are_the_whole_to_the_last_bit_on_any_number_of_threads() {
    let folder = folder(&[]);
    let text = "scene = \"boxes.toml\"\n[beam]\nisocentre_mm = [10, -20, 5]\ncontrol_points = [{ gantry_deg = \"0..90:30\" }]\n\
                [paths]\nfield = { circle_mm = 150, spacing_mm = 2 }\n[[sweep]]\nspectrum.kvp = [60, 140]\n";
    let study = study_in(folder.path(), text, &[], false).expect("a study");
    let dose = Dose::new(&study, Method::Exact(None)).expect("ready");
    let figures =
        |report: &DoseReport| serde_json::to_string(&(&report.cases, &report.fields)).expect("JSON");
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let (whole, report) = pool(1).install(|| follow(&study, Method::Exact(None)));
    for (of, threads) in [(1, 2), (3, 1), (7, 3), (60, 2)] {
        let mut rows = All::default();
        let mut parts = Vec::new();
        for number in 1..=of {
            let shard = Shard::new(number, of).expect("a part");
            let part = pool(threads)
                .install(|| dose.run_part(shard, &mut rows, &Control::none()))
                .expect("followed");
            // Through the file, as runs on other machines are.
            parts.push(serde_json::from_str(&serde_json::to_string(&part).expect("JSON")).expect("a part"));
        }
        assert_eq!(rows.paths, whole.paths);
        assert_eq!((rows.organs, rows.stretches), (whole.organs.clone(), whole.stretches.clone()));
        parts.reverse();
        let joined = join(&study, "exact", parts.clone()).expect("joined");
        assert_eq!(figures(&joined), figures(&report), "in {of} parts");
        if of > 1 {
            parts.pop();
            let error = join(&study, "exact", parts).expect_err("a part is missing").to_string();
            assert!(error.contains("missing"), "{error}");
        }
    }
}

#[test]
fn trees_interpolate_within_the_error_that_is_told_and_exact_lengths_are_exact() {
    let text = "scene = \"adult\"\n[beam]\nisocentre = \"liver\"\nsad_mm = 1500\n[paths]\nfield = { circle_mm = 200, spacing_mm = 2 }\n";
    let study = study_in(Path::new("."), text, &[], false).expect("a study");
    let (exact, report) = follow(&study, Method::Exact(None));
    assert!(
        report.errors[0].length_mm.max < 1e-8 && report.errors[0].paths == 2000,
        "{:?}",
        report.errors[0].length_mm
    );
    let (near, report) = follow(&study, Method::RiTree(TreeSettings::default()));
    let told = &report.errors[0];
    assert!(told.length_mm.mean > 1e-3 && told.paths > 5000, "{:?}", told.length_mm);
    let worst = exact.paths.iter().zip(&near.paths).map(|(a, b)| (a.outside_mm - b.outside_mm).abs());
    assert!(worst.fold(0.0, f64::max) < 3.0 * told.length_mm.max);
    assert_eq!(report.method, "ritree");
}

#[test]
fn degenerate_paths_have_the_fields_meaning() {
    let (all, report) = run(
        "scene = \"boxes.toml\"\n[paths]\nsegments_mm = [[500, 0, 0, 600, 0, 0], [30, -75, 0, 30, -75, 1], \
         [0, -900, 0, 900, -900, 0]]\n",
    );
    let [missing, within, outside] = [&all.paths[0], &all.paths[1], &all.paths[2]];
    assert!(missing.organs.is_empty() && missing.transmission_photons == 1.0 && missing.outside_mm == 100.0);
    assert_eq!((within.source_organ, within.target_organ), (Some(1), Some(1)));
    assert_eq!((within.outside_mm, all.organs_of(1)[0].own_length_mm), (0.0, 1.0));
    assert!(missing.target_outside && outside.target_outside && !within.target_outside);
    assert_eq!(report.fields[0].figures.paths_meeting_nothing, 2);
    assert_eq!(report.fields[0].figures.organs.len(), 1);
}

#[test]
fn bad_studies_are_refused_with_their_line() {
    let folder = folder(&[]);
    std::fs::write(
        folder.path().join("nan.csv"),
        "source_x_mm,source_y_mm,source_z_mm,target_x_mm,target_y_mm,target_z_mm\n1,2,3,4,5,6\n1,NaN,3,4,5,6\n",
    )
    .expect("a file");
    let point = "[paths]\npoints = [{ at_mm = [0, 0, 0] }]\n";
    for (text, line, words) in [
        (format!("scene = \"giraffe.toml\"\n{point}"), Some(1), "cannot read"),
        (format!("scene = \"../boxes.toml\"\n{point}"), Some(1), "leaves the scene's folder"),
        (format!("{point}[beam]\nsad_mm = 0\n"), Some(4), "not positive"),
        (format!("{point}[beam]\nisocentre = \"livver\"\n"), Some(4), "no organ `livver`"),
        (format!("{point}[beam]\nsource_mm = [0, 0, 0]\n"), Some(2), "the point is the source"),
        (
            format!("{point}[beam]\ncontrol_points = [{{ gantry_deg = [0, 1], weight = [1, 2, 3] }}]\n"),
            Some(4),
            "cannot go with",
        ),
        (format!("{point}[beam]\ncontrol_points = [{{ weight = -1 }}]\n"), Some(4), "no weight"),
        (format!("{point}[beam]\ngantry = 3\n"), Some(4), "unknown field"),
        (format!("{point}[spectrum]\nkvp = 70\n"), Some(4), "no embedded spectrum"),
        (format!("{point}[spectrum]\nenergy_keV = 5\n"), Some(4), "outside the attenuation table"),
        (format!("reference_energy_keV = 3e4\n{point}"), Some(1), "outside the attenuation table"),
        (format!("{point}[spectrum]\nresponse = \"counting\"\n"), Some(3), "no photons"),
        (format!("{point}[organ.livver]\ndensity_g_cm3 = 1\n"), Some(3), "no organ `livver`"),
        (format!("{point}[organ.liver]\ndensity_g_cm3 = -1\n"), Some(4), "no density"),
        (
            "[paths]\npoints = [{ organ = \"liver\", at_mm = [0, 0, 0] }]\n".into(),
            Some(2),
            "not inside `liver`",
        ),
        ("[paths]\npoints = [{ name = \"nowhere\" }]\n".into(), Some(2), "no place"),
        ("[paths]\nfan = { width_mm = 1, points = 1 }\n".into(), Some(2), "no fan"),
        (
            "[paths]\nfan = { width_mm = 1, points = 3 }\ngrid = { size_mm = [1, 1], points = [1, 1] }\n"
                .into(),
            Some(1),
            "one kind",
        ),
        ("[paths]\nsegments_mm = [[0, 0, 0, 1, 1, 1], [1, 1, 1, 1, 1, 1]]\n".into(), Some(2), "coincide"),
        (
            format!("{point}[[sweep]]\nspectrum.energy_keV = [60, 5]\n"),
            Some(4),
            "outside the attenuation table",
        ),
        (format!("{point}[[sweep]]\nbeam.sad_mm = [1000, \"far\"]\n"), Some(4), "does not serve"),
        (format!("{point}[[sweep]]\nbeam.gantry_deg = [0, 0]\n"), Some(4), "twice"),
        (format!("{point}[[sweep]]\nbeam.gantry_deg = \"0..90\"\n"), Some(4), "no step"),
        ("[paths]\ncsv = \"nan.csv\"\n".into(), None, "nan.csv:3"),
    ] {
        let error = study_in(folder.path(), &text, &[], false).expect_err(&text);
        let told = error.to_string();
        assert!(told.contains(words), "{text}: {told}");
        assert_eq!(error.line(), line, "{text}: {told}");
    }
    let error = study_in(folder.path(), point, &["beam.sad=-3"], false).expect_err("a setting").to_string();
    assert!(error.contains("--set beam.sad=-3") && error.contains("not positive"), "{error}");
}

fn studies() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("phantoms/studies")
}

fn chordfield(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_chordfield"))
        .current_dir(folder)
        .args(args)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

fn lines(path: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.lines().map(String::from).collect()
}

#[test]
fn shipped_studies_run_and_say_what_they_are() {
    let out = tempfile::tempdir().expect("a folder");
    for name in ["abdomen-ap-pa-lateral", "liver-arc", "head-cross-fire", "lung-wel-fan"] {
        let file = studies().join(format!("{name}.toml"));
        let run =
            chordfield(out.path(), &["dose", &file.to_string_lossy(), "-o", name, "--write", "paths,organs"]);
        assert_eq!(run.status.code(), Some(0), "{name}: {}", String::from_utf8_lossy(&run.stderr));
        let told = String::from_utf8_lossy(&run.stdout);
        assert!(told.contains("no scatter, not for clinical use"), "{told}");
        let record = std::fs::read(out.path().join(name).join("dose.json")).expect("a record");
        let record: serde_json::Value = serde_json::from_slice(&record).expect("JSON");
        assert_eq!(record["notice"], "primary radiation only: no scatter, not for clinical use");
        let hash = record["study"]["inputs"][0]["sha256"].as_str().expect("a hash");
        assert_eq!(hash.len(), 64);
        let paths = record["paths"].as_u64().expect("a number");
        assert_eq!(lines(&out.path().join(name).join("paths.csv")).len() as u64, paths + 1, "{name}");
        assert!(record["errors"][0]["length_mm"]["max"].as_f64() < Some(1e-8), "{name}");
    }
}

#[test]
fn a_split_run_joins_to_the_same_files_and_is_resumed_where_it_stopped() {
    let out = tempfile::tempdir().expect("a folder");
    let file = studies().join("liver-arc.toml").to_string_lossy().into_owned();
    let base =
        ["dose", &file, "--set", "beam.control_points=[{gantry_deg=[0,40]}]", "--set", "spectrum.kvp=80,100"];
    let run = |more: &[&str]| {
        let run = chordfield(out.path(), &[&base[..], more].concat());
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        String::from_utf8_lossy(&run.stdout).into_owned()
    };
    let plan = run(&["--dry-run"]);
    assert!(plan.contains("paths in 4 fields of 2 cases"), "{plan}");
    assert!(!out.path().join("out").exists());
    run(&["-o", "whole", "--format", "csv,json"]);
    for part in ["1/3", "2/3", "3/3"] {
        run(&["-o", "parts", "--format", "csv,json", "--shard", part, "--threads", "1"]);
    }
    assert!(run(&["-o", "parts", "--shard", "2/3", "--resume"]).contains("there already"));
    run(&["-o", "parts", "--format", "csv,json", "--join"]);
    for table in [
        "paths",
        "path_organs",
        "path_segments",
        "fields",
        "field_organs",
        "cases",
        "case_organs",
        "histograms",
    ] {
        for ending in ["csv", "jsonl"] {
            let [whole, joined] = ["whole", "parts"].map(|f| {
                std::fs::read(out.path().join(f).join(format!("{table}.{ending}"))).expect("a table")
            });
            assert!(whole == joined, "{table}.{ending} differs");
        }
    }
    // Rows of the path table: no field is empty but those that may be, and JSON lines say the same.
    let rows = lines(&out.path().join("whole/paths.csv"));
    let json = lines(&out.path().join("whole/paths.jsonl"));
    assert_eq!(rows.len(), json.len() + 1);
    let first: serde_json::Value = serde_json::from_str(&json[0]).expect("JSON");
    let length = rows[0].split(',').position(|head| head == "length_mm").expect("a column");
    assert_eq!(rows[1].split(',').nth(length), Some(first["length_mm"].to_string().trim_end_matches(".0")));
    let foreign = chordfield(out.path(), &["dose", &file, "-o", "parts", "--join"]);
    assert_eq!(foreign.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&foreign.stderr).contains("another study"));
}

#[test]
fn lines_of_shots_run_from_source_to_target() {
    let (all, _) = run("scene = \"boxes.toml\"\n[paths]\nsegments_mm = [[1, 2, 3, 40, 50, 60]]\n");
    assert_eq!(all.paths[0].shot.source_mm, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(all.paths[0].shot.target_mm(), DVec3::new(40.0, 50.0, 60.0));
}

#[test]
fn transmission_over_depth_falls_in_organs_only_and_ends_as_the_paths() {
    let folder = folder(&[]);
    let text = "scene = \"boxes.toml\"\n[beam]\nisocentre_mm = [30, -75, 0]\n[paths]\npoints = [{ at_mm = [30, -75, 0] }]\n\
                beyond_mm = 500\n[spectrum]\nkvp = 100\n";
    let study = study_in(folder.path(), text, &[], false).expect("a study");
    let dose = Dose::new(&study, Method::Exact(None)).expect("ready");
    let depths = dose.depths(0, 5.0).expect("a path");
    let path = dose.path(0).expect("a path").paths[0].clone();
    for pair in depths.windows(2) {
        let (falls, step) = (
            pair[1].transmission_photons < pair[0].transmission_photons,
            pair[1].depth_mm - pair[0].depth_mm,
        );
        assert_eq!(pair[1].organ.is_some(), falls, "{pair:?}");
        assert!(step > 0.0 && (pair[1].organ.is_none() || step <= 5.0 + 1e-9), "{pair:?}");
    }
    let (first, last) = (depths[0], depths[depths.len() - 1]);
    assert_eq!((first.depth_mm, first.transmission_reference, last.depth_mm), (0.0, 1.0, path.length_mm));
    near(last.transmission_photons, path.transmission_photons, 1e-12);
    near(last.transmission_reference, path.transmission_reference, 1e-12);
    // Bone takes the soft photons first: energy is left of more than of photons.
    assert!(last.transmission_energy > last.transmission_photons);
    assert!(dose.path(1).is_err() && dose.depths(0, 0.0).is_err());
}
