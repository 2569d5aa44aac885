//! Trees as rows of records, to be kept from one run to the next.
//!
//! ```text
//!   root: split ── half: split ── half: final, its samples          a record for each cell, in the order of a walk from the
//!               │              └─ half: unknown                    root; what is below a cell follows it
//!               └─ half: final, …
//! ```
//!
//! What becomes of a cell is a function of the cell, so a tree that was read answers as one that was grown. Whoever reads
//! believes nothing: cells are as deep as cells can be, numbers are numbers, and every so many leaves are made anew and held
//! against what was read.

use std::io::{self, Read, Write};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::cell::{Kind, Place};
use super::interpolant::Samples;
use super::look::Look;
use super::node::{self, Leaf, Node};
use super::{Attribute, Cache, RiTree};
use crate::linespace::PlanePair;

/// Of so many leaves read, one is made anew: a thousandth of what growing the tree would take.
pub(super) const CHECKED_OF: u64 = 1000;

/// An attribute whose trees can be kept.
pub trait Keepable: Attribute<Output: Serialize + DeserializeOwned + PartialEq> {
    /// Whether the numbers of an output are such as a sample may have: finite, and so small that no sum of them overflows.
    fn is_sound(&self, output: &Self::Output) -> bool;
}

/// Why trees cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum Unreadable {
    /// The system refused.
    #[error("it cannot be read")]
    Io(#[from] io::Error),
    /// They are not such trees as are asked for.
    #[error("{problem}")]
    Refused {
        /// What is wrong with them.
        problem: String,
        /// What the user can do about it.
        remedy: String,
    },
}

impl Unreadable {
    /// Contents that no run has written.
    pub fn damaged(problem: &str) -> Self {
        Self::Refused {
            problem: format!("is damaged: {problem}"),
            remedy: "make it anew with --save-trees".into(),
        }
    }
}

/// What was read of trees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Loaded {
    /// Leaves taken over.
    pub loaded_leaves: u64,
    /// Leaves left out, because the cache has no room for them or their organs are not put in trees.
    pub left_out_leaves: u64,
}

impl std::ops::AddAssign for Loaded {
    fn add_assign(&mut self, other: Self) {
        self.loaded_leaves += other.loaded_leaves;
        self.left_out_leaves += other.left_out_leaves;
    }
}

impl Loaded {
    /// Counts a leaf; whether it is one of those to be made anew.
    pub(super) fn count(&mut self, is_kept: bool) -> bool {
        let nth = self.loaded_leaves + self.left_out_leaves;
        *(if is_kept { &mut self.loaded_leaves } else { &mut self.left_out_leaves }) += 1;
        nth.is_multiple_of(CHECKED_OF)
    }
}

/// Writes records one after the other, each with its length before it.
pub struct RecordWriter<'w> {
    out: &'w mut dyn Write,
    buffer: Vec<u8>,
}

impl<'w> RecordWriter<'w> {
    /// A writer of records to `out`.
    pub fn new(out: &'w mut dyn Write) -> Self {
        Self { out, buffer: Vec::new() }
    }

    /// Writes one.
    ///
    /// # Errors
    /// What `out` says; a record of more than 65 535 bytes.
    pub fn put(&mut self, record: &impl Serialize) -> io::Result<()> {
        self.buffer.clear();
        let buffer = std::mem::take(&mut self.buffer);
        self.buffer = postcard::to_extend(record, buffer).map_err(io::Error::other)?;
        let length = u16::try_from(self.buffer.len()).map_err(io::Error::other)?;
        self.out.write_all(&length.to_le_bytes())?;
        self.out.write_all(&self.buffer)
    }
}

/// Reads what [`RecordWriter`] wrote, or refuses it.
pub struct RecordReader<'r> {
    source: &'r mut dyn Read,
    buffer: Vec<u8>,
}

impl<'r> RecordReader<'r> {
    /// A reader of records from `source`.
    pub fn new(source: &'r mut dyn Read) -> Self {
        Self { source, buffer: Vec::new() }
    }

