//! How a shape is written in a scene file, and what makes it valid.

use glam::DVec3;

use super::checks::{MIN_MM, as_many, finite, length, lengths, needed};
use super::frame::Frame;
use super::layout::HalfAxes;
use super::solid::{Smooth, Solid};
use super::tube::{Ellipse, EllipticTube, TorusSector};
use super::{Cut, Shape, ShapeProblem};
use crate::geometry::convex_hull;

/// Faces of a shape whose file does not say. An ellipsoid of half-axis 50 mm then lies 0.15 mm under its surface.
pub const DEFAULT_FACES: usize = 2000;
/// The least number of faces that can be asked for: fewer are a poor figure of any curve.
pub const MIN_FACES: usize = 64;
/// The greatest number of faces: beyond it an organ alone takes tens of megabytes and seconds to build.
pub const MAX_FACES: usize = 200_000;
/// The greatest number of cuts of a shape; outlines are found cut by cut, corners pair by pair.
pub const MAX_CUTS: usize = 64;
/// The greatest number of points of a hull.
pub const MAX_POINTS: usize = 100_000;
/// A shape as written: one flat table, so that unknown keys are refused whatever the kind.
///
/// `kind` chooses which keys are needed. Lengths are mm, angles degrees, in local coordinates:
///
/// | kind | keys |
/// |---|---|
/// | `ellipsoid` | `half_axes_mm = [a, b, c]`, `centre_mm` |
/// | `piecewise-ellipsoid` | `negative_half_axes_mm`, `positive_half_axes_mm` (by the sign of each local coordinate), `centre_mm` |
/// | `half-ellipsoid` | `half_axes_mm = [a, b, c]`, `centre_mm`; the half towards +z |
/// | `elliptic-cylinder` | `half_axes_mm = [a, b]`, `bottom_centre_mm`, `top_centre_mm`; ellipses across z, oblique if the centres say so |
/// | `elliptic-frustum` | `bottom_half_axes_mm = [a, b]`, `top_half_axes_mm`, `bottom_centre_mm`, `top_centre_mm`; the ellipses in proportion |
/// | `capped-cylinder` | `half_axes_mm = [a, b]`, `cap_height_mm`, `bottom_centre_mm`, `top_centre_mm`; half an ellipsoid on top |
/// | `rounded-frustum` | `radius_mm`, `top_radius_mm`, `height_mm`, `centre_mm`; half a ball below, a cone frustum above |
/// | `box` | `min_mm`, `max_mm` |
/// | `tetrahedron` | `points_mm`, four of them |
/// | `hull` | `points_mm` |
/// | `elliptic-tube` | `outer_half_axes_mm = [a, b]`, `inner_half_axes_mm`, `z_mm = [low, high]`, `outer_centre_mm = [x, y]`, `inner_centre_mm`, `sector_deg = [from, to]` about the outer centre; not convex |
/// | `torus-sector` | `ring_radius_mm`, `tube_radius_mm`, `sector_deg = [from, to]`, `centre_mm`; not convex |
///
/// Centres default to the origin. All kinds take `rotate_deg = [x, y, z]` (about the fixed x axis, then y, then z,
/// through the local origin) *or* `axes` (three rows, the local axes in organ coordinates), `move_mm`,
/// `cuts = [{ normal = [..], offset_mm = .. }]` (keeps `n · p ≤ offset` in organ coordinates, `n` made unit),
/// and, except polyhedra, `faces`.
#[derive(Clone, Debug, Default, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // The table above documents every key by its name.
pub struct ShapeSpec {
    pub kind: String,
    pub centre_mm: Option<[f64; 3]>,
    pub half_axes_mm: Option<Vec<f64>>,
    pub negative_half_axes_mm: Option<[f64; 3]>,
    pub positive_half_axes_mm: Option<[f64; 3]>,
    pub bottom_centre_mm: Option<[f64; 3]>,
    pub top_centre_mm: Option<[f64; 3]>,
    pub bottom_half_axes_mm: Option<[f64; 2]>,
    pub top_half_axes_mm: Option<[f64; 2]>,
    pub cap_height_mm: Option<f64>,
    pub radius_mm: Option<f64>,
    pub top_radius_mm: Option<f64>,
    pub height_mm: Option<f64>,
    pub min_mm: Option<[f64; 3]>,
    pub max_mm: Option<[f64; 3]>,
    pub points_mm: Option<Vec<[f64; 3]>>,
    pub outer_centre_mm: Option<[f64; 2]>,
    pub outer_half_axes_mm: Option<[f64; 2]>,
    pub inner_centre_mm: Option<[f64; 2]>,
    pub inner_half_axes_mm: Option<[f64; 2]>,
    pub z_mm: Option<[f64; 2]>,
    pub ring_radius_mm: Option<f64>,
    pub tube_radius_mm: Option<f64>,
    pub sector_deg: Option<[f64; 2]>,
    pub rotate_deg: Option<[f64; 3]>,
    pub axes: Option<[[f64; 3]; 3]>,
    pub move_mm: Option<[f64; 3]>,
    pub cuts: Option<Vec<CutSpec>>,
    pub faces: Option<usize>,
}

