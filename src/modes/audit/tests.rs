//! Faults planted on purpose: an audit that does not find them is worth nothing.

use rayon::ThreadPoolBuilder;

use super::finder::{Answer, Ready};
use super::*;
use crate::attributes::chord::{Chord, ChordLength};
use crate::exact::{Pierced, Way};
use crate::linespace::{Cell, LinePoint, PlanePair};
use crate::modes::figures::Figures;
use crate::modes::project::TreeSettings;
use crate::ritree::{self, Attribute, Cache, Parameters, RiTree};
use crate::scene::{Folder, SceneText};

/// A ball beside an egg of equal material, seen from two sides.
const SCENE: &str = r#"
name = "ball and egg"
[beam]
gantry_deg = [0, 90]
sad_mm = 500
sdd_mm = 800
detector = { size_mm = [260, 160], pixels = [130, 80] }
[spectrum]
energy_keV = 60
[[organ]]
name = "ball"
material = "water"
shape = { kind = "ellipsoid", half_axes_mm = [30, 30, 30], faces = 800, move_mm = [-40, 0, 0] }
[[organ]]
name = "egg"
material = "water"
shape = { kind = "ellipsoid", half_axes_mm = [20, 30, 25], faces = 600, move_mm = [35, 0, 0] }
"#;

fn scene() -> Scene {
    Scene::build(&SceneText::new("test.toml", SCENE), &Folder::none()).expect("a scene")
}

fn settings(scene: &Scene, method: Method) -> AuditSettings {
    let rays = RaySet::Views(scene.beam.views().expect("views"));
    AuditSettings { rays, method, against: None, tolerance_mm: 0.1 }
}

/// A report of the scene's audit with a faulty method.
fn audited<'a>(scene: &'a Scene, method: impl Finder + 'a) -> AuditReport {
    let settings = settings(scene, Method::Exact(None));
    let reference = Box::new(Reference::new(bodies(scene)));
    let audit = Audit::with_finders(scene, settings, Box::new(method), reference).expect("an audit");
    audit.run(&Control::none()).expect("a report")
}

fn organ<'r>(report: &'r AuditReport, name: &str) -> &'r OrganFigures {
    report.organs.iter().find(|organ| organ.organ == name).expect("it is met")
}

/// A method with a fault: what it makes of the lengths of one ray in one organ.
struct Faulty<F>(F);

impl<F: Fn(usize, &Segment) -> f64 + Sync> Finder for Faulty<F> {
    fn ready<'f>(&'f self, _: Option<&View>) -> Box<dyn Ready + 'f> {
        Box::new(self)
    }
}

impl<F: Fn(usize, &Segment) -> f64 + Sync> Ready for &Faulty<F> {
    fn find(&self, organ: usize, batch: Batch, answers: &mut Vec<Answer>) {
        let answer = |ray| Answer { length_mm: (self.0)(organ, ray), found: Found::Traced };
        answers.clear();
        answers.extend(batch.rays.iter().map(answer));
    }
}

fn exact(body: &Body, ray: &Segment) -> f64 {
    let mut parts = Vec::new();
    body.chords_of_segment(ray, &mut parts);
    parts.iter().map(|part| part.length()).sum()
}

/// An attribute whose samples are all a share too long.
struct Perturbed<'a>(ChordLength<'a>, f32);

impl Attribute for Perturbed<'_> {
    type Output = Option<Chord>;
    type Real = f64;

    fn sample(&self, point: LinePoint) -> Option<Chord> {
        let chord = self.0.sample(point)?;
        Some(Chord { length_mm: chord.length_mm * self.1, ..chord })
    }

    fn class(&self, output: &Self::Output) -> u32 {
        self.0.class(output)
    }

    fn miss(&self) -> Self::Output {
        self.0.miss()
    }

    fn is_miss(&self, class: u32) -> bool {
        self.0.is_miss(class)
    }

    fn distance(&self, a: &Self::Output, b: &Self::Output) -> f64 {
        self.0.distance(a, b)
    }

    fn interpolate(&self, parts: &[(f64, &Self::Output)]) -> Self::Output {
        self.0.interpolate(parts)
    }

    fn is_symmetric(&self) -> bool {
        self.0.is_symmetric()
    }

    fn is_certainly_empty(&self, pair: PlanePair, cell: &Cell) -> bool {
        self.0.is_certainly_empty(pair, cell)
    }
}

