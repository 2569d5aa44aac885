//! Scenes: what a user describes, validated before anything is computed from it.

pub mod mesh_file;