/// A half-space as written.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CutSpec {
    /// Any length but 0; the kept side is against it.
    pub normal: [f64; 3],
    /// Along the normal made unit, mm.
    pub offset_mm: f64,
}

impl TryFrom<ShapeSpec> for Shape {
    type Error = ShapeProblem;

    fn try_from(spec: ShapeSpec) -> Result<Self, ShapeProblem> {
        spec.refuse_keys_of_other_kinds()?;
        let solid = spec.solid()?;
        let frame = spec.frame()?;
        let cuts = spec.cuts()?;
        if matches!(solid, Solid::TorusSector(_)) && !cuts.is_empty() {
            return Err(ShapeProblem::new("cuts", "a torus sector cannot be cut", "narrow `sector_deg`"));
        }
        let faces = spec.faces.unwrap_or(DEFAULT_FACES);
        if !(MIN_FACES..=MAX_FACES).contains(&faces) {
            return Err(ShapeProblem::new(
                "faces",
                format!("{faces} faces"),
                format!("ask for {MIN_FACES} to {MAX_FACES}"),
            ));
        }
        Ok(Self { solid, frame, cuts, faces })
    }
}

impl ShapeSpec {
    fn solid(&self) -> Result<Solid, ShapeProblem> {
        let smooth = match self.kind.as_str() {
            "ellipsoid" => {
                let axes = HalfAxes::symmetric(self.half_axes_3()?);
                Smooth::Ellipsoid { centre: self.centre()?, axes }
            }
            "piecewise-ellipsoid" => {
                let negative = lengths("negative_half_axes_mm", self.negative_half_axes_mm)?;
                let positive = lengths("positive_half_axes_mm", self.positive_half_axes_mm)?;
                let axes = HalfAxes { negative: negative.into(), positive: positive.into() };
                Smooth::Ellipsoid { centre: self.centre()?, axes }
            }
            "half-ellipsoid" => {
                Smooth::HalfEllipsoid { centre: self.centre()?, half_axes: self.half_axes_3()? }
            }
            "elliptic-cylinder" => {
                let (bottom, top) = self.end_centres()?;
                Smooth::Frustum { bottom, top, half_axes: self.half_axes_2()?, top_scale: 1.0 }
            }
            "elliptic-frustum" => self.frustum()?,
            "capped-cylinder" => self.capped_cylinder()?,
            "rounded-frustum" => self.rounded_frustum()?,
            "elliptic-tube" => return self.elliptic_tube(),
            "torus-sector" => return self.torus_sector(),
            _ => return self.polytope(),
        };
        Ok(Solid::Smooth(smooth))
    }

    fn frustum(&self) -> Result<Smooth, ShapeProblem> {
        let (bottom, top) = self.end_centres()?;
        let half_axes = lengths("bottom_half_axes_mm", self.bottom_half_axes_mm)?;
        let [a, b] = needed("top_half_axes_mm", self.top_half_axes_mm)?;
        let top_scale = a / half_axes[0];
        if [a, b] != [0.0, 0.0] {
            lengths("top_half_axes_mm", Some([a, b]))?;
        }
        // Ellipses of different shape would make a body that is not convex. Proportions are taken from the first
        // axis; 1e-9 allows for decimals.
        if (b - top_scale * half_axes[1]).abs() > 1e-9 * half_axes[1] {
            return Err(ShapeProblem::new(
                "top_half_axes_mm",
                "the top ellipse is not in proportion to the bottom one",
                "give both the same ratio, or write a `hull` of points",
            ));
        }
        Ok(Smooth::Frustum { bottom, top, half_axes, top_scale })
    }