/// Lengths from trees, the egg's samples multiplied; traced exactly where the tree says so.
struct Trees<'a> {
    trees: Vec<RiTree<Perturbed<'a>>>,
    bodies: Vec<&'a Body>,
    cache: Cache,
}

impl<'a> Trees<'a> {
    fn new(scene: &'a Scene, factor: f32) -> Self {
        // Fine, so that the error of interpolation does not hide the fault.
        let parameters = Parameters { distance_threshold: 2e-5, max_depth: 40, ..Parameters::default() };
        let tree = |(i, body): (usize, &&'a Body)| {
            let factor = if i == 1 { factor } else { 1.0 };
            RiTree::new(Perturbed(ChordLength::new(body).expect("convex"), factor), parameters)
        };
        let bodies = bodies(scene);
        Self { trees: bodies.iter().enumerate().map(tree).collect(), bodies, cache: Cache::new(1 << 30) }
    }
}

impl Finder for Trees<'_> {
    fn ready<'f>(&'f self, _: Option<&View>) -> Box<dyn Ready + 'f> {
        Box::new(self)
    }
}

impl Ready for &Trees<'_> {
    fn find(&self, organ: usize, batch: Batch, answers: &mut Vec<Answer>) {
        let tree = &self.trees[organ];
        let answer = |ray: &Segment| {
            let point = tree.attribute().0.space().point_of(ray.line());
            match tree.query(point, &self.cache) {
                Some(ritree::Answer::Trace(_)) => {
                    Answer { length_mm: exact(self.bodies[organ], ray), found: Found::Traced }
                }
                Some(ritree::Answer::Interpolated(Some(chord))) => {
                    Answer { length_mm: chord.length_mm.into(), found: Found::Interpolated }
                }
                _ => Answer { length_mm: 0.0, found: Found::Interpolated },
            }
        };
        answers.clear();
        answers.extend(batch.rays.iter().map(answer));
    }
}

#[test]
fn samples_a_thousandth_too_long_are_caught_and_located() {
    let scene = scene();
    let sound = audited(&scene, Trees::new(&scene, 1.0));
    let faulty = audited(&scene, Trees::new(&scene, 1.001));
    let share = |report: &AuditReport, name: &str| {
        let figures = organ(report, name).interpolated_interior_mm;
        figures.bias / figures.mean_reference
    };
    assert!(share(&sound, "egg").abs() < 1e-4, "{}", share(&sound, "egg"));
    assert!((share(&faulty, "egg") - share(&sound, "egg") - 1e-3).abs() < 1e-6, "{}", share(&faulty, "egg"));
    // It is in the egg, and in what was interpolated, nowhere else.
    assert_eq!(share(&faulty, "ball"), share(&sound, "ball"));
    assert!(organ(&faulty, "egg").traced_interior_mm.max < 1e-10);
}

#[test]
fn a_dropped_face_is_caught_and_located() {
    let scene = scene();
    let ball = &scene.organs[0].body;
    // A face that looks at the first view's source.
    let mesh = ball.surface().mesh();
    let looks = |face: &usize| -mesh.triangle(*face).iter().map(|v| v.y).fold(f64::NEG_INFINITY, f64::max);
    let dropped = (0..mesh.faces.len()).max_by(|a, b| looks(a).total_cmp(&looks(b))).expect("faces");
    let without = |organ: usize, ray: &Segment| {
        let body = &scene.organs[organ].body;
        let mut pierced = Pierced::default();
        body.trace(Engine::Bvh, 0, std::slice::from_ref(ray), &mut pierced);
        let kept = pierced.0.iter().filter(|p| organ != 0 || p.face as usize != dropped);
        kept.map(|p| if p.way == Way::Out { p.t_mm } else { -p.t_mm }).sum()
    };
    let report = audited(&scene, Faulty(without));
    assert!(organ(&report, "egg").method.length_mm.max < 1e-9);
    let figures = organ(&report, "ball").method.length_mm;
    assert!(figures.max > 400.0 && figures.p50 < 1e-9, "few rays, utterly wrong: {figures:?}");
    // Every one of the worst rays goes through the face.
    let faulty = report.worst.iter().filter(|worst| worst.error_mm.abs() > 1.0);
    let mut found = 0;
    for worst in faulty {
        let ray = Segment::along(worst.source_mm.into(), worst.path_mm.into()).expect("a ray");
        let mut pierced = Pierced::default();
        ball.trace(Engine::Bvh, 0, &[ray], &mut pierced);
        assert!(pierced.0.iter().any(|p| p.face as usize == dropped), "{worst:?}");
        assert_eq!(worst.organ, "ball");
        found += 1;
    }
    assert!(found > 2, "{found}");
}

