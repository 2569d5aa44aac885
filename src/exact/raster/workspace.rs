//! What tracers write to: kept from tile to tile.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::aspect::Aspect;
use super::chords::Depths;
use super::edge_on::EdgeOn;
use super::face::Slope;
use super::rows::Rows;
use super::small::SmallFaces;
use super::stretches::Stretches;

/// What a tracer writes to. It may serve another afterwards.
#[derive(Default)]
pub struct Workspace {
    pub block: Block,
    pub aspect: Aspect,
    pub rows: Rows,
    pub stretches: Stretches,
    pub small: SmallFaces,
    /// Patches near a row of blocks, and near a block.
    pub near: [Vec<u32>; 2],
}

/// Workspaces that no tracer uses: to make them anew for each tile would take as long as a part of the tile.
#[derive(Default)]
pub struct Workspaces(Mutex<Vec<Box<Workspace>>>);

impl Workspaces {
    pub fn take(&self) -> Box<Workspace> {
        self.lock().pop().unwrap_or_default()
    }

    pub fn give_back(&self, workspace: Box<Workspace>) {
        self.lock().push(workspace);
    }

    /// Lists are whole whatever happens to those who hold the lock.
    fn lock(&self) -> MutexGuard<'_, Vec<Box<Workspace>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Clone for Workspaces {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl std::fmt::Debug for Workspaces {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Workspaces").field(&self.lock().len()).finish()
    }
}

/// What is known of a block. Empty between blocks.
#[derive(Default)]
pub struct Block {
    /// Of the rays, mm.
    pub lengths: Vec<f64>,
    pub faces: Vec<Face>,
    /// The first `span_count` are in use.
    pub spans: Vec<Span>,
    pub span_count: usize,
    /// Rays to be traced by themselves.
    pub edge_on: Vec<EdgeOn>,
    pub depths: Depths,
}

/// A face whose spans are listed.
pub struct Face {
    pub slope: Slope,
    pub number: u32,
}

/// The pixels of a row that a face covers, each end reckoned in the block's columns.
#[derive(Clone, Copy, Default)]
pub struct Span {
    pub face: u32,
    pub row: i32,
    pub start: i16,
    pub end: i16,
    pub is_out: bool,
}

impl Block {
    /// What faces cover.
    #[inline(always)]
    pub fn spans(&self) -> &[Span] {
        &self.spans[..self.span_count]
    }
}