    fn capped_cylinder(&self) -> Result<Smooth, ShapeProblem> {
        let (bottom, top) = self.end_centres()?;
        if bottom.truncate() != top.truncate() {
            return Err(ShapeProblem::new(
                "top_centre_mm",
                "a capped cylinder is upright: its centres differ in z only",
                "turn it with `rotate_deg`",
            ));
        }
        let [a, b] = self.half_axes_2()?;
        let cap = length("cap_height_mm", self.cap_height_mm)?;
        Ok(Smooth::CappedCylinder { bottom, height: top.z - bottom.z, half_axes: DVec3::new(a, b, cap) })
    }

    fn rounded_frustum(&self) -> Result<Smooth, ShapeProblem> {
        let radius = length("radius_mm", self.radius_mm)?;
        let top_radius = length("top_radius_mm", self.top_radius_mm)?;
        if top_radius > radius {
            return Err(ShapeProblem::new(
                "top_radius_mm",
                "a cone wider than its ball is not convex",
                "make it at most `radius_mm`",
            ));
        }
        let height = length("height_mm", self.height_mm)?;
        Ok(Smooth::RoundedFrustum { centre: self.centre()?, radius, top_radius, height })
    }

    fn elliptic_tube(&self) -> Result<Solid, ShapeProblem> {
        let centre = |key: &str, centre: Option<[f64; 2]>| finite(key, centre.unwrap_or_default());
        let outer = Ellipse {
            centre: centre("outer_centre_mm", self.outer_centre_mm)?,
            half_axes: lengths("outer_half_axes_mm", self.outer_half_axes_mm)?,
        };
        let inner = Ellipse {
            centre: centre("inner_centre_mm", self.inner_centre_mm.or(self.outer_centre_mm))?,
            half_axes: lengths("inner_half_axes_mm", self.inner_half_axes_mm)?,
        };
        let offset: Vec<f64> =
            (0..2).map(|i| (outer.centre[i] - inner.centre[i]) / inner.half_axes[i]).collect();
        if offset[0].hypot(offset[1]) >= 1.0 {
            return Err(ShapeProblem::new(
                "inner_centre_mm",
                "the outer centre is not within the inner ellipse",
                "move the inner ellipse nearer",
            ));
        }
        let z = finite("z_mm", needed("z_mm", self.z_mm)?)?;
        if z[1] - z[0] < MIN_MM {
            return Err(ShapeProblem::new("z_mm", "the tube has no height", "write [low, high]"));
        }
        let sector_deg = self.sector_deg.map(|_| self.sector()).transpose()?;
        Ok(Solid::EllipticTube(EllipticTube { outer, inner, z, sector_deg }))
    }

    fn torus_sector(&self) -> Result<Solid, ShapeProblem> {
        let ring_radius = length("ring_radius_mm", self.ring_radius_mm)?;
        let tube_radius = length("tube_radius_mm", self.tube_radius_mm)?;
        if tube_radius >= ring_radius {
            return Err(ShapeProblem::new(
                "tube_radius_mm",
                "the tube is wider than its ring and would cross itself",
                "make it less than `ring_radius_mm`",
            ));
        }
        Ok(Solid::TorusSector(TorusSector {
            centre: self.centre()?,
            ring_radius,
            tube_radius,
            sector_deg: self.sector()?,
        }))
    }

