//! What an audit has found, in figures.

use serde::Serialize;

use super::compare::closed_form;
use super::finder::Reference;
use super::ledger::{KindLedger, Ledger, OrganLedger};
use super::outline;
use super::reference::ReferenceError;
use super::worst::{self, WorstRay};
use super::{Audit, RaySet, SILHOUETTE_SHARE, TRANSMISSION_TOLERANCE};
use crate::modes::figures::{Figures, Histogram, Tally};
use crate::modes::project::{Method, TreeSettings};
use crate::scene::organ::Origin as OrganOrigin;
use crate::scene::{Pose, Scene, View};

/// All that an audit has found. Lengths are mm, transmissions shares of the unattenuated beam, angles degrees.
#[derive(Clone, Debug, Serialize)]
pub struct AuditReport {
    /// The program, and its version.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// The command line that made the report; set by whoever knows it.
    pub command: String,
    /// The scene's name.
    pub scene: String,
    /// What is judged.
    pub method: &'static str,
    /// How trees were grown, if the method is one of trees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trees: Option<TreeSettings>,
    /// By what it is judged.
    pub against: String,
    /// Along which rays.
    pub rays: RayWords,
    /// The effective energy at which transmissions are told: the mean of the photons, keV.
    #[serde(rename = "energy_keV")]
    pub energy_kev: f64,
    /// The length that errors are counted beyond, mm.
    pub tolerance_mm: f64,
    /// The transmission that they are counted beyond.
    pub transmission_tolerance: f64,
    /// A ray is at a silhouette if its chord is shorter than this share of the longest of the box's ellipsoid along it.
    pub silhouette_share: f64,
    /// Traced lengths in convex organs that differ from the reference's by more than a millionth of a millimetre, but are
    /// exact for planes moved by rounding, as are those of lines in the plane of a flat side; they count as equal.
    pub decided_by_rounding: u64,
    /// All organs together.
    pub whole: OrganFigures,
    /// The whole ray's transmission, all organs' errors together.
    pub transmission: Figures,
    /// Each organ that was met, in the scene's order.
    pub organs: Vec<OrganFigures>,
    /// Each view, or each aim.
    pub sections: Vec<SectionFigures>,
    /// By the distance of the ray from the organ's outline in its view; none without views.
    pub by_distance: Vec<DistanceFigures>,
    /// How well the reference knows the lengths of the same planes and vertices in exact arithmetic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceError>,
    /// The worst rays, the worst first.
    pub worst: Vec<WorstRay>,
}

/// Along which rays an audit looked.
#[derive(Clone, Debug, Serialize)]
pub struct RayWords {
    /// In words.
    pub set: String,
    /// Of the random numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// How many rays.
    pub count: u64,
}

/// Errors of one kind.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct KindFigures {
    /// Of lengths, mm.
    pub length_mm: Figures,
    /// What they make of the ray's transmission, each organ's error on its own.
    pub transmission: Figures,
}

/// One organ's errors, or all organs'.
#[derive(Clone, Debug, Serialize)]
pub struct OrganFigures {
    /// Its name.
    pub organ: String,
    /// The engine that is its reference, unless another method is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<&'static str>,
    /// Of the method against the reference.
    pub method: KindFigures,
    /// Of those: interpolated, not near the silhouette, mm.
    pub interpolated_interior_mm: Figures,
    /// Interpolated, at the silhouette, mm.
    pub interpolated_silhouette_mm: Figures,
    /// Traced, not near the silhouette, mm.
    pub traced_interior_mm: Figures,
    /// Traced, at the silhouette, mm.
    pub traced_silhouette_mm: Figures,
    /// Of sums along an image's rays (the raster's) against the reference; none without views.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accumulation: Option<KindFigures>,
    /// Of the reference on the mesh against the closed form, on rays that meet either.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<KindFigures>,
    /// Of the method against the closed form, on rays that meet either: interpolation and flat faces together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub total: Option<KindFigures>,
    /// Why there is no closed form.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub no_closed_form: Option<&'static str>,
    /// Errors of the method by magnitude.
    pub histogram: Vec<Bar>,
}

