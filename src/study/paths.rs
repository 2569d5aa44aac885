//! Paths by number: where each starts, where it ends, and what it stands for.
//!
//! ```text
//!     S  source                    S'─┬─┐            A cone's path goes from S through a point P of the isocentre plane and
//!     │╲                              │ │            ends in the plane `beyond` behind it; parallel paths start SAD before.
//!  SAD│ ╲                             ▼ ▼
//!     I──P── isocentre plane       I──P─              Photons of a point source are isotropic: a path stands for as many as
//!     │   ╲                           │ │            its cell's solid angle, dΩ = dA · SAD / |SP|³; of a parallel beam, for
//!     ▼────T  beyond                  ▼ ▼            its cell's area.
//! ```

use std::sync::Arc;

use glam::DVec3;

use super::plane::PlanePoints;
use crate::geometry::Segment;
use crate::scene::beam::BeamKind;
use crate::scene::iec::{BeamAxes, IecAngles};

/// A source, and the plane it looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// Whether all paths start at the source.
    pub kind: BeamKind,
    /// The source, patient LPS, mm; of a parallel beam, the point that stands for it.
    pub source_mm: DVec3,
    /// The isocentre, patient LPS, mm.
    pub isocentre_mm: DVec3,
    /// Source to isocentre, mm.
    pub sad_mm: f64,
    /// The angles; `None` of a source placed by hand, which has points of interest only.
    pub angles: Option<IecAngles>,
    /// The beam's axes in patient LPS.
    pub axes: BeamAxes,
}

/// A path, and what it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Where it starts, patient LPS, mm.
    pub source_mm: DVec3,
    /// From there to its target, mm.
    pub path_mm: DVec3,
    /// How many photons it stands for; relative to the other paths of its field.
    pub photons: f64,
    /// The pencil that it stands for; `None` of single paths and of fans.
    pub pencil: Option<Pencil>,
}

impl Shot {
    /// The path as a segment. The study's paths have all been checked to have one.
    pub fn segment(&self) -> Option<Segment> {
        Segment::along(self.source_mm, self.path_mm)
    }

    /// Where it ends, mm.
    pub fn target_mm(&self) -> DVec3 {
        self.source_mm + self.path_mm
    }
}

/// The thin pyramid or column around a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pencil {
    /// Its section with the isocentre plane, mm².
    pub area_mm2: f64,
    /// Its solid angle; `None` if it is a column.
    pub solid_angle_sr: Option<f64>,
}

impl Pencil {
    /// Its volume between two depths along its path, mm³.
    pub fn volume_mm3(&self, entry_mm: f64, exit_mm: f64) -> f64 {
        match self.solid_angle_sr {
            Some(solid_angle) => solid_angle * (exit_mm.powi(3) - entry_mm.powi(3)) / 3.0,
            None => self.area_mm2 * (exit_mm - entry_mm),
        }
    }
}

/// The paths of a field, by number.
#[derive(Clone, Debug)]
pub(super) enum PathSet {
    /// From the source to points of interest, and so far beyond, mm.
    Points { points: Vec<DVec3>, beyond_mm: f64 },
    /// Through the isocentre plane, and so far beyond, mm.
    Plane { points: PlanePoints, beyond_mm: f64 },
    /// Sources and targets of their own.
    List(Arc<Vec<ListedPath>>),
}

/// A path of a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ListedPath {
    pub source_mm: DVec3,
    pub target_mm: DVec3,
    pub photons: f64,
}

impl PathSet {
    pub fn count(&self) -> u64 {
        match self {
            Self::Points { points, .. } => points.len() as u64,
            Self::Plane { points, .. } => points.count(),
            Self::List(list) => list.len() as u64,
        }
    }

    /// The path of a number below [`count`](Self::count).
    pub fn shot(&self, machine: &Machine, index: u64) -> Shot {
        match self {
            Self::Points { points, beyond_mm } => {
                let point = points[index as usize];
                let source_mm = match machine.kind {
                    BeamKind::Cone => machine.source_mm,
                    // On the plane through the source, upstream of the point.
                    BeamKind::Parallel => {
                        point + (machine.source_mm - point).dot(machine.axes.z) * machine.axes.z
                    }
                };
                let way = point - source_mm;
                let path_mm = way + *beyond_mm * way.normalize_or_zero();
                Shot { source_mm, path_mm, photons: 1.0, pencil: None }
            }
            Self::Plane { points, beyond_mm } => through_plane(points, machine, *beyond_mm, index),
            Self::List(list) => {
                let ListedPath { source_mm, target_mm, photons } = list[index as usize];
                Shot { source_mm, path_mm: target_mm - source_mm, photons, pencil: None }
            }
        }
    }
}

