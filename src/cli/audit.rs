//! `chordfield audit`.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use serde::Serialize;

use super::args::{AuditArgs, RayArgs};
use super::method::{method, method_named};
use super::project::{change, open};
use super::{Outcome, Session, command_line, keep, print, shell_words};
use crate::error::{Error, Result};
use crate::modes::Control;
use crate::modes::audit::{Audit, AuditReport, AuditSettings, Probe, RaySet, shell_word};
use crate::modes::figures::Figures;
use crate::modes::oracles::{self, Oracles, Size};
use crate::modes::project::Method;
use crate::modes::stability::{self, Effort};
use crate::output::page::short;
use crate::output::{audit as output, json};
use crate::scene::{Organ, Scene, View};

/// Audits a scene: writes the report if a folder is named, says its sum on `out`, and tells whether a limit is broken.
pub fn run(args: &AuditArgs, session: &Session, out: &mut dyn Write) -> Result<Outcome> {
    let mut scene = open(&args.scene)?;
    change(&mut scene, &args.beam, &args.source)?;
    if let Some(rays) = args.stress {
        return stress(
            &scene,
            Effort { rays, seed: args.rays.seed, ..Effort::default() },
            args,
            session,
            out,
        );
    }
    let rays = rays(&args.rays, &scene)?;
    let views: &[View] = if let RaySet::Views(views) = &rays { views } else { &[] };
    let settings = AuditSettings {
        method: keep::method(&args.keep, method(&args.method)?)?.for_views(views),
        against: args.against.map(|name| method_named(name, &args.method)).transpose()?,
        tolerance_mm: args.tolerance_mm,
        rays,
    };
    if args.oracles {
        return ask_oracles(&scene, settings.method, args, session, out);
    }
    let mut audit = Audit::new(&scene, settings)?;
    keep::load(&args.keep, &mut audit, session)?;
    if let Some(probe) = probe(&args.rays) {
        return reproduce(&audit, &scene, probe, args, out).map(|()| Outcome::Done);
    }
    if args.output.is_some() {
        session.begin_writing();
    }
    let bar = session.progress(audit.rays(), "rays");
    bar.set_message(scene.name.clone());
    let advance = |rays| bar.inc(rays);
    let control = Control::new(session.cancel(), &advance);
    let words: Vec<String> = std::env::args().skip(1).collect();
    let mut report = audit.run(&control)?;
    keep::save(&args.keep, &audit, session)?;
    report.command = command_line();
    for worst in &mut report.worst {
        worst.reproduce = format!("chordfield {} {}", shell_words(&setting_words(&words)), worst.reproduce);
    }
    if let Some(folder) = &args.output {
        let pictures = match report.worst.first().and_then(|worst| worst.pixel) {
            Some([view, ..]) => audit.pictures(view as usize, &control)?,
            None => None,
        };
        output::write(folder, &report, pictures.as_ref())?;
    }
    bar.finish_and_clear();
    print(out, &if args.json { json::text(&report)? } else { summary(&report, args.output.as_deref()) })?;
    Ok(match args.limit_mm {
        Some(limit_mm) if report.max_mm() > limit_mm => Outcome::LimitBroken(broken(&report, limit_mm)),
        _ => Outcome::Done,
    })
}

/// Holds the method to what must be so, whatever another engine says.
fn ask_oracles(
    scene: &Scene,
    method: Method,
    args: &AuditArgs,
    session: &Session,
    out: &mut dyn Write,
) -> Result<Outcome> {
    let bar = session.progress(scene.organs.len() as u64, "organs");
    let advance = |organs| bar.inc(organs);
    let control = Control::new(session.cancel(), &advance);
    let verdicts = Oracles::run(scene, method, args.rays.seed, Size::of(method), &control)?;
    bar.finish_and_clear();
    print(out, &if args.json { json::text(&verdicts)? } else { oracles::table(&verdicts) })?;
    let failed = verdicts.iter().filter(|v| v.outcome == oracles::Outcome::Failed).count();
    Ok(match failed {
        0 => Outcome::Done,
        _ => Outcome::LimitBroken(format!("{failed} of {} oracles failed", verdicts.len())),
    })
}

