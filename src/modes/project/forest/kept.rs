//! Trees of a run, kept for a later one: a file that says what it belongs to.
//!
//! | bytes | hold |
//! |---|---|
//! | 16 | `chordfield trees` |
//! | 4 | the format's version, the lowest byte first, as in all numbers here |
//! | 8 | the length of what follows, but for the checksum |
//! | … | a record of what the trees depend on: the program, the bodies' hash, what is interpolated and how well |
//! | … | for each scene, for each organ in a tree: its number, then its cells' records, see [`ritree::kept`](crate::ritree::kept); then an end |
//! | 32 | SHA-256 of all before |
//!
//! Nothing is believed: length and checksum are looked at before the contents, and contents as if there were no checksum.
//! Trees are put in place when all of the file is read, or not at all.

use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::sync::{OnceLock, PoisonError};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{Forest, Interpolation, OrganTree, either};
use crate::exact::Body;
use crate::ritree::kept::{RecordReader, RecordWriter};
use crate::ritree::{Cache, Loaded, Parameters, Unreadable};

/// How files of trees begin.
pub const TREES_BEGIN: [u8; 16] = *b"chordfield trees";

/// To be raised with every change of the format, and of what becomes of a cell.
const VERSION: u32 = 5;

/// Bytes before the first record: magic, version and length.
const HEAD: u64 = 28;

/// Bytes of the checksum.
const TAIL: u64 = 32;

/// Where trees are read from.
pub trait Source: Read + Seek {}

impl<T: Read + Seek> Source for T {}

/// Whoever has trees that can be kept from one run to the next.
pub trait KeepsTrees {
    /// Writes all trees, as far as they are grown.
    ///
    /// # Errors
    /// What `out` says.
    fn save_trees(&self, out: &mut dyn Write) -> io::Result<()>;

    /// Takes over trees that [`save_trees`](Self::save_trees) wrote, in place of those that there are: as many of their leaves as the
    /// cache has room for. Lengths are the same bits with them and without.
    ///
    /// # Errors
    /// If they are not whole, not of this version, or were grown for other bodies or by other settings. Then nothing changes.
    fn load_trees(&mut self, source: &mut dyn Source) -> Result<Loaded, Unreadable>;
}

/// What trees depend on.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Origin {
    /// The program's version.
    program: String,
    /// Of the vertices and faces of all bodies.
    geometry: [u8; 32],
    model: Model,
}

/// What is interpolated, and how well.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Model {
    Quadrilinear(Parameters),
    SquaredChord { tolerance_mm: f64, with_places: bool },
}

/// What follows among the trees of a scene.
#[derive(Serialize, Deserialize)]
enum Next {
    Organ(u32),
    End,
}

impl Model {
    fn of(forest: &Forest) -> Self {
        match forest.settings.interpolation {
            Interpolation::Quadrilinear { parameters } => Self::Quadrilinear(parameters),
            Interpolation::SquaredChord { tolerance_mm } => {
                Self::SquaredChord { tolerance_mm, with_places: forest.wants_places }
            }
        }
    }

    /// The options that ask for it.
    fn options(&self) -> String {
        match self {
            Self::Quadrilinear(Parameters { distance_threshold, angular_threshold_deg, max_depth }) => {
                format!(
                    "--interpolation quadrilinear --distance-threshold {distance_threshold} --angular-threshold-deg \
                 {angular_threshold_deg} --max-depth {max_depth}"
                )
            }
            Self::SquaredChord { tolerance_mm, with_places } => {
                let places = if *with_places { "with" } else { "without" };
                format!(
                    "--tolerance {tolerance_mm}mm, {places} the places of chords (they are for colour and for dose paths)"
                )
            }
        }
    }
}

impl Origin {
    fn of(forests: &[&Forest]) -> Option<Self> {
        Some(Self {
            program: env!("CARGO_PKG_VERSION").into(),
            geometry: hash(forests.iter().flat_map(|forest| &forest.bodies)),
            model: Model::of(forests.first()?),
        })
    }

