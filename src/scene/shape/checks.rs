//! What a shape's keys and numbers must be, whatever its kind.

use super::{ShapeProblem, ShapeSpec};

/// The greatest coordinate or length, mm: a kilometre. Beyond it micrometres drown in rounding.
const MAX_MM: f64 = 1e6;
/// The least half-axis, radius, height or wall, mm: a nanometre.
pub(super) const MIN_MM: f64 = 1e-6;

/// The kinds with their own keys, in the order of the table above.
const KINDS: &[(&str, &[&str])] = &[
    ("ellipsoid", &["half_axes_mm", "centre_mm", "faces"]),
    ("piecewise-ellipsoid", &["negative_half_axes_mm", "positive_half_axes_mm", "centre_mm", "faces"]),
    ("half-ellipsoid", &["half_axes_mm", "centre_mm", "faces"]),
    ("elliptic-cylinder", &["half_axes_mm", "bottom_centre_mm", "top_centre_mm", "faces"]),
    (
        "elliptic-frustum",
        &["bottom_half_axes_mm", "top_half_axes_mm", "bottom_centre_mm", "top_centre_mm", "faces"],
    ),
    ("capped-cylinder", &["half_axes_mm", "cap_height_mm", "bottom_centre_mm", "top_centre_mm", "faces"]),
    ("rounded-frustum", &["radius_mm", "top_radius_mm", "height_mm", "centre_mm", "faces"]),
    ("box", &["min_mm", "max_mm"]),
    ("tetrahedron", &["points_mm"]),
    ("hull", &["points_mm"]),
    (
        "elliptic-tube",
        &[
            "outer_half_axes_mm",
            "inner_half_axes_mm",
            "z_mm",
            "outer_centre_mm",
            "inner_centre_mm",
            "sector_deg",
            "faces",
        ],
    ),
    ("torus-sector", &["ring_radius_mm", "tube_radius_mm", "sector_deg", "centre_mm", "faces"]),
];

impl ShapeSpec {
    /// A key that its kind does not use is a mistake, not a comment.
    pub(super) fn refuse_keys_of_other_kinds(&self) -> Result<(), ShapeProblem> {
        let Some((kind, allowed)) = KINDS.iter().find(|(kind, _)| *kind == self.kind) else {
            let known: Vec<&str> = KINDS.iter().map(|(kind, _)| *kind).collect();
            let problem = format!("there is no kind {:?}", self.kind);
            return Err(ShapeProblem::new("kind", problem, format!("use one of {}", known.join(", "))));
        };
        match self.given_keys().into_iter().find(|key| !allowed.contains(key)) {
            Some(key) => {
                let problem = format!("a shape of kind {kind:?} has no such key");
                Err(ShapeProblem::new(key, problem, format!("its keys are {}", allowed.join(", "))))
            }
            None => Ok(()),
        }
    }

    /// The keys given that belong to some kinds only.
    fn given_keys(&self) -> Vec<&'static str> {
        let given = [
            ("centre_mm", self.centre_mm.is_some()),
            ("half_axes_mm", self.half_axes_mm.is_some()),
            ("negative_half_axes_mm", self.negative_half_axes_mm.is_some()),
            ("positive_half_axes_mm", self.positive_half_axes_mm.is_some()),
            ("bottom_centre_mm", self.bottom_centre_mm.is_some()),
            ("top_centre_mm", self.top_centre_mm.is_some()),
            ("bottom_half_axes_mm", self.bottom_half_axes_mm.is_some()),
            ("top_half_axes_mm", self.top_half_axes_mm.is_some()),
            ("cap_height_mm", self.cap_height_mm.is_some()),
            ("radius_mm", self.radius_mm.is_some()),
            ("top_radius_mm", self.top_radius_mm.is_some()),
            ("height_mm", self.height_mm.is_some()),
            ("min_mm", self.min_mm.is_some()),
            ("max_mm", self.max_mm.is_some()),
            ("points_mm", self.points_mm.is_some()),
            ("outer_centre_mm", self.outer_centre_mm.is_some()),
            ("outer_half_axes_mm", self.outer_half_axes_mm.is_some()),
            ("inner_centre_mm", self.inner_centre_mm.is_some()),
            ("inner_half_axes_mm", self.inner_half_axes_mm.is_some()),
            ("z_mm", self.z_mm.is_some()),
            ("ring_radius_mm", self.ring_radius_mm.is_some()),
            ("tube_radius_mm", self.tube_radius_mm.is_some()),
            ("sector_deg", self.sector_deg.is_some()),
            ("faces", self.faces.is_some()),
        ];
        given.into_iter().filter_map(|(key, is_given)| is_given.then_some(key)).collect()
    }
}

pub(super) fn needed<T>(key: &str, value: Option<T>) -> Result<T, ShapeProblem> {
    value.ok_or_else(|| ShapeProblem::new(key, "missing", "add it; this kind of shape needs it"))
}

pub(super) fn as_many<const N: usize>(key: &str, values: Vec<f64>) -> Result<[f64; N], ShapeProblem> {
    let given = values.len();
    values.try_into().map_err(|_| {
        ShapeProblem::new(key, format!("{given} numbers"), format!("this kind of shape has {N}"))
    })
}

/// Numbers that a body can have: finite, at most [`MAX_MM`].
pub(super) fn finite<const N: usize>(key: &str, values: [f64; N]) -> Result<[f64; N], ShapeProblem> {
    match values.iter().find(|v| v.is_nan() || v.abs() > MAX_MM) {
        None => Ok(values),
        Some(v) => {
            Err(ShapeProblem::new(key, format!("{v} is out of range"), format!("stay within ±{MAX_MM}")))
        }
    }
}

pub(super) fn lengths<const N: usize>(key: &str, values: Option<[f64; N]>) -> Result<[f64; N], ShapeProblem> {
    let values = finite(key, needed(key, values)?)?;
    match values.iter().find(|&&v| v < MIN_MM) {
        None => Ok(values),
        Some(v) => {
            Err(ShapeProblem::new(key, format!("{v} mm is no length"), "give a positive length in mm"))
        }
    }
}

pub(super) fn length(key: &str, value: Option<f64>) -> Result<f64, ShapeProblem> {
    lengths(key, value.map(|v| [v])).map(|[v]| v)
}