/// Holds all exact engines to rationals where it is hard.
fn stress(
    scene: &Scene,
    effort: Effort,
    args: &AuditArgs,
    session: &Session,
    out: &mut dyn Write,
) -> Result<Outcome> {
    let bar = session.progress(stability::rays(scene.organs.iter().map(|organ| &organ.body), effort), "rays");
    bar.set_message(scene.name.clone());
    let advance = |rays| bar.inc(rays);
    let control = Control::new(session.cancel(), &advance);
    let sweep = |organ: &Organ| stability::sweep(&organ.name, &organ.body, effort, &control);
    let found = scene.organs.iter().map(sweep).collect::<Result<Vec<_>>>()?.concat();
    bar.finish_and_clear();
    print(out, &if args.json { json::text(&found)? } else { stability::table(&found) })?;
    let disagreements: u64 = found.iter().map(|found| found.figures.beyond).sum();
    let first = found
        .iter()
        .find_map(|found| Some((found, found.figures.worst_ray?)).filter(|f| f.0.figures.beyond > 0));
    Ok(match first {
        None => Outcome::Done,
        Some((found, [source, target])) => {
            let [x, y, z] = source;
            let path = glam::DVec3::from(target) - glam::DVec3::from(source);
            Outcome::LimitBroken(format!(
                "{disagreements} lengths are not what rounding explains; the first by {} in `{}`, {}; to see it again: \
                 chordfield audit {} --method {} --ray={x},{y},{z},{},{},{} --organ {}",
                found.engine.name(),
                found.body,
                found.case.name(),
                shell_word(&args.scene),
                found.engine.name(),
                path.x,
                path.y,
                path.z,
                shell_word(&found.body),
            ))
        }
    })
}

fn rays(args: &RayArgs, scene: &Scene) -> Result<RaySet> {
    let seed = args.seed;
    Ok(match (args.rays, args.adversarial, args.ray) {
        (Some(rays), ..) => RaySet::Random { rays, seed },
        (_, Some(rays), _) => RaySet::Adversarial { rays, seed },
        // A ray of its own is one of no view.
        (_, _, Some(_)) => RaySet::Random { rays: 1, seed },
        _ => RaySet::Views(scene.beam.views()?),
    })
}

fn probe(args: &RayArgs) -> Option<Probe> {
    let ray = args.ray.map(|[x, y, z, dx, dy, dz]| Probe::Ray {
        source: glam::DVec3::new(x, y, z),
        path: glam::DVec3::new(dx, dy, dz),
    });
    ray.or(args.pixel.map(|[view, column, row]| Probe::Pixel { view: view as usize, column, row }))
}

/// Both answers to one ray, as they are printed.
#[derive(Serialize)]
struct Reproduced<'a> {
    organ: &'a str,
    method_mm: f64,
    reference_mm: f64,
    error_mm: f64,
    interpolated: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    cell_depth: Option<u32>,
}

fn reproduce(
    audit: &Audit,
    scene: &Scene,
    probe: Probe,
    args: &AuditArgs,
    out: &mut dyn Write,
) -> Result<()> {
    let name = args.rays.organ.as_deref().unwrap_or_default();
    let organ = scene.organs.iter().position(|organ| organ.name == name).ok_or_else(|| {
        let names: Vec<_> = scene.organs.iter().map(|o| o.name.as_str()).collect();
        Error::input(
            format!("--organ {name}"),
            "the scene has no such organ",
            format!("name one of {}", names.join(", ")),
        )
    })?;
    let answer = audit.probe(organ, probe)?;
    let found = Reproduced {
        organ: name,
        method_mm: answer.method_mm,
        reference_mm: answer.reference_mm,
        error_mm: answer.method_mm - answer.reference_mm,
        interpolated: answer.interpolated,
        cell_depth: answer.cell_depth,
    };
    if args.json {
        return print(out, &json::text(&found)?);
    }
    let how = if found.interpolated { "interpolated" } else { "traced" };
    let depth = found.cell_depth.map(|d| format!(", cell depth {d}")).unwrap_or_default();
    let text = format!(
        "{name}\nmethod     {} mm ({how}{depth})\nreference  {} mm\nerror      {} mm\n",
        found.method_mm, found.reference_mm, found.error_mm
    );
    print(out, &text)
}

/// The line that says which ray broke the limit.
fn broken(report: &AuditReport, limit_mm: f64) -> String {
    let worst = report.worst.first();
    let words = worst.map_or_else(
        || "no ray is known".into(),
        |w| {
            format!(
                "worst in `{}`, {}: {} mm for {} mm; to see it again: {}",
                w.organ, w.place, w.method_mm, w.reference_mm, w.reproduce
            )
        },
    );
    format!("the largest error, {} mm, is beyond the limit of {limit_mm} mm; {words}", report.max_mm())
}