    /// That trees of this origin serve a run that asks for those of `wanted`.
    fn serves(&self, wanted: &Self) -> Result<(), Unreadable> {
        let refuse =
            |problem: String, remedy: &str| Err(Unreadable::Refused { problem, remedy: remedy.into() });
        if self.program != wanted.program {
            let problem =
                format!("was made by version {} of the program; this is {}", self.program, wanted.program);
            return refuse(problem, "make it anew with --save-trees");
        }
        if self.geometry != wanted.geometry {
            let remedy = "give it with the scene that it was made of, or make it anew with --save-trees";
            return refuse("holds trees of other bodies than the scene's".into(), remedy);
        }
        if self.model != wanted.model {
            let problem = format!(
                "holds trees of {}; this run asks for {}",
                self.model.options(),
                wanted.model.options()
            );
            return refuse(problem, "ask for the same, or make it anew with --save-trees");
        }
        Ok(())
    }
}

/// Of where bodies are and which corners their faces join.
fn hash<'b>(bodies: impl Iterator<Item = &'b &'b Body>) -> [u8; 32] {
    let mut hash = Sha256::new();
    for body in bodies {
        let mesh = body.surface().mesh();
        hash.update((mesh.vertices.len() as u64).to_le_bytes());
        hash.update((mesh.faces.len() as u64).to_le_bytes());
        for vertex in &mesh.vertices {
            vertex.to_array().iter().for_each(|x| hash.update(x.to_le_bytes()));
        }
        for face in &mesh.faces {
            face.iter().for_each(|&corner| hash.update(u64::from(corner).to_le_bytes()));
        }
    }
    hash.finalize().into()
}

/// Writes the trees of the scenes of a run, see [`KeepsTrees::save_trees`].
pub fn save(forests: &[&Forest], out: &mut dyn Write) -> io::Result<()> {
    let Some(origin) = Origin::of(forests) else {
        return Err(io::Error::other("the method makes no trees: give --method ritree"));
    };
    let write_records = |out: &mut dyn Write| -> io::Result<()> {
        let mut records = RecordWriter::new(out);
        records.put(&origin)?;
        forests.iter().try_for_each(|forest| forest.save(&mut records))
    };
    let mut length = Tee { out: &mut io::sink(), hash: Sha256::new(), bytes: 0 };
    write_records(&mut length)?;
    let bytes = length.bytes;
    let mut tee = Tee { out, hash: Sha256::new(), bytes: 0 };
    tee.write_all(&TREES_BEGIN)?;
    tee.write_all(&VERSION.to_le_bytes())?;
    tee.write_all(&bytes.to_le_bytes())?;
    write_records(&mut tee)?;
    let Tee { out, hash, .. } = tee;
    out.write_all(&hash.finalize())
}

/// Reads the trees of the scenes of a run, see [`KeepsTrees::load_trees`].
pub fn load(forests: &mut [&mut Forest], source: &mut dyn Source) -> Result<Loaded, Unreadable> {
    let wanted = {
        let forests: Vec<&Forest> = forests.iter().map(|forest| &**forest).collect();
        Origin::of(&forests)
    };
    let Some(wanted) = wanted else {
        return Err(Unreadable::Refused {
            problem: "holds trees, and the method makes none".into(),
            remedy: "give --method ritree".into(),
        });
    };
    let length = whole(source)?;
    source.seek(SeekFrom::Start(HEAD))?;
    let mut contents = BufReader::with_capacity(1 << 16, source.take(length));
    let mut records = RecordReader::new(&mut contents);
    records.take::<Origin>()?.serves(&wanted)?;
    let read: Vec<SceneTrees> =
        forests.iter().map(|forest| forest.load(&mut records)).collect::<Result<_, _>>()?;
    records.end()?;
    let mut all = Loaded::default();
    for (forest, (trees, cache, loaded)) in forests.iter_mut().zip(read) {
        all += loaded;
        *forest.trees.get_mut().unwrap_or_else(PoisonError::into_inner) = trees;
        (forest.cache, forest.loaded) = (cache, Some(loaded));
    }
    Ok(all)
}

