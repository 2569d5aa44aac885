//! Where the source of each control point stands.

use glam::DVec3;

use super::Builder;
use crate::error::Result;
use crate::scene::beam::{BeamKind, DEFAULT_SAD_MM};
use crate::scene::iec::IecAngles;
use crate::scene::ranges::Angles;
use crate::scene::text::Step;
use crate::study::paths::Machine;
use crate::study::schema::{ControlPointSpec, StudySpec, Weights};

impl Builder<'_> {
    /// The machine at each control point, with its weight.
    pub(super) fn machines(&self, spec: &StudySpec, scene: usize) -> Result<Vec<(Machine, f64)>> {
        let beam = &spec.beam;
        let sad_mm = self.distance(&["beam", "sad_mm"], beam.sad_mm.unwrap_or(DEFAULT_SAD_MM))?;
        let scene = &self.scenes[scene].1;
        let isocentre_mm = match (&beam.isocentre, beam.isocentre_mm) {
            (Some(_), Some(_)) => {
                let problem = "the isocentre is given twice";
                return Err(self.at(&["beam", "isocentre"], problem, "drop `isocentre` or `isocentre_mm`"));
            }
            (Some(name), None) => {
                let organ = self.organ(&["beam", "isocentre"], name, &scene.organs)?;
                scene.organs[organ].body.surface().centroid_mm()
            }
            (None, given) => DVec3::from(given.unwrap_or_default()),
        };
        self.finite(&["beam", "isocentre_mm"], &isocentre_mm.to_array())?;
        let given = [beam.gantry_deg, beam.couch_deg, beam.collimator_deg];
        let own = given.map(Option::unwrap_or_default);
        for (axis, key) in ["gantry_deg", "couch_deg", "collimator_deg"].into_iter().enumerate() {
            self.finite(&["beam", key], &[own[axis]])?;
            if given[axis].is_some() && has_no_use_of(axis, spec) {
                let problem =
                    "has no effect: control points, sources placed by hand and listed paths have their own";
                let remedy = "drop it; to sweep it in place of an arc's, set beam.control_points=[]";
                return Err(self.at(&["beam", key], problem, remedy));
            }
        }
        let machine = |[gantry_deg, couch_deg, collimator_deg]: [f64; 3]| {
            let patient_position = beam.patient_position;
            let angles = IecAngles { gantry_deg, couch_deg, collimator_deg, patient_position };
            let axes = angles.beam_axes();
            let source_mm = isocentre_mm + sad_mm * axes.z;
            Machine { kind: beam.kind, source_mm, isocentre_mm, sad_mm, angles: Some(angles), axes }
        };
        if let Some(source) = beam.source_mm {
            self.finite(&["beam", "source_mm"], &source)?;
            if beam.kind == BeamKind::Parallel
                || !beam.control_points.is_empty()
                || spec.paths.points.is_none()
            {
                let problem = "a source placed by hand has no angles";
                let remedy = "use it with `points` only, in a cone; or give angles in its place";
                return Err(self.at(&["beam", "source_mm"], problem, remedy));
            }
            let by_hand = Machine { source_mm: source.into(), angles: None, ..machine([0.0; 3]) };
            return Ok(vec![(by_hand, 1.0)]);
        }
        if beam.control_points.is_empty() {
            return Ok(vec![(machine(own), 1.0)]);
        }
        let mut machines = Vec::new();
        for (index, point) in beam.control_points.iter().enumerate() {
            machines
                .extend(self.control_points(index, point, own)?.into_iter().map(|(a, w)| (machine(a), w)));
        }
        Ok(machines)
    }

    /// The angles and weights of an entry of control points.
    fn control_points(
        &self,
        index: usize,
        spec: &ControlPointSpec,
        own: [f64; 3],
    ) -> Result<Vec<([f64; 3], f64)>> {
        let at = |key, problem: &str, remedy| {
            let path = [Step::Key("beam"), Step::Key("control_points"), Step::Index(index), Step::Key(key)];
            self.blame.at(&path, problem, remedy)
        };
        let angles = [&spec.gantry_deg, &spec.couch_deg, &spec.collimator_deg];
        let weights = match &spec.weight {
            None => vec![1.0],
            Some(Weights::One(weight)) => vec![*weight],
            Some(Weights::Each(weights)) => weights.clone(),
        };
        let length = |given: &Option<Angles>| given.as_ref().map_or(1, |angles| angles.degrees().len());
        let count = angles.into_iter().map(length).chain([weights.len()]).max().unwrap_or(1);
        let keys = ["gantry_deg", "couch_deg", "collimator_deg", "weight"];
        for (key, length) in keys.into_iter().zip(angles.into_iter().map(length).chain([weights.len()])) {
            if length != 1 && length != count {
                let problem = format!("{length} values cannot go with {count} of another key");
                return Err(at(key, &problem, "give one value, or as many of each"));
            }
        }
        if let Some(weight) = weights.iter().find(|weight| !(**weight > 0.0 && weight.is_finite())) {
            return Err(at("weight", &format!("{weight} is no weight"), "give weights above zero"));
        }
        let pick = |values: &[f64], i: usize| if values.len() == 1 { values[0] } else { values[i] };
        Ok((0..count)
            .map(|i| {
                let angle =
                    |axis: usize| angles[axis].as_ref().map_or(own[axis], |angles| pick(angles.degrees(), i));
                ([angle(0), angle(1), angle(2)], pick(&weights, i))
            })
            .collect())
    }
}

/// Whether the beam's own angle about an axis (gantry, couch, collimator) would go unheard.
fn has_no_use_of(axis: usize, spec: &StudySpec) -> bool {
    let points = &spec.beam.control_points;
    let has_angle = |point: &ControlPointSpec| {
        [&point.gantry_deg, &point.couch_deg, &point.collimator_deg][axis].is_some()
    };
    let is_list = spec.paths.segments_mm.is_some() || spec.paths.csv.is_some();
    is_list || spec.beam.source_mm.is_some() || (!points.is_empty() && points.iter().all(has_angle))
}
