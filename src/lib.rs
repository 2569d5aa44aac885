//! Exact intersection lengths of rays with organs, and the images that follow from them.
//!
//! A [`Scene`](scene::Scene) is a set of closed organ surfaces that do not cross; they may be nested. For each ray
//! the library finds how many millimetres lie in each organ and in none of the organs within it. From lengths come
//! attenuated projections for any spectrum.
//!
//! ```text
//! scene.toml ─► scene ─► geometry ─► exact ──┐ samples
//!               (units,  (closed?    (clip,  ▼
//!                frames)  convex?)    bvh)   ritree<Attribute> ◄── linespace (s, t, u, v)
//!                                       │    │ queries
//!                                       ▼    ▼
//!                     study ─► modes: project, audit, dose, raytrace, bench ─► output (images, tables, records, reports)
//! ```
//!
//! The picture shows the way of the data. Imports run from the parts to the whole: `geometry` knows no room, `exact`,
//! `surface` and `linespace` know geometry, `ritree` lines and cells only, `attributes` join it with `exact` and
//! `surface`; a `scene` is made of bodies that `geometry` and `exact` have proved, and of `physics` (one to be rendered,
//! of `surface`s); a `study` is numbered paths through scenes; `modes` use all of these, `output` writes what modes return,
//! `cli` calls both. Lengths are mm, angles degrees, energies keV, densities g/cm³, attenuation coefficients cm⁻¹; points
//! are in the patient's LPS frame (+x left, +y back, +z head).
//!
//! ```
//! use chordfield::modes::{Control, project::{Method, Projector, Wanted}};
//! use chordfield::scene::Scene;
//!
//! let scene = Scene::phantom("calibration")?;
//! let wanted = Wanted { lengths: true, attenuation: true, colour: false };
//! let projector = Projector::new(&scene, wanted, None, Method::Exact(None))?;
//! for (i, view) in scene.beam.views()?.iter().enumerate() {
//!     let projection = projector.project(view, i as u64, &Control::none())?;
//!     let longest = projection.own_length_mm(0).into_iter().fold(0.0, f32::max);
//!     assert!(longest > 0.0, "{} is in the picture", scene.organs[0].name);
//! }
//! # Ok::<(), chordfield::Error>(())
//! ```

pub mod attributes;
pub mod cli;
mod dispatch;
pub mod error;
pub mod exact;
pub mod geometry;
pub mod linespace;
pub mod modes;
pub mod output;
pub mod physics;
pub mod ritree;
pub mod scene;
pub mod study;
pub mod surface;

pub use error::{Error, Result};
