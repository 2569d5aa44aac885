//! Which organ lies in which: found from geometry, checked against what the scene says.

use rayon::prelude::*;

use super::organ::Organ;
use super::text::{SceneText, Step};
use crate::error::Error;
use crate::geometry::{Place, Relation, relation};

/// Gives each organ its parent, children and depth.
///
/// # Errors
/// Each pair of organs that cross, with both names, a place and the depth; each `inside` that geometry contradicts.
pub fn arrange(organs: &mut [Organ], said: &[Option<String>], text: &SceneText) -> Result<(), Vec<Error>> {
    let pairs: Vec<(usize, usize)> =
        (0..organs.len()).flat_map(|i| (i + 1..organs.len()).map(move |j| (i, j))).collect();
    let relations: Vec<Relation> = pairs
        .par_iter()
        .map(|&(i, j)| relation(organs[i].body.surface(), organs[j].body.surface()))
        .collect();

    let mut errors = Vec::new();
    let mut enclosing: Vec<Vec<usize>> = vec![Vec::new(); organs.len()];
    for (&(i, j), relation) in pairs.iter().zip(&relations) {
        match *relation {
            Relation::Disjoint => {}
            Relation::Inside => enclosing[i].push(j),
            Relation::Around => enclosing[j].push(i),
            Relation::Crossing { place, depth_mm } => errors.push(text.error(
                &[Step::Key("organ"), Step::Index(j), Step::Key("name")],
                format!(
                    "organs `{}` and `{}` cross: they share volume near {}, {depth_mm:.3} mm deep",
                    organs[i].name,
                    organs[j].name,
                    Place(place)
                ),
                format!("crosses `{}`", organs[i].name),
                "move or cut one of them, nest one wholly in the other, or take one out of the scene",
            )),
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    for (i, around) in enclosing.iter().enumerate() {
        let volume = |o: usize| organs[o].body.surface().volume_mm3();
        let parent = around.iter().copied().min_by(|&a, &b| volume(a).total_cmp(&volume(b)));
        organs[i].depth = around.len();
        organs[i].parent = parent;
        if let Some(parent) = parent {
            organs[parent].children.push(i);
        }
    }
    let errors: Vec<Error> =
        (0..organs.len()).filter_map(|i| contradiction(organs, i, said[i].as_deref()?, text)).collect();
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// The error of an `inside` that is not so.
fn contradiction(organs: &[Organ], organ: usize, said: &str, text: &SceneText) -> Option<Error> {
    let parent = organs[organ].parent.map(|p| organs[p].name.as_str());
    if parent == Some(said) {
        return None;
    }
    let name = &organs[organ].name;
    let (message, remedy) = match parent {
        _ if !organs.iter().any(|o| o.name == said) => (
            format!("organ `{name}` is said to lie inside `{said}`, which is no organ of this scene"),
            "check the name",
        ),
        Some(parent) => (
            format!("organ `{name}` lies directly inside `{parent}`, not `{said}`"),
            "correct `inside`, or move the organ",
        ),
        None => (
            format!("organ `{name}` does not lie inside `{said}`"),
            "correct or drop `inside`, or move the organ",
        ),
    };
    let path = [Step::Key("organ"), Step::Index(organ), Step::Key("inside")];
    Some(text.error(&path, message, "not so", remedy))
}
