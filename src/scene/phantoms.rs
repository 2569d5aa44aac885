//! Embedded phantoms.
