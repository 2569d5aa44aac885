//! Fitted trees as rows of records, see [`kept`](crate::ritree::kept).

use std::io;
use std::sync::atomic::AtomicU32;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{Fit, FittedTree, Node, STEP_BITS, Stamped, State};
use crate::linespace::PlanePair;
use crate::ritree::kept::{Loaded, RecordReader, RecordWriter, Unreadable};
use crate::ritree::{Cache, Place};

/// A fit whose trees can be kept.
pub trait KeepableFit: Fit<Leaf: Serialize + DeserializeOwned + PartialEq> {
    /// Whether a leaf may be that of its cell: what it holds of the cell is the cell's, and its numbers are finite and so
    /// small that no sum of them overflows.
    fn is_sound(&self, leaf: &Self::Leaf, place: &Place) -> bool;
}

/// What is known of a cell. The order of these is part of the format.
#[derive(Serialize, Deserialize)]
enum Record<L> {
    Unknown,
    /// A bit for each part of which something is known; those follow.
    Split(u16),
    Final(L),
}

impl<F: KeepableFit> FittedTree<F> {
    /// Writes what is known of all cells.
    ///
    /// # Errors
    /// What `out` says.
    pub fn save(&self, out: &mut RecordWriter) -> io::Result<()> {
        self.roots.iter().try_for_each(|root| root.save(out))
    }

    /// Takes over what [`save`](Self::save) wrote, as far as `cache` has room. For a tree that has seen no line yet.
    ///
    /// # Errors
    /// If it is no such tree of this fit. Then the tree is to be thrown away.
    pub fn load(&mut self, from: &mut RecordReader, cache: &Cache) -> Result<Loaded, Unreadable> {
        let mut loaded = Loaded::default();
        for (axis, root) in self.roots.iter().enumerate() {
            let place = Place::root(PlanePair::ALL[2 * axis]);
            self.load_cell(Some(root), &place, from, cache, &mut loaded)?;
        }
        Ok(loaded)
    }

    /// `node` is `None` where nothing is kept.
    fn load_cell(
        &self,
        node: Option<&Node<F::Leaf>>,
        place: &Place,
        from: &mut RecordReader,
        cache: &Cache,
        loaded: &mut Loaded,
    ) -> Result<(), Unreadable> {
        match from.take::<Record<F::Leaf>>()? {
            Record::Unknown => Ok(()),
            Record::Split(known) => {
                if place.level() + 1 >= STEP_BITS {
                    return Err(Unreadable::damaged("a cell as small as steps are is split"));
                }
                let node = node.filter(|_| cache.reserve(Self::parts_bytes()));
                let state = node.map(|node| node.state.get_or_init(|| State::Split(Box::default())));
                let parts = match state {
                    Some(State::Split(parts)) => Some(parts),
                    _ => None,
                };
                (0..16).filter(|bits| known >> bits & 1 == 1).try_for_each(|bits| {
                    let part = parts.map(|parts| &parts[bits]);
                    self.load_cell(part, &place.part(bits), from, cache, loaded)
                })
            }
            Record::Final(leaf) => {
                if place.level() < self.fit.first_level() || !self.fit.is_sound(&leaf, place) {
                    return Err(Unreadable::damaged("a leaf is not one of its cell"));
                }
                let node = node.filter(|_| cache.reserve(self.leaf_bytes(&leaf)));
                if loaded.count(node.is_some()) && self.fit.fit(place).leaf.as_ref() != Some(&leaf) {
                    return Err(Unreadable::damaged("a leaf is not what this program makes of its cell"));
                }
                if let Some(node) = node {
                    let stamp = AtomicU32::new(1);
                    node.state.get_or_init(|| State::Final(Box::new(Stamped { leaf, stamp })));
                }
                Ok(())
            }
        }
    }
}

impl<L: Serialize> Node<L> {
    fn save(&self, out: &mut RecordWriter) -> io::Result<()> {
        match self.state.get() {
            None => out.put(&Record::<&L>::Unknown),
            Some(State::Final(stamped)) => out.put(&Record::Final(&stamped.leaf)),
            Some(State::Split(parts)) => {
                let is_known = |part: &Self| part.state.get().is_some();
                let known = (0..16).filter(|&bits| is_known(&parts[bits])).map(|bits| 1 << bits).sum();
                out.put(&Record::<&L>::Split(known))?;
                parts.iter().filter(|part| is_known(part)).try_for_each(|part| part.save(out))
            }
        }
    }
}
