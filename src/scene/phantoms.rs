//! Embedded phantoms.
#![allow(missing_docs)]
pub struct Phantom {
    pub name: &'static str,
    pub summary: &'static str,
    pub toml: &'static str,
}
pub fn list() -> &'static [Phantom] {
    &[]
}
pub fn find(name: &str) -> crate::Result<&'static Phantom> {
    Err(crate::Error::input(name, "x", "y"))
}
