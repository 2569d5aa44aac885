//! A promise about memory, shared by all trees of a run.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{PoisonError, RwLock};

/// Counts the bytes of nodes and samples, and refuses what would exceed the limit.
#[derive(Debug)]
pub struct Cache {
    limit_bytes: usize,
    used_bytes: AtomicUsize,
    was_refused: std::sync::atomic::AtomicBool,
}

impl Cache {
    /// A cache that never holds more than `limit_bytes`.
    pub fn new(limit_bytes: usize) -> Self {
        Self { limit_bytes, used_bytes: AtomicUsize::new(0), was_refused: Default::default() }
    }

    /// The most it may hold.
    pub fn limit_bytes(&self) -> usize {
        self.limit_bytes
    }

    /// What it holds.
    pub fn used_bytes(&self) -> usize {
        self.used_bytes.load(Ordering::Relaxed)
    }

    /// Whether something was refused since the last call to [`relieved`](Self::relieved): time to prune.
    pub fn is_full(&self) -> bool {
        self.was_refused.load(Ordering::Relaxed)
    }

    /// Says that room was made, or that none can be.
    pub fn relieved(&self) {
        self.was_refused.store(false, Ordering::Relaxed);
    }

    /// Takes room for `bytes`. `false`, and nothing taken, if there is not enough.
    pub fn reserve(&self, bytes: usize) -> bool {
        let fits = |used: usize| used.checked_add(bytes).filter(|&total| total <= self.limit_bytes);
        let taken = self.used_bytes.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits).is_ok();
        if !taken {
            self.was_refused.store(true, Ordering::Relaxed);
        }
        taken
    }

    /// Gives room back.
    pub fn release(&self, bytes: usize) {
        self.used_bytes.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Makes room if something was refused: what was used last among all trees under this cache is kept up to
    /// `kept_share` of the limit, the rest is forgotten. `collect` adds the trees' stamps, see
    /// [`RiTree::collect_stamps`](super::RiTree::collect_stamps), `prune` forgets what is older than the stamp it is given.
    pub fn prune_if_full<T>(
        &self,
        trees: &RwLock<T>,
        kept_share: f64,
        collect: impl FnOnce(&T, &mut Vec<(u32, usize)>),
        prune: impl FnOnce(&mut T, u32),
    ) {
        if !self.is_full() {
            return;
        }
        let mut trees = trees.write().unwrap_or_else(PoisonError::into_inner);
        if !self.is_full() {
            // Another thread was first.
            return;
        }
        let mut stamps = Vec::new();
        collect(&trees, &mut stamps);
        prune(&mut trees, oldest_to_keep(stamps, (kept_share * self.limit_bytes as f64) as usize));
        self.relieved();
    }
}

/// The oldest stamp to keep so that what is stamped from it on holds no more than `bytes`: least recently used go first.
pub fn oldest_to_keep(mut stamps: Vec<(u32, usize)>, bytes: usize) -> u32 {
    stamps.sort_unstable_by_key(|&(stamp, _)| std::cmp::Reverse(stamp));
    let mut kept = 0;
    let mut oldest = u32::MAX;
    for same_time in stamps.chunk_by(|a, b| a.0 == b.0) {
        kept += same_time.iter().map(|s| s.1).sum::<usize>();
        if kept > bytes {
            break;
        }
        oldest = same_time[0].0;
    }
    oldest
}