/// Errors from one magnitude to another, mm; half a decade, or exactly 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bar {
    /// The least magnitude; 0 for the bar of no error.
    pub from_mm: f64,
    /// The greatest.
    pub to_mm: f64,
    /// Interpolated lengths.
    pub interpolated: u64,
    /// Traced ones.
    pub traced: u64,
}

/// One view's errors, or one aim's.
#[derive(Clone, Debug, Serialize)]
pub struct SectionFigures {
    /// Which.
    pub label: String,
    /// The gantry's angle, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gantry_deg: Option<f64>,
    /// Rays.
    pub rays: u64,
    /// Organ lengths that were interpolated.
    pub interpolated: u64,
    /// Of lengths, mm.
    pub length_mm: Figures,
    /// Of the whole ray's transmission.
    pub transmission: Figures,
}

/// Errors at some distance from the outline.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DistanceFigures {
    /// The least distance, mm where the organ is; none for rays outside.
    pub from_mm: Option<f64>,
    /// The greatest; none for all beyond.
    pub to_mm: Option<f64>,
    /// Of lengths, mm.
    pub length_mm: Figures,
}

impl AuditReport {
    pub(super) fn new(audit: &Audit, total: Ledger, sections: Vec<SectionFigures>) -> Self {
        let settings = audit.settings();
        let sampled = audit.is_sampled();
        let has_views = matches!(settings.rays, RaySet::Views(_));
        let figures = |name: &str, ledger: &OrganLedger| OrganFigures::of(name, ledger, sampled, has_views);
        let organs = total.organs().map(|(i, ledger)| {
            let organ = &audit.scene.organs[i];
            OrganFigures {
                reference: settings.against.is_none().then(|| Reference::engine(&organ.body).name()),
                no_closed_form: no_closed_form(audit.scene, i),
                ..figures(&organ.name, ledger)
            }
        });
        let trees = if let Method::RiTree(trees) | Method::Auto(trees) = settings.method {
            Some(trees)
        } else {
            None
        };
        let by_distance = if has_views { distances(&total.by_distance) } else { Vec::new() };
        Self {
            program: "chordfield",
            version: env!("CARGO_PKG_VERSION"),
            command: String::new(),
            scene: audit.scene.name.clone(),
            method: settings.method.name(),
            trees,
            against: settings.against.map_or("reference", |method| method.name()).into(),
            rays: RayWords::of(&settings.rays, total.rays),
            energy_kev: audit.optics.energy_kev(),
            tolerance_mm: settings.tolerance_mm,
            transmission_tolerance: TRANSMISSION_TOLERANCE,
            silhouette_share: SILHOUETTE_SHARE,
            decided_by_rounding: total.decided_by_rounding,
            whole: figures("all organs", &total.whole()),
            transmission: total.transmission.figures(sampled),
            organs: organs.collect(),
            sections,
            by_distance,
            reference: None,
            worst: worst::rays(audit, total.worst.clone().sorted()),
        }
    }

    /// The largest error of all, mm; infinite if a length is not a number.
    pub fn max_mm(&self) -> f64 {
        self.whole.method.length_mm.max
    }
}

impl RayWords {
    fn of(set: &RaySet, count: u64) -> Self {
        let (set, seed) = match set {
            RaySet::Views(views) => (format!("every pixel of {} views", views.len()), None),
            RaySet::Random { seed, .. } => {
                ("uniform, isotropic random lines through the ball around the scene".into(), Some(*seed))
            }
            RaySet::Sample { of, seed, .. } => (format!("a random sample of {of}"), Some(*seed)),
            RaySet::Adversarial { rays, seed } => {
                (format!("{rays} adversarial lines for each organ and aim"), Some(*seed))
            }
        };
        Self { set, seed, count }
    }
}

impl KindFigures {
    fn of(ledger: &KindLedger, sampled: bool) -> Self {
        Self {
            length_mm: ledger.length_mm.figures(sampled),
            transmission: ledger.transmission.figures(sampled),
        }
    }
}

