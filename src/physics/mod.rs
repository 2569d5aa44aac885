//! What matter does to a beam once the lengths are known: attenuation, detection, noise and colour.
//!
//! ```text
//! own lengths (mm) ─┬─► Attenuator (materials × spectrum × response) ─► p, T ─► CountingNoise
//!                   └─► composite (colours × opacities) ─► linear RGBA ─► sRGB
//! ```
//!
//! Nothing here knows of rays, meshes or files: lengths come in, numbers go out, so that any spectrum can be
//! evaluated on lengths computed once.

pub mod attenuation;
pub mod composite;
pub mod detector;
pub mod materials;
pub mod noise;
pub mod spectrum;

pub use attenuation::{Attenuator, RowMass};
pub use composite::{Appearance, Opacity, Stretch};
pub use detector::DetectorResponse;
pub use materials::Material;
pub use noise::PhotonNoise;
pub use spectrum::{Filter, Spectrum};