#[test]
fn swapped_axes_are_caught_and_located() {
    let scene = scene();
    // Across x and z about the organ's middle: the ball is none the worse, but for its faces.
    let swapped = |organ: usize, ray: &Segment| {
        let body = &scene.organs[organ].body;
        let middle = body.bounds().centre();
        let (o, d) = (ray.line().origin() - middle, ray.line().dir() * ray.length_mm());
        let turned = Segment::along(middle + DVec3::new(o.z, o.y, o.x), DVec3::new(d.z, d.y, d.x));
        exact(body, &turned.expect("a ray"))
    };
    let report = audited(&scene, Faulty(swapped));
    let [ball, egg] = ["ball", "egg"].map(|name| organ(&report, name).method.length_mm);
    assert!(ball.p99 < 3.0 && egg.p50 > 3.0, "{ball:?} {egg:?}");
    assert!(report.worst.iter().take(20).all(|worst| worst.organ == "egg"));
    // From the front the egg's 20 and 25 mm change places in outline and in depth; that, from the side, is its outline alone.
    assert!(report.sections.iter().all(|view| view.length_mm.max > 15.0));
}

#[test]
fn the_worst_rays_are_found_again_to_the_last_bit() {
    let scene = scene();
    let methods = [
        Method::RiTree(TreeSettings::default()),
        Method::RiTree(TreeSettings { cache_bytes: 0, ..TreeSettings::default() }),
        Method::Exact(Some(Engine::Raster)),
        Method::Exact(Some(Engine::Walk)),
    ];
    for method in methods {
        let views = settings(&scene, method);
        let lines = AuditSettings { rays: RaySet::Random { rays: 9_000, seed: 11 }, ..views.clone() };
        let aimed = AuditSettings { rays: RaySet::Adversarial { rays: 40, seed: 11 }, ..views.clone() };
        for settings in [views, lines, aimed] {
            let Ok(audit) = Audit::new(&scene, settings.clone()) else { continue };
            let report = audit.run(&Control::none()).expect("a report");
            // A cold tree.
            let again = Audit::new(&scene, settings).expect("an audit");
            assert!(report.worst.len() > 20, "{method:?}: {}", report.worst.len());
            for worst in &report.worst {
                let probe = match worst.pixel.filter(|_| worst.reproduce.starts_with("--pixel")) {
                    Some([view, column, row]) => Probe::Pixel { view: view as usize, column, row },
                    None => Probe::Ray { source: worst.source_mm.into(), path: worst.path_mm.into() },
                };
                let organ = scene.organs.iter().position(|o| o.name == worst.organ).expect("an organ");
                let answer = again.probe(organ, probe).expect("an answer");
                assert_eq!(answer.method_mm.to_bits(), worst.method_mm.to_bits(), "{worst:?}");
                assert_eq!(answer.reference_mm.to_bits(), worst.reference_mm.to_bits(), "{worst:?}");
                assert_eq!(answer.cell_depth, worst.cell_depth);
            }
        }
    }
}

#[test]
fn reports_are_the_same_for_one_two_and_eight_threads() {
    let scene = scene();
    let report = |threads: usize, rays: RaySet| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let settings = AuditSettings { rays, ..settings(&scene, Method::RiTree(TreeSettings::default())) };
        pool.install(|| {
            let report = Audit::new(&scene, settings).and_then(|audit| audit.run(&Control::none()));
            serde_json::to_string(&report.expect("a report")).expect("JSON")
        })
    };
    let views = RaySet::Views(scene.beam.views().expect("views"));
    for rays in [views, RaySet::Random { rays: 30_000, seed: 5 }, RaySet::Adversarial { rays: 100, seed: 5 }]
    {
        let one = report(1, rays.clone());
        assert!(one == report(2, rays.clone()) && one == report(8, rays));
    }
}

