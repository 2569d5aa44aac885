//! What the words of the page mean.

use crate::modes::audit::AuditReport;
use crate::output::page::{escape, grouped};

/// The list of words.
pub fn definitions(report: &AuditReport) -> String {
    let reference = match &report.against[..] {
        "reference" => {
            "clipping against all face planes in f64 for convex organs, crossings with a hierarchy of boxes for \
             all others, each ray by itself"
        }
        other => other,
    };
    format!(
        "<dl><dt>Error</dt><dd>The method's length of a ray in an organ less the reference's: {}. Rays that miss the \
         organ for both are not counted. All figures but the bias are of magnitudes.</dd>\
         <dt>p50 … p99.9</dt><dd>That share of the errors is no larger. Too high by 1/32 at most, never too low.</dd>\
         <dt>Silhouette</dt><dd>Rays whose reference chord is under {} of the longest chord, along the ray, of the \
         ellipsoid that fills the organ's box: the outer 4.6 % of an ellipsoid's radius.</dd>\
         <dt>Traced</dt><dd>What no tree interpolates: found by an exact engine.</dd>\
         <dt>Accumulation</dt><dd>Lengths summed along the rays of an image (the raster engine) against the \
         reference.</dd>\
         <dt>Mesh</dt><dd>The reference on the organ's flat faces against the closed form of its shape, on rays that meet \
         either. Organs from files, of several shapes, tubes and torus sectors have none.</dd>\
         <dt>ΔT</dt><dd>The change of T = exp(−Σ μL) by the error, at the mean energy of the photons; of a whole ray, or of \
         one organ's error alone.</dd>\
         <dt>Rounding</dt><dd>Of a ray in a convex organ: by how much its length changes if all faces move out, or in, by as \
         much as rounding may move them. Traced lengths that differ by no more than that are taken for equal; of those that \
         differ by over 10⁻⁶ mm there were {}. A ray in the plane of a flat side is in or out by chance.</dd>\
         <dt>Distance</dt><dd>From the pixel to the nearest that misses the organ, scaled to the depth of the organ's \
         middle.</dd></dl><p class=\"note\">Primary radiation only, no scatter; not for clinical use.</p>",
        escape(reference),
        report.silhouette_share,
        grouped(report.decided_by_rounding),
    )
}