impl OrganFigures {
    fn of(name: &str, ledger: &OrganLedger, sampled: bool, has_views: bool) -> Self {
        let [interpolated, traced] = &ledger.parts;
        let part = |tally: &Tally| tally.figures(sampled);
        let kind = |ledger: &KindLedger| KindFigures::of(ledger, sampled);
        Self {
            organ: name.into(),
            reference: None,
            method: kind(&ledger.method),
            interpolated_interior_mm: part(&interpolated[0]),
            interpolated_silhouette_mm: part(&interpolated[1]),
            traced_interior_mm: part(&traced[0]),
            traced_silhouette_mm: part(&traced[1]),
            accumulation: has_views.then(|| kind(&ledger.accumulation)),
            mesh: (ledger.mesh.length_mm.count() > 0).then(|| kind(&ledger.mesh)),
            total: (ledger.total.length_mm.count() > 0).then(|| kind(&ledger.total)),
            no_closed_form: None,
            histogram: bars([interpolated, traced].map(|zones| {
                let mut both = zones[0].histogram().clone();
                both += zones[1].histogram();
                both
            })),
        }
    }
}

impl SectionFigures {
    pub(super) fn of_view(view: &View, ledger: &Ledger) -> Self {
        let gantry_deg = match view.pose() {
            Pose::Iec { angles, .. } => Some(angles.gantry_deg),
            _ => None,
        };
        Self { gantry_deg, ..Self::of_lines(&view.label(), ledger, false) }
    }

    pub(super) fn of_lines(label: &str, ledger: &Ledger, sampled: bool) -> Self {
        let whole = ledger.whole();
        Self {
            label: label.into(),
            gantry_deg: None,
            rays: ledger.rays,
            interpolated: whole.parts[0].iter().map(Tally::count).sum(),
            length_mm: whole.method.length_mm.figures(sampled),
            transmission: ledger.transmission.figures(sampled),
        }
    }
}

/// Why an organ has no closed form.
fn no_closed_form(scene: &Scene, organ: usize) -> Option<&'static str> {
    let organ = &scene.organs[organ];
    match (&organ.origin, closed_form(organ)) {
        (_, Some(_)) => None,
        (OrganOrigin::Mesh { .. }, _) => Some("its surface is a file's"),
        (OrganOrigin::Shapes(shapes), _) if shapes.len() > 1 => Some("it is made of several shapes"),
        _ => Some("it is a tube or a torus sector, whose lines have several chords"),
    }
}

fn distances(tallies: &[Tally]) -> Vec<DistanceFigures> {
    let edge = |i: usize| outline::EDGES_MM.get(i).copied();
    let figures = |(bin, tally): (usize, &Tally)| DistanceFigures {
        from_mm: match bin {
            0 => None,
            1 => Some(0.0),
            _ => edge(bin - 2),
        },
        to_mm: if bin == 0 { Some(0.0) } else { edge(bin - 1) },
        length_mm: tally.figures(false),
    };
    tallies.iter().enumerate().map(figures).collect()
}

/// Bars of half a decade between the smallest and the largest error seen, after one of errors that are exactly 0.
fn bars([interpolated, traced]: [Histogram; 2]) -> Vec<Bar> {
    let half_decade = |magnitude: f64| (2.0 * magnitude.log10()).ceil() as i32;
    let of = |histogram: &Histogram| -> Vec<(i32, u64)> {
        histogram.bins().map(|([_, edge], count)| (half_decade(edge), count)).collect()
    };
    let (interpolated_bins, traced_bins) = (of(&interpolated), of(&traced));
    let all = || interpolated_bins.iter().chain(&traced_bins).map(|bin| bin.0);
    let zero = Bar { from_mm: 0.0, to_mm: 0.0, interpolated: interpolated.zeros(), traced: traced.zeros() };
    let mut bars = vec![zero];
    let (Some(first), Some(last)) = (all().min(), all().max()) else { return bars };
    // Infinite errors make no picture; they are in every figure.
    for bar in first..=last.min(first + 80) {
        let count = |bins: &[(i32, u64)]| bins.iter().filter(|bin| bin.0 == bar).map(|bin| bin.1).sum();
        let edge = |i: i32| 10f64.powf(0.5 * f64::from(i));
        bars.push(Bar {
            from_mm: edge(bar - 1),
            to_mm: edge(bar),
            interpolated: count(&interpolated_bins),
            traced: count(&traced_bins),
        });
    }
    bars
}
