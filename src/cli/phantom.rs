//! `chordfield phantom`.

use std::io::Write;

use super::args::PhantomCommand;
use super::{Session, print};
use crate::error::Result;
use crate::modes::Control;
use crate::output::phantom::export;
use crate::scene::{Scene, phantoms};

/// Lists, shows or exports the phantoms that come with the program.
pub fn run(command: &PhantomCommand, session: &Session, out: &mut dyn Write) -> Result<()> {
    match command {
        PhantomCommand::List => {
            let phantoms = phantoms::list();
            let width = phantoms.iter().map(|p| p.name.len()).max().unwrap_or(0);
            let lines: String =
                phantoms.iter().map(|p| format!("{:width$}  {}\n", p.name, p.summary)).collect();
            print(out, &lines)
        }
        PhantomCommand::Show { name } => print(out, phantoms::find(name)?.toml),
        PhantomCommand::Export { name, folder } => {
            let phantom = phantoms::find(name)?;
            let scene = Scene::phantom(name)?;
            session.begin_writing();
            let file = export(&scene, phantom.toml, folder, &Control::new(session.cancel(), &|_| {}))?;
            session.remark(&format!("wrote {} and {} meshes beside it", file.display(), scene.organs.len()));
            Ok(())
        }
    }
}
