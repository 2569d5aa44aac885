//! One ray through the adult phantom: which organs it passes, for how long, and what that does to a 60 keV photon.
//!
//! `cargo run --release --example path_through_organs`

use chordfield::geometry::{Interval, Segment};
use chordfield::scene::Scene;
use glam::DVec3;

fn main() -> chordfield::Result<()> {
    let scene = Scene::phantom("adult")?;
    // From the patient's left to the right, through stomach and liver, mm in patient LPS.
    let (source, target) = (DVec3::new(1000.0, -20.0, 350.0), DVec3::new(-500.0, -20.0, 350.0));
    let Some(ray) = Segment::between(source, target) else { return Ok(()) };

    let mut parts = Vec::new();
    let mut length_mm = |organ: usize| -> f64 {
        scene.organs[organ].body.chords_of_segment(&ray, &mut parts);
        parts.iter().map(Interval::length).sum()
    };
    let mut report = String::new();
    let mut p = 0.0;
    for (i, organ) in scene.organs.iter().enumerate() {
        let children: f64 = organ.children.iter().map(|&child| length_mm(child)).sum();
        let own_mm = length_mm(i) - children;
        if own_mm > 0.0 {
            p += organ.material.mu_per_cm(60.0, organ.density_g_cm3)? * own_mm / 10.0;
            report += &format!("{:24} {own_mm:8.3} mm\n", organ.name);
        }
    }
    report += &format!("p = {p:.4}, transmission {:.3e}\n", (-p).exp());
    std::io::Write::write_all(&mut std::io::stdout(), report.as_bytes())
        .map_err(|e| chordfield::Error::io("write", "standard output".as_ref(), e))
}