fn through_plane(points: &PlanePoints, machine: &Machine, beyond_mm: f64, index: u64) -> Shot {
    let [x, y] = points.point(index);
    let Machine { axes, sad_mm, isocentre_mm, .. } = *machine;
    let point = isocentre_mm + x * axes.x + y * axes.y;
    match machine.kind {
        BeamKind::Cone => {
            let way = point - machine.source_mm;
            let solid_angle = |area_mm2: f64| area_mm2 * sad_mm / way.length().powi(3);
            let pencil = points
                .cell_mm2()
                .map(|area_mm2| Pencil { area_mm2, solid_angle_sr: Some(solid_angle(area_mm2)) });
            Shot {
                source_mm: machine.source_mm,
                path_mm: ((sad_mm + beyond_mm) / sad_mm) * way,
                photons: pencil.and_then(|pencil| pencil.solid_angle_sr).unwrap_or(1.0),
                pencil,
            }
        }
        BeamKind::Parallel => Shot {
            source_mm: point + sad_mm * axes.z,
            path_mm: -(sad_mm + beyond_mm) * axes.z,
            photons: points.cell_mm2().unwrap_or(1.0),
            pencil: points.cell_mm2().map(|area_mm2| Pencil { area_mm2, solid_angle_sr: None }),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::iec::PatientPosition;
    use crate::study::schema::GridSpec;

    fn machine(kind: BeamKind, gantry_deg: f64) -> Machine {
        let angles = IecAngles {
            gantry_deg,
            couch_deg: 0.0,
            collimator_deg: 0.0,
            patient_position: PatientPosition::HeadFirstSupine,
        };
        let (axes, isocentre_mm) = (angles.beam_axes(), DVec3::new(10.0, 20.0, 30.0));
        let source_mm = isocentre_mm + 500.0 * axes.z;
        Machine { kind, source_mm, isocentre_mm, sad_mm: 500.0, angles: Some(angles), axes }
    }

    fn grid(points: [u32; 2]) -> PlanePoints {
        PlanePoints::grid(&GridSpec { size_mm: [200.0, 100.0], points }).expect("a grid")
    }

    #[test]
    fn paths_from_the_front_and_from_the_left_run_as_worked_out_by_hand() {
        let set = PathSet::Plane { points: grid([2, 1]), beyond_mm: 100.0 };
        // AP: the source is before the patient, X_b is the patient's left. The second point is 50 mm to the left.
        let shot = set.shot(&machine(BeamKind::Cone, 0.0), 1);
        assert_eq!(shot.source_mm, DVec3::new(10.0, -480.0, 30.0));
        assert!((shot.target_mm() - DVec3::new(70.0, 120.0, 30.0)).length() < 1e-12, "{}", shot.target_mm());
        // From the patient's left, X_b is the back.
        let shot = set.shot(&machine(BeamKind::Cone, 90.0), 1);
        assert_eq!(shot.source_mm, DVec3::new(510.0, 20.0, 30.0));
        assert!((shot.target_mm() - DVec3::new(-90.0, 80.0, 30.0)).length() < 1e-12, "{}", shot.target_mm());
        let shot = set.shot(&machine(BeamKind::Parallel, 180.0), 1);
        assert_eq!(shot.source_mm, DVec3::new(-40.0, 520.0, 30.0));
        assert!((shot.path_mm - DVec3::new(0.0, -600.0, 0.0)).length() < 1e-12);
    }

    #[test]
    fn solid_angles_of_a_field_add_up_to_that_of_its_rectangle() {
        let set = PathSet::Plane { points: grid([400, 200]), beyond_mm: 0.0 };
        let machine = machine(BeamKind::Cone, 33.0);
        let sum: f64 = (0..set.count()).map(|i| set.shot(&machine, i).photons).sum();
        // 4 asin(ab / sqrt((a² + d²)(b² + d²))), half sides a and b at distance d.
        let (a, b, d) = (100.0_f64, 50.0_f64, 500.0_f64);
        let exact = 4.0 * (a * b / ((a * a + d * d) * (b * b + d * d)).sqrt()).asin();
        assert!((sum / exact - 1.0).abs() < 1e-6, "{sum} {exact}");
    }

    #[test]
    fn pencils_have_the_volume_of_the_frustum_they_fill() {
        let (set, machine) =
            (PathSet::Plane { points: grid([200, 100]), beyond_mm: 0.0 }, machine(BeamKind::Cone, 0.0));
        // A slab of 10 mm before the isocentre plane: the frustum between its sections.
        let volume = |i: u64| {
            let shot = set.shot(&machine, i);
            let length = shot.path_mm.length();
            shot.pencil.expect("a pencil").volume_mm3(length * 490.0 / 500.0, length)
        };
        let sum: f64 = (0..set.count()).map(volume).sum();
        let exact = 200.0 * 100.0 * (500.0 / 3.0) * (1.0 - (490.0_f64 / 500.0).powi(3));
        assert!((sum / exact - 1.0).abs() < 1e-12, "{sum} {exact}");
    }

    #[test]
    fn a_point_is_the_target_and_parallel_paths_start_on_the_sources_plane() {
        let point = DVec3::new(40.0, 25.0, 35.0);
        let set = PathSet::Points { points: vec![point], beyond_mm: 0.0 };
        let cone = set.shot(&machine(BeamKind::Cone, 0.0), 0);
        assert_eq!((cone.source_mm, cone.target_mm()), (DVec3::new(10.0, -480.0, 30.0), point));
        let parallel = set.shot(&machine(BeamKind::Parallel, 0.0), 0);
        assert_eq!((parallel.source_mm, parallel.target_mm()), (DVec3::new(40.0, -480.0, 35.0), point));
    }
}