/// The length of a file's records, once it is known to be whole.
fn whole(source: &mut dyn Source) -> Result<u64, Unreadable> {
    let refuse = |problem: String| {
        Err(Unreadable::Refused { problem, remedy: "give a file that --save-trees has written".into() })
    };
    let file_bytes = source.seek(SeekFrom::End(0))?;
    source.rewind()?;
    let mut head = [0; HEAD as usize];
    if file_bytes < HEAD + TAIL {
        return refuse("is too short to hold trees".into());
    }
    source.read_exact(&mut head)?;
    let (magic, numbers) = head.split_at(TREES_BEGIN.len());
    let (version, length) = numbers.split_at(4);
    if magic != TREES_BEGIN {
        return refuse("is not a file of trees".into());
    }
    if version != VERSION.to_le_bytes() {
        let version = version.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte));
        return refuse(format!("is of version {version} of the format; this program reads {VERSION}"));
    }
    let length = length.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte));
    if length != file_bytes - HEAD - TAIL {
        return refuse(format!(
            "says that it is {} bytes long, and is {file_bytes}",
            length.saturating_add(HEAD + TAIL)
        ));
    }
    let mut hash = Sha256::new();
    hash.update(head);
    let mut left = source.take(length);
    let mut buffer = vec![0; 1 << 16];
    loop {
        match left.read(&mut buffer)? {
            0 => break,
            bytes => hash.update(&buffer[..bytes]),
        }
    }
    let mut checksum = [0; TAIL as usize];
    source.read_exact(&mut checksum)?;
    if hash.finalize()[..] != checksum {
        return Err(Unreadable::damaged("its checksum is not that of its contents"));
    }
    Ok(length)
}

/// What was read of one scene's trees.
type SceneTrees<'a> = (Vec<OnceLock<OrganTree<'a>>>, Cache, Loaded);

impl<'a> Forest<'a> {
    fn save(&self, out: &mut RecordWriter) -> io::Result<()> {
        let grove = self.enter();
        for (organ, tree) in (0..).zip(&*grove.trees) {
            let Some(tree) = tree.get() else { continue };
            out.put(&Next::Organ(organ))?;
            either!(tree, tree => tree.save(out))?;
        }
        out.put(&Next::End)
    }

    fn load(&self, from: &mut RecordReader) -> Result<SceneTrees<'a>, Unreadable> {
        let trees: Vec<OnceLock<OrganTree>> = self.bodies.iter().map(|_| OnceLock::new()).collect();
        let (cache, nowhere) = (Cache::new(self.settings.cache_bytes), Cache::new(0));
        let mut loaded = Loaded::default();
        let mut next = 0;
        while let Next::Organ(organ) = from.take()? {
            let organ = organ as usize;
            if organ < next || organ >= self.bodies.len() {
                return Err(Unreadable::damaged("it names an organ that is not there, or one twice"));
            }
            next = organ + 1;
            let Some(mut tree) = self.new_tree(organ) else {
                return Err(Unreadable::damaged("it has a tree of an organ that grows none"));
            };
            // What this run finds exactly is read all the same, to be left out.
            let grows = self.grows(organ);
            let cache = if grows { &cache } else { &nowhere };
            loaded += either!(&mut tree, tree => tree.load(from, cache))?;
            if grows {
                let _ = trees[organ].set(tree);
            }
        }
        // What had no room is no reason to forget what had.
        cache.relieved();
        Ok((trees, cache, loaded))
    }
}

/// Hashes and counts what it passes on.
struct Tee<'w> {
    out: &'w mut dyn Write,
    hash: Sha256,
    bytes: u64,
}

impl Write for Tee<'_> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.out.write(buffer)?;
        self.hash.update(&buffer[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests;