    /// Reads one. No more memory is taken than its length says, 65 535 bytes at most.
    ///
    /// # Errors
    /// If there is none, or it is none of that kind.
    pub fn take<T: DeserializeOwned>(&mut self) -> Result<T, Unreadable> {
        let mut length = [0; 2];
        self.fill(&mut length)?;
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.resize(u16::from_le_bytes(length).into(), 0);
        self.fill(&mut buffer)?;
        let record = match postcard::take_from_bytes(&buffer) {
            Ok((record, [])) => Ok(record),
            _ => Err(Unreadable::damaged("a record of a cell is none")),
        };
        self.buffer = buffer;
        record
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), Unreadable> {
        self.source.read_exact(bytes).map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => Unreadable::damaged("it ends before its last record"),
            _ => e.into(),
        })
    }

    /// Makes sure that there is no more.
    ///
    /// # Errors
    /// If there is.
    pub fn end(self) -> Result<(), Unreadable> {
        match self.source.read(&mut [0])? {
            0 => Ok(()),
            _ => Err(Unreadable::damaged("something follows its last record")),
        }
    }
}

/// What is known of a cell. The order of these is part of the format.
#[derive(Serialize, Deserialize)]
enum Record<C> {
    Unknown,
    Split,
    Final(Kind<C>),
}

impl<A: Keepable> RiTree<A> {
    /// Writes what is known of all cells; corners that wait for their cell to be looked at are not kept.
    ///
    /// # Errors
    /// What `out` says.
    pub fn save(&self, out: &mut RecordWriter) -> io::Result<()> {
        fn save<T: Clone + Send + Sync + Serialize>(
            node: Option<&Node<T>>,
            out: &mut RecordWriter,
        ) -> io::Result<()> {
            if let Some(leaf) = node.and_then(Node::leaf) {
                return out.put(&Record::Final(leaf.kind()));
            }
            let Some(halves) = node.and_then(Node::halves) else {
                return out.put(&Record::<&Samples<T>>::Unknown);
            };
            out.put(&Record::<&Samples<T>>::Split)?;
            halves.iter().try_for_each(|half| save(Some(half), out))
        }
        self.roots.iter().try_for_each(|root| save(root.get().map(|node| &**node), out))
    }

    /// Takes over what [`save`](Self::save) wrote, as far as `cache` has room. For a tree that has seen no line yet.
    ///
    /// # Errors
    /// If it is no such tree of this attribute and these parameters. Then the tree is to be thrown away.
    pub fn load(&mut self, from: &mut RecordReader, cache: &Cache) -> Result<Loaded, Unreadable> {
        let mut loaded = Loaded::default();
        for (pair, root) in PlanePair::ALL.into_iter().zip(&self.roots) {
            let bytes = node::bytes::<A::Output>(1);
            let node = cache.reserve(bytes).then(Box::default);
            self.load_cell(node.as_deref(), &Place::root(pair), from, cache, &mut loaded)?;
            if let Some(node) = node
                && root.set(node).is_err()
            {
                cache.release(bytes);
            }
        }
        Ok(loaded)
    }

    /// `node` is `None` where nothing is kept.
    fn load_cell(
        &self,
        node: Option<&Node<A::Output>>,
        place: &Place,
        from: &mut RecordReader,
        cache: &Cache,
        loaded: &mut Loaded,
    ) -> Result<(), Unreadable> {
        match from.take::<Record<Box<Samples<A::Output>>>>()? {
            Record::Unknown => Ok(()),
            Record::Split => {
                if place.is_deepest(&self.parameters) {
                    return Err(Unreadable::damaged("a cell of the greatest depth is split"));
                }
                let node = node.filter(|_| cache.reserve(node::bytes::<A::Output>(2)));
                let halves = node.and_then(Node::split_unseen);
                (0..2).try_for_each(|side| {
                    let half = halves.map(|halves| &halves[side]);
                    self.load_cell(half, &place.half(side), from, cache, loaded)
                })
            }
            Record::Final(kind) => {
                let is_sound =
                    |samples: &Samples<_>| samples.all().all(|output| self.attribute.is_sound(output));
                if kind.samples().is_some_and(|samples| !is_sound(samples)) {
                    return Err(Unreadable::damaged("a sample is not finite"));
                }
                let node = node.filter(|_| cache.reserve(node::leaf_bytes(&kind)));
                if loaded.count(node.is_some()) {
                    // A look at what was read is none of what growing the tree takes.
                    let anew = place.look(&self.attribute, &self.parameters, None, |_| ());
                    if anew != Look::Final(kind.clone()) {
                        return Err(Unreadable::damaged("a cell is not what this program makes of it"));
                    }
                }
                if let Some(node) = node {
                    node.finish(Leaf::new(kind, 1));
                }
                Ok(())
            }
        }
    }
}
