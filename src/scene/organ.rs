//! Organs: a proved body, what it is made of, and where it stands among the others.

use crate::exact::Body;
use crate::physics::{Appearance, Material};

use super::shape::Shape;

/// One organ of a scene.
#[derive(Clone, Debug)]
pub struct Organ {
    /// Its name, unique in the scene.
    pub name: String,
    /// Its body, proved closed and not crossing itself; patient LPS, mm.
    pub body: Body,
    /// What it is made of.
    pub material: Material,
    /// Its density, g/cm³.
    pub density_g_cm3: f64,
    /// How it looks in colour images.
    pub appearance: Appearance,
    /// Where its surface came from.
    pub origin: Origin,
    /// The organ it lies directly in, by index.
    pub parent: Option<usize>,
    /// The organs that lie directly in it, by index.
    pub children: Vec<usize>,
    /// How many organs enclose it.
    pub depth: usize,
    /// What was mended on the way, in words.
    pub notices: Vec<String>,
}

/// Where an organ's surface came from.
#[derive(Clone, Debug)]
pub enum Origin {
    /// Equations, tessellated.
    Shapes(Vec<Shape>),
    /// A file, as the scene names it.
    Mesh {
        /// The file.
        file: String,
        /// The groups taken from it; all if empty.
        groups: Vec<String>,
    },
}

impl Organ {
    /// The volume that its body holds, without its children, mm³.
    pub fn own_volume_mm3(&self, organs: &[Self]) -> f64 {
        let children: f64 = self.children.iter().map(|&c| organs[c].body.surface().volume_mm3()).sum();
        self.body.surface().volume_mm3() - children
    }
}
