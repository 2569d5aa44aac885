//! `--load-trees` and `--save-trees`.

use super::Session;
use super::args::KeepArgs;
use crate::error::{Error, Result};
use crate::modes::project::{KeepsTrees, Method, TreeSettings};
use crate::output::trees;

/// The method, if trees can be kept by it: who names a file of trees asks for trees, so that there is nothing left to choose.
///
/// # Errors
/// One that makes none; a file that trees may not replace, before any work is done.
pub fn method(args: &KeepArgs, method: Method) -> Result<Method> {
    args.save_trees.as_deref().map_or(Ok(()), trees::check_target)?;
    let asked = [("--load-trees", &args.load_trees), ("--save-trees", &args.save_trees)];
    let asked = asked.into_iter().find_map(|(name, file)| file.is_some().then_some(name));
    match (asked, method) {
        (Some(name), Method::Exact(_)) => {
            let problem = format!("--method {} makes no trees", method.name());
            Err(Error::input(name, problem, "give --method ritree"))
        }
        (Some(_), Method::Auto(trees)) => Ok(Method::RiTree(TreeSettings { demand: None, ..trees })),
        _ => Ok(method),
    }
}

/// Starts with the trees of a file, if one is named.
///
/// # Errors
/// See [`trees::load`].
pub fn load(args: &KeepArgs, into: &mut impl KeepsTrees, session: &Session) -> Result<()> {
    let Some(path) = &args.load_trees else { return Ok(()) };
    let loaded = trees::load(path, into)?;
    let left_out = match loaded.left_out_leaves {
        0 => String::new(),
        leaves => format!(
            "; {leaves} left out, which --cache-mb has no room for or whose organs are not put in trees"
        ),
    };
    session.remark(&format!("{} leaves from {}{left_out}", loaded.loaded_leaves, path.display()));
    Ok(())
}

/// Keeps the trees in a file, if one is named.
///
/// # Errors
/// See [`trees::save`].
pub fn save(args: &KeepArgs, from: &impl KeepsTrees, session: &Session) -> Result<()> {
    let Some(path) = &args.save_trees else { return Ok(()) };
    let bytes = trees::save(path, from)?;
    session.remark(&format!("trees in {}, {:.1} MB", path.display(), bytes as f64 / 1e6));
    Ok(())
}
