//! `chordfield check`: can this be projected, and if not, what to do.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use super::args::CheckArgs;
use super::{Outcome, print, project};
use crate::error::{Error, Result};
use crate::exact::Body;
use crate::output::json;
use crate::output::sidecar::OrganRecord;
use crate::scene::Scene;
use crate::scene::body::{self, Proved};
use crate::scene::organ::{Organ, Origin};
use crate::scene::shape::Shape;

/// Checks each file and says what it found; [`Outcome::Refused`] if any cannot be used.
pub fn run(args: &CheckArgs, out: &mut dyn Write) -> Result<Outcome> {
    let findings: Vec<Finding> = args.files.iter().map(|file| Finding::of(file)).collect();
    let text = if args.json {
        json::text(&findings)?
    } else {
        findings.iter().map(Finding::words).collect::<Vec<_>>().join("\n")
    };
    print(out, &text)?;
    let all_usable = findings.iter().all(|f| f.usable);
    Ok(if all_usable { Outcome::Done } else { Outcome::Refused })
}

/// What was found of one file.
#[derive(Debug, Serialize)]
struct Finding {
    file: String,
    usable: bool,
    #[serde(flatten)]
    content: Content,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
enum Content {
    Scene { organs: Vec<OrganFinding> },
    Surface(SurfaceRecord),
    Problems(Vec<Problem>),
}

/// An organ, and how far its mesh is from the shape it stands for.
#[derive(Debug, Serialize)]
struct OrganFinding {
    #[serde(flatten)]
    organ: OrganRecord,
    /// How deep the mesh lies under the true surface at worst, mm; none for organs from mesh files.
    #[serde(skip_serializing_if = "Option::is_none")]
    tessellation_depth_mm: Option<f64>,
    /// The volume of the true body, mm³; none for organs from mesh files.
    #[serde(skip_serializing_if = "Option::is_none")]
    true_volume_mm3: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Problem {
    problem: String,
    remedy: String,
}

#[derive(Debug, Serialize)]
struct SurfaceRecord {
    faces: usize,
    vertices: usize,
    components: usize,
    volume: f64,
    area: f64,
    size: [f64; 3],
    convex: bool,
    convexity: String,
    notices: Vec<String>,
}

impl Finding {
    fn of(path: &Path) -> Self {
        let file = path.display().to_string();
        let is_scene = path.extension().is_none_or(|e| e.eq_ignore_ascii_case("toml"));
        let content = if is_scene { project::open(&file).map(scene_content) } else { surface_content(path) };
        match content {
            Ok(content) => Self { file, usable: true, content },
            Err(error) => Self { file, usable: false, content: Content::Problems(problems(error)) },
        }
    }

    fn words(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = match &self.content {
            Content::Scene { organs } => write_scene(&mut text, &self.file, organs),
            Content::Surface(surface) => write_surface(&mut text, &self.file, surface),
            Content::Problems(problems) => write_problems(&mut text, &self.file, problems),
        };
        text
    }
}

fn scene_content(scene: Scene) -> Content {
    Content::Scene { organs: scene.organs.par_iter().map(|o| organ_finding(o, &scene.organs)).collect() }
}

fn organ_finding(organ: &Organ, organs: &[Organ]) -> OrganFinding {
    let shapes = match &organ.origin {
        Origin::Shapes(shapes) => &shapes[..],
        Origin::Mesh { .. } => &[],
    };
    // The scene was built from these shapes, so they can be tessellated.
    let depths = shapes.iter().filter_map(|s| s.tessellation_depth_mm().ok());
    OrganFinding {
        organ: OrganRecord::of(organ, organs),
        tessellation_depth_mm: depths.reduce(f64::max),
        true_volume_mm3: (!shapes.is_empty()).then(|| shapes.iter().map(Shape::volume_mm3).sum()),
    }
}

fn surface_content(path: &Path) -> Result<Content> {
    let Proved { body, notices } = body::of_file(path)?;
    let surface = body.surface();
    Ok(Content::Surface(SurfaceRecord {
        faces: surface.mesh().faces.len(),
        vertices: surface.mesh().vertices.len(),
        components: surface.component_count(),
        volume: surface.volume_mm3(),
        area: surface.mesh().area(),
        size: surface.bounds().size().to_array(),
        convex: body.convexity().is_ok(),
        convexity: convexity(&body),
        notices,
    }))
}

fn convexity(body: &Body) -> String {
    match body.convexity() {
        Ok(mesh) if mesh.reflex_depth_mm() == 0.0 => "convex".into(),
        Ok(mesh) => format!("convex within rounding (worst reflex depth {:.1e})", mesh.reflex_depth_mm()),
        Err(why) => format!("not convex: {why}. It is traced exactly all the same, face by face"),
    }
}

/// One problem per error, with the line of the scene where there is one.
fn problems(error: Error) -> Vec<Problem> {
    match error {
        Error::Several { errors, .. } => errors.into_iter().flat_map(problems).collect(),
        error => {
            let line = error.line().map(|line| format!("line {line}: ")).unwrap_or_default();
            let (problem, remedy) = error.into_words();
            vec![Problem { problem: format!("{line}{problem}"), remedy }]
        }
    }
}

fn write_scene(text: &mut String, file: &str, organs: &[OrganFinding]) -> std::fmt::Result {
    writeln!(text, "{file}: ready, {} organs that do not cross", organs.len())?;
    let width = organs.iter().map(|f| f.organ.name.chars().count() + 2 * f.organ.depth).max().unwrap_or(0);
    for finding in organs {
        let organ = &finding.organ;
        let name = format!("{}{}", "  ".repeat(organ.depth), organ.name);
        let form = if organ.convex { "convex" } else { "not convex" };
        let depth = match finding.tessellation_depth_mm {
            Some(0.0) => ", exact".into(),
            Some(depth) => format!(", up to {depth:.3} mm under the true surface"),
            None => String::new(),
        };
        let inside = organ.inside.as_ref().map(|p| format!(", inside {p}")).unwrap_or_default();
        let (volume, faces) = (organ.volume_mm3 / 1e3, organ.faces);
        writeln!(text, "  {name:width$}  {volume:>10.2} mL  {faces:>6} faces{depth}, {form}{inside}")?;
        for notice in &organ.notices {
            writeln!(text, "  {:width$}  notice: {notice}", "")?;
        }
    }
    Ok(())
}

fn write_surface(text: &mut String, file: &str, s: &SurfaceRecord) -> std::fmt::Result {
    let pieces = if s.components == 1 { "one piece".into() } else { format!("{} pieces", s.components) };
    writeln!(text, "{file}: ready, a closed surface")?;
    writeln!(text, "  {} faces, {} vertices, {pieces}, facing outward", s.faces, s.vertices)?;
    let [x, y, z] = s.size;
    writeln!(
        text,
        "  {x:.3} × {y:.3} × {z:.3} units, volume {:.6} units³, area {:.6} units²",
        s.volume, s.area
    )?;
    writeln!(text, "  {}", s.convexity)?;
    s.notices.iter().try_for_each(|notice| writeln!(text, "  notice: {notice}"))
}

fn write_problems(text: &mut String, file: &str, problems: &[Problem]) -> std::fmt::Result {
    writeln!(text, "{file}: cannot be used")?;
    for Problem { problem, remedy } in problems {
        let own_name = format!("{file}: ");
        writeln!(text, "  {}", problem.strip_prefix(&own_name).unwrap_or(problem))?;
        if !remedy.is_empty() {
            writeln!(text, "  what to do: {remedy}")?;
        }
    }
    Ok(())
}
