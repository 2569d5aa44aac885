//! Where paths lead.

use std::sync::Arc;

use glam::DVec3;

use super::Builder;
use crate::error::Result;
use crate::geometry::Side;
use crate::scene::beam::{BeamKind, DEFAULT_SAD_MM};
use crate::scene::panel::MAX_COORDINATE_MM;
use crate::scene::text::Step;
use crate::scene::{Organ, regular_file};
use crate::study::Input;
use crate::study::list;
use crate::study::paths::{ListedPath, PathSet};
use crate::study::plane::{PlanePoints, Problem};
use crate::study::schema::{PathsSpec, PointSpec, StudySpec};

impl Builder<'_> {
    /// The paths, and the names of their targets.
    pub(super) fn paths(&mut self, spec: &StudySpec, scene: usize) -> Result<(PathSet, Vec<String>)> {
        let PathsSpec { points, segments_mm, csv, fan, grid, field, beyond_mm, .. } = &spec.paths;
        let shapes = [
            points.is_some(),
            segments_mm.is_some(),
            csv.is_some(),
            fan.is_some(),
            grid.is_some(),
            field.is_some(),
        ];
        if shapes.iter().filter(|is_given| **is_given).count() != 1 {
            let remedy = "give one of `points`, `segments_mm`, `csv`, `fan`, `grid` or `field`";
            return Err(self.at(&["paths"], "a study has paths of one kind", remedy));
        }
        let beyond = beyond_mm.unwrap_or(0.0);
        self.finite(&["paths", "beyond_mm"], &[beyond])?;
        if beyond < 0.0 {
            let problem = format!("{beyond} mm is not behind the target");
            return Err(self.at(&["paths", "beyond_mm"], &problem, "give 0 or more"));
        }
        let is_list = segments_mm.is_some() || csv.is_some();
        if is_list && (beyond_mm.is_some() || !spec.beam.control_points.is_empty()) {
            let key: &[&str] =
                if beyond_mm.is_some() { &["paths", "beyond_mm"] } else { &["beam", "control_points"] };
            return Err(self.at(
                key,
                "has no meaning for paths with sources and targets of their own",
                "drop it",
            ));
        }
        if let Some(points) = points {
            let organs = &self.scenes[scene].1.organs;
            let named = points.iter().enumerate().map(|(i, point)| self.point(i, point, organs));
            let (names, points): (Vec<_>, Vec<_>) = named.collect::<Result<Vec<_>>>()?.into_iter().unzip();
            if points.is_empty() {
                return Err(self.at(&["paths", "points"], "the list is empty", "give at least one point"));
            }
            return Ok((PathSet::Points { points, beyond_mm: beyond }, names));
        }
        if let Some(segments) = segments_mm {
            return Ok((self.segments(segments)?, Vec::new()));
        }
        if let Some(file) = csv {
            return Ok((PathSet::List(self.list(file)?), Vec::new()));
        }
        // Far enough that a patient between source and isocentre, and as far behind, is passed.
        let beyond_mm = beyond_mm.unwrap_or_else(|| spec.beam.sad_mm.unwrap_or(DEFAULT_SAD_MM));
        let (kind, points) = if let Some(fan) = fan {
            ("fan", PlanePoints::fan(fan))
        } else if let Some(grid) = grid {
            ("grid", PlanePoints::grid(grid))
        } else if let Some(field) = field {
            ("field", PlanePoints::field(field))
        } else {
            ("", Err(("", "it is missing".into(), "give paths")))
        };
        let points = points.map_err(|(key, problem, remedy): Problem| {
            let keys: Vec<&str> = ["paths", kind, key].into_iter().filter(|key| !key.is_empty()).collect();
            self.at(&keys, &problem, remedy)
        })?;
        Ok((PathSet::Plane { points, beyond_mm }, Vec::new()))
    }

    fn segments(&self, segments: &[[f64; 6]]) -> Result<PathSet> {
        let path = |(i, &ends): (usize, &[f64; 6])| {
            let at = [Step::Key("paths"), Step::Key("segments_mm"), Step::Index(i)];
            let is_fit = ends.iter().all(|x| x.abs() <= MAX_COORDINATE_MM);
            let listed = if is_fit {
                list::listed(ends, 1.0)
            } else {
                Err(("a coordinate is not finite, or beyond 1e9 mm".into(), "give points in millimetres"))
            };
            listed.map_err(|(problem, remedy)| self.blame.at(&at, &problem, remedy))
        };
        let paths: Vec<ListedPath> = segments.iter().enumerate().map(path).collect::<Result<_>>()?;
        if paths.is_empty() {
            return Err(self.at(&["paths", "segments_mm"], "the list is empty", "give at least one segment"));
        }
        Ok(PathSet::List(Arc::new(paths)))
    }

    fn list(&mut self, file: &str) -> Result<Arc<Vec<ListedPath>>> {
        if let Some((_, list)) = self.lists.iter().find(|(known, _)| known == file) {
            return Ok(Arc::clone(list));
        }
        let path = self.folder.resolve(file).map_err(|e| self.reworded(&["paths", "csv"], e))?;
        let text = regular_file::read_text(&path, list::PATH_FILE)?;
        let paths = Arc::new(list::read(file, &text)?);
        self.inputs.push(Input::new("paths", file, text.as_bytes()));
        self.lists.push((file.into(), Arc::clone(&paths)));
        Ok(paths)
    }

    /// A point of interest, with its name.
    fn point(&self, index: usize, spec: &PointSpec, organs: &[Organ]) -> Result<(String, DVec3)> {
        let at = |key, problem: &str, remedy: &str| {
            let path = [Step::Key("paths"), Step::Key("points"), Step::Index(index), Step::Key(key)];
            self.blame.at(&path, problem, remedy)
        };
        let known = |name: &String| {
            organs.iter().position(|organ| organ.name == *name).ok_or_else(|| {
                let names: Vec<_> = organs.iter().map(|organ| organ.name.as_str()).collect();
                let remedy = format!("name one of {}", names.join(", "));
                at("organ", &format!("the scene has no organ `{name}`"), &remedy)
            })
        };
        let organ = spec.organ.as_ref().map(known).transpose()?;
        let point = match (spec.at_mm, organ) {
            (Some(given), _) if given.iter().any(|x| !x.is_finite() || x.abs() > MAX_COORDINATE_MM) => {
                return Err(at("at_mm", "a coordinate is not finite, or beyond 1e9 mm", "give millimetres"));
            }
            (Some(given), organ) => {
                let point = DVec3::from(given);
                if let Some(organ) = organ.map(|organ| &organs[organ])
                    && organ.body.surface().side_of(point) == Side::Outside
                {
                    let problem = format!("the point is not inside `{}`", organ.name);
                    return Err(at("at_mm", &problem, "move the point, or drop `organ`"));
                }
                point
            }
            (None, Some(organ)) => organs[organ].body.surface().centroid_mm(),
            (None, None) => {
                return Err(at(
                    "name",
                    "the point has no place",
                    "give `at_mm`, or `organ` for its centroid",
                ));
            }
        };
        let name = spec
            .name
            .clone()
            .or_else(|| spec.organ.clone())
            .unwrap_or_else(|| format!("point {}", index + 1));
        Ok((name, point))
    }

    pub(super) fn reference_distance(&self, spec: &StudySpec) -> Result<Option<f64>> {
        let is_list = spec.paths.segments_mm.is_some() || spec.paths.csv.is_some();
        let keys = ["paths", "reference_distance_mm"];
        if spec.beam.kind == BeamKind::Parallel && !is_list {
            return match spec.paths.reference_distance_mm {
                None => Ok(None),
                Some(_) => {
                    let problem = "parallel rays have the same fluence at any distance";
                    Err(self.at(&keys, problem, "drop it, or let the beam be a cone"))
                }
            };
        }
        let given = spec.paths.reference_distance_mm.or(spec.beam.sad_mm);
        self.distance(&keys, given.unwrap_or(DEFAULT_SAD_MM)).map(Some)
    }
}