    fn polytope(&self) -> Result<Solid, ShapeProblem> {
        let (key, points) = if self.kind == "box" {
            let [min, max] = [("min_mm", self.min_mm), ("max_mm", self.max_mm)]
                .map(|(key, corner)| finite(key, needed(key, corner)?));
            let (min, max) = (min?, max?);
            if (0..3).any(|i| max[i] - min[i] < MIN_MM) {
                return Err(ShapeProblem::new(
                    "max_mm",
                    "the box has no volume",
                    "write the greater corner here",
                ));
            }
            let corner = |i: usize| std::array::from_fn(|k| if i >> k & 1 == 0 { min[k] } else { max[k] });
            ("max_mm", (0..8).map(corner).collect())
        } else {
            ("points_mm", needed("points_mm", self.points_mm.clone())?)
        };
        if self.kind == "tetrahedron" && points.len() != 4 {
            let given = format!("{} points", points.len());
            return Err(ShapeProblem::new(key, given, "give four, or make it a `hull`"));
        }
        if points.len() > MAX_POINTS {
            let given = format!("{} points", points.len());
            return Err(ShapeProblem::new(key, given, format!("give at most {MAX_POINTS}, or a mesh file")));
        }
        let points: Vec<DVec3> = points
            .into_iter()
            .map(|p: [f64; 3]| finite(key, p).map(DVec3::from))
            .collect::<Result<_, _>>()?;
        let mesh = convex_hull(&points)
            .map_err(|e| ShapeProblem::new(key, e.to_string(), "give points that span a volume"))?;
        Ok(Solid::Polytope(mesh))
    }

    fn frame(&self) -> Result<Frame, ShapeProblem> {
        let translation = finite("move_mm", self.move_mm.unwrap_or_default())?.into();
        match (self.rotate_deg, self.axes) {
            (Some(_), Some(_)) => Err(ShapeProblem::new(
                "axes",
                "the rotation is given twice, as `rotate_deg` and as `axes`",
                "remove one",
            )),
            (Some(degrees), None) => Ok(Frame::turned(finite("rotate_deg", degrees)?.into(), translation)),
            (None, Some(rows)) => Frame::of_axes(rows.map(DVec3::from), translation),
            (None, None) => Ok(Frame::moved(translation)),
        }
    }

    fn cuts(&self) -> Result<Vec<Cut>, ShapeProblem> {
        let cuts = self.cuts.as_deref().unwrap_or_default();
        if cuts.len() > MAX_CUTS {
            let given = format!("{} cuts", cuts.len());
            return Err(ShapeProblem::new("cuts", given, format!("give at most {MAX_CUTS}")));
        }
        let cut = |(i, spec): (usize, &CutSpec)| {
            let key = format!("cuts[{i}]");
            let normal = DVec3::from(finite(&key, spec.normal)?);
            let [offset] = finite(&key, [spec.offset_mm])?;
            let length = normal.length();
            if length < MIN_MM {
                return Err(ShapeProblem::new(key, "the normal is zero", "give a direction"));
            }
            // Dividing by 1 exactly keeps an axis-aligned cut exact.
            Ok(Cut { normal: normal / length, offset })
        };
        cuts.iter().enumerate().map(cut).collect()
    }

    fn centre(&self) -> Result<DVec3, ShapeProblem> {
        Ok(finite("centre_mm", self.centre_mm.unwrap_or_default())?.into())
    }

    fn end_centres(&self) -> Result<(DVec3, DVec3), ShapeProblem> {
        let bottom = finite("bottom_centre_mm", needed("bottom_centre_mm", self.bottom_centre_mm)?)?;
        let top = finite("top_centre_mm", needed("top_centre_mm", self.top_centre_mm)?)?;
        if top[2] - bottom[2] < MIN_MM {
            return Err(ShapeProblem::new(
                "top_centre_mm",
                "the top is not above the bottom",
                "give it the greater z, or turn the shape with `rotate_deg`",
            ));
        }
        Ok((bottom.into(), top.into()))
    }

    fn half_axes_2(&self) -> Result<[f64; 2], ShapeProblem> {
        let axes = needed("half_axes_mm", self.half_axes_mm.clone())?;
        lengths("half_axes_mm", Some(as_many("half_axes_mm", axes)?))
    }

    fn half_axes_3(&self) -> Result<DVec3, ShapeProblem> {
        let axes = needed("half_axes_mm", self.half_axes_mm.clone())?;
        Ok(lengths::<3>("half_axes_mm", Some(as_many("half_axes_mm", axes)?))?.into())
    }

    fn sector(&self) -> Result<[f64; 2], ShapeProblem> {
        let [from, to] = finite("sector_deg", needed("sector_deg", self.sector_deg)?)?;
        if to - from <= 0.0 || to - from >= 360.0 {
            return Err(ShapeProblem::new(
                "sector_deg",
                format!("the sector spans {}°", to - from),
                "write [from, to] with 0 < to − from < 360",
            ));
        }
        Ok([from, to])
    }
}