#[test]
fn the_mesh_lies_under_its_shape_by_no_more_than_its_depth_allows_and_exact_methods_agree() {
    let scene = scene();
    let audit = Audit::new(&scene, settings(&scene, Method::Exact(None))).expect("an audit");
    let report = audit.run(&Control::none()).expect("a report");
    assert!(report.max_mm() < 1e-9, "{}", report.max_mm());
    for organ in &report.organs {
        let mesh = organ.mesh.expect("an ellipsoid has a closed form").length_mm;
        assert!(mesh.compared >= organ.method.length_mm.compared);
        // Inscribed: never longer than the true chord.
        assert!((mesh.bias + mesh.mean).abs() < 1e-12 && mesh.mean > 0.01, "{mesh:?}");
        assert!(organ.accumulation.expect("views").length_mm.max < 1e-9);
        assert_eq!(organ.interpolated_interior_mm.compared, 0);
    }
    let counted: u64 = report.by_distance.iter().map(|d| d.length_mm.compared).sum();
    assert_eq!(counted, report.whole.method.length_mm.compared);
    assert_eq!(report.by_distance[0].length_mm.max, 0.0, "nothing is found outside the outline");
}

#[test]
fn the_error_to_the_closed_form_is_that_of_the_method_and_that_of_the_mesh_together() {
    let scene = scene();
    for method in [Method::Exact(None), Method::RiTree(TreeSettings::default())] {
        let report = Audit::new(&scene, settings(&scene, method)).and_then(|a| a.run(&Control::none()));
        for organ in report.expect("a report").organs {
            let [method, mesh, total] = [Some(organ.method), organ.mesh, organ.total]
                .map(|kind| kind.expect("a closed form").length_mm);
            let sum = |figures: Figures| figures.bias * figures.compared as f64;
            let (parts, whole) = (sum(method) + sum(mesh), sum(total));
            assert!((parts - whole).abs() < 1e-9 * total.mean * total.compared as f64, "{parts} and {whole}");
            assert!(total.max <= (method.max + mesh.max) * (1.0 + 1e-12));
        }
    }
}

#[test]
fn rays_to_recompute_are_the_worst_and_some_that_meet_each_organ() {
    let scene = scene();
    let audit = Audit::new(&scene, settings(&scene, Method::Exact(None))).expect("an audit");
    let report = audit.run(&Control::none()).expect("a report");
    let sample = audit.reference_sample(&report, 50);
    let worst = |organ: usize| report.worst.iter().filter(|w| w.organ == scene.organs[organ].name).count();
    for (organ, rays) in sample {
        assert!(rays.len() > worst(organ) && rays.len() <= worst(organ) + 50, "{}", rays.len());
        assert!(rays.iter().all(|ray| exact(&scene.organs[organ].body, ray) > 0.0));
    }
}

#[test]
fn exact_engines_agree_on_adversarial_lines_but_for_what_rounding_explains() {
    let scene = scene();
    let rays = RaySet::Adversarial { rays: 300, seed: 3 };
    let settings = AuditSettings { rays, ..settings(&scene, Method::Exact(Some(Engine::Bvh))) };
    let report =
        Audit::new(&scene, settings).and_then(|audit| audit.run(&Control::none())).expect("a report");
    assert!(report.max_mm() < 1e-6, "{:?}", report.worst.first());
    assert_eq!(report.sections.len(), Aim::ALL.len());
    assert!(report.sections.iter().all(|aim| aim.length_mm.compared > 100));
}

#[test]
fn lines_for_an_engine_of_images_and_tolerances_that_are_none_are_refused() {
    let scene = scene();
    let views = settings(&scene, Method::Exact(Some(Engine::Raster)));
    let lines = AuditSettings { rays: RaySet::Random { rays: 5, seed: 1 }, ..views.clone() };
    assert!(Audit::new(&scene, lines).is_err());
    assert!(Audit::new(&scene, AuditSettings { tolerance_mm: f64::NAN, ..views.clone() }).is_err());
    assert!(Audit::new(&scene, AuditSettings { rays: RaySet::Views(Vec::new()), ..views }).is_err());
}
