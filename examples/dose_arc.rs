//! A field turning about the liver: how much of the primary beam each organ absorbs, by gantry angle.
//!
//! `cargo run --release --example dose_arc`

use chordfield::modes::dose::{Dose, NoPaths};
use chordfield::modes::{Control, project::Method};
use chordfield::scene::{Folder, SceneText};
use chordfield::study::Study;

const ARC: &str = r#"
scene = "adult"
[beam]
isocentre = "liver"
control_points = [{ gantry_deg = "0..360:10" }]
[paths]
field = { circle_mm = 60, spacing_mm = 3 }
[spectrum]
kvp = 120
"#;

fn main() -> chordfield::Result<()> {
    let study = Study::build(&SceneText::new("arc", ARC), &Folder::none(), &[], false)?;
    let report = Dose::new(&study, Method::Exact(None))?.run(&mut NoPaths, &Control::none())?;
    let mut text = format!("{}\n", report.notice);
    for field in &report.fields {
        let liver = field.figures.organs.iter().find(|organ| organ.organ == "liver");
        let share = 100.0 * liver.map_or(0.0, |liver| liver.absorbed_share);
        let gantry = field.angles.map_or(0.0, |angles| angles.gantry_deg);
        text += &format!("gantry {gantry:3}°: {share:5.2} % of the energy absorbed in the liver\n");
    }
    std::io::Write::write_all(&mut std::io::stdout(), text.as_bytes())
        .map_err(|e| chordfield::Error::io("write", "standard output".as_ref(), e))
}