/// The arguments that a single ray needs: all but those about rays, limits and outputs.
fn setting_words(words: &[String]) -> Vec<String> {
    const WITH_VALUE: [&str; 7] =
        ["-o", "--output", "--limit-mm", "--rays", "--adversarial", "--seed", "--threads"];
    const ALONE: [&str; 3] = ["--json", "-q", "--quiet"];
    let mut kept = Vec::new();
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let name = word.split('=').next().unwrap_or(word);
        let is_joined = word.contains('=') || (word.starts_with("-o") && word.len() > 2);
        if WITH_VALUE.contains(&name) || (word.starts_with("-o") && !word.starts_with("--")) {
            if !is_joined {
                words.next();
            }
        } else if !ALONE.contains(&word.as_str()) {
            kept.push(word.clone());
        }
    }
    kept
}

/// The report in a few lines.
fn summary(report: &AuditReport, folder: Option<&Path>) -> String {
    let mut text = String::new();
    let whole = &report.whole;
    let _ = writeln!(
        text,
        "{}: {} against {}, {} ({} rays), lengths in mm",
        report.scene, report.method, report.against, report.rays.set, report.rays.count
    );
    let _ = writeln!(
        text,
        "{:28}{:>12}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}",
        "error", "compared", "mean", "RMS", "p50", "p95", "p99", "p99.9", "max", "bias", "beyond %"
    );
    let mut row = |name: &str, f: &Figures| {
        if f.compared > 0 {
            let share = 100.0 * f.beyond_tolerance;
            let _ = write!(text, "{name:28}{:>12}", f.compared);
            for value in [f.mean, f.rms, f.p50, f.p95, f.p99, f.p999, f.max, f.bias, share] {
                let _ = write!(text, "{:>10}", short(value));
            }
            text.push('\n');
        }
    };
    row("all organs", &whole.method.length_mm);
    row("  interpolated, interior", &whole.interpolated_interior_mm);
    row("  interpolated, silhouette", &whole.interpolated_silhouette_mm);
    row("  traced, interior", &whole.traced_interior_mm);
    row("  traced, silhouette", &whole.traced_silhouette_mm);
    whole.accumulation.iter().for_each(|kind| row("accumulation", &kind.length_mm));
    whole.mesh.iter().for_each(|kind| row("mesh to closed form", &kind.length_mm));
    whole.total.iter().for_each(|kind| row("method to closed form", &kind.length_mm));
    row("change of transmission", &report.transmission);
    if report.decided_by_rounding > 0 {
        let count = report.decided_by_rounding;
        let _ = writeln!(
            text,
            "{count} traced lengths differ, but by no more than rounding of the faces may: taken for equal"
        );
    }
    if let Some(bounds) = whole.method.length_mm.confidence {
        let [low, high] = bounds.mean.map(short);
        let beyond = bounds.beyond_tolerance.map(|share| short(100.0 * share));
        let _ = writeln!(
            text,
            "of all lines, with 95 %: mean {low} to {high} mm; {} to {} % beyond {} mm",
            beyond[0], beyond[1], report.tolerance_mm
        );
    }
    if let Some(reference) = report.reference {
        let [mean, most] = [reference.mean_ulps_of_distance, reference.max_ulps_of_distance].map(short);
        let _ = writeln!(
            text,
            "the reference itself, {} lengths recomputed in rationals: off by {mean} units in the last place of the \
             distance on average, {most} at most; {} mm at most",
            reference.lengths,
            short(reference.max_mm)
        );
    }
    if let Some(worst) = report.worst.first() {
        let _ = writeln!(
            text,
            "worst: {} mm for {} mm in `{}`, {}\n  {}",
            worst.method_mm, worst.reference_mm, worst.organ, worst.place, worst.reproduce
        );
    }
    if let Some(folder) = folder {
        let _ = writeln!(text, "report: {}", folder.join(output::PAGE).display());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_finds_a_ray_again_keeps_settings_and_drops_rays_limits_and_outputs() {
        let line =
            "audit my.toml --rays 1e6 --seed=7 --max-depth 20 --limit-mm 0.5 -o out -oout --json --kvp 80";
        let words: Vec<String> = line.split(' ').map(String::from).collect();
        assert_eq!(setting_words(&words).join(" "), "audit my.toml --max-depth 20 --kvp 80");
        assert_eq!(shell_words(&["a b".into(), "it's".into(), "0..9:3".into()]), r"'a b' 'it'\''s' 0..9:3");
    }
}
