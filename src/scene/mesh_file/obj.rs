//! Wavefront OBJ: vertices, polygons, and the names of objects and groups.
//!
//! ```text
//! v 0 0 0            vertex 1 (also: r g b after it; a weight must be 1)
//! o liver            everything that follows belongs to the object “liver”
//! g left front       … and to the groups “left” and “front”
//! f 1 2/7 3//4 -1    corners: vertex/texture/normal, counted from 1, or back from the last vertex
//! ```
//!
//! Materials (`mtllib`, `usemtl`), texture coordinates, normals and smoothing say nothing about the surface and
//! are skipped; no file is opened. Lines (`l`), points (`p`) and free-form curves are left out with a notice.
//! Source: Wavefront, *Advanced Visualizer* manual, appendix B1 (object files), version 3.0.

use std::borrow::Cow;

use glam::DVec3;

use super::draft::Draft;
use super::numbered_lines;
use crate::Result;

/// Whether a text without extension looks like OBJ: its first statement is one that such files begin with.
pub(super) fn is_obj(bytes: &[u8]) -> bool {
    statements(bytes)
        .next()
        .is_some_and(|s| ["v", "vt", "vn", "f", "o", "g", "s", "mtllib", "usemtl"].contains(&s.keyword()))
}

/// Reads a whole file into `draft`. Errors name the line.
pub(super) fn read(bytes: &[u8], draft: &mut Draft) -> Result<()> {
    // Vertices first: a face may name a vertex that is defined further down.
    for statement in statements(bytes).filter(|s| s.keyword() == "v") {
        let position = position(&statement, draft)?;
        draft.add_vertex(position, statement.place())?;
    }
    read_faces(bytes, draft)?;
    if draft.has_faces() {
        return Ok(());
    }
    Err(match draft.vertex_count() {
        0 => draft.refuse(
            "there are neither vertices nor faces in it",
            "give an OBJ file with polygons; check that it is an OBJ file at all",
        ),
        _ => draft.refuse("no faces: a point cloud", "make a surface first, or export the faces too"),
    })
}

fn read_faces(bytes: &[u8], draft: &mut Draft) -> Result<()> {
    let mut names = Names::default();
    let mut vertices_above = 0;
    let mut left_out: Option<(usize, usize)> = None;
    let mut corners = Vec::new();
    for statement in statements(bytes) {
        match statement.keyword() {
            "v" => vertices_above += 1,
            "f" => {
                corners.clear();
                for word in statement.words() {
                    corners.push(corner(word, vertices_above, &statement, draft)?);
                }
                draft.add_polygon(&corners, statement.place())?;
            }
            "o" => {
                names.object = statement.rest().to_owned();
                draft.begin_section(names.list());
            }
            "g" => {
                names.groups = statement.rest().to_owned();
                draft.begin_section(names.list());
            }
            "l" | "p" | "curv" | "curv2" | "surf" | "bzp" | "bsp" | "cdc" | "cdp" => {
                let (count, first) = left_out.unwrap_or((0, statement.line));
                left_out = Some((count + 1, first));
            }
            _ => {}
        }
    }
    if let Some((count, first)) = left_out {
        draft.notice(format!("{count} of lines, points or curves were left out, the first at line {first}"));
    }
    Ok(())
}

/// The position in a `v` statement.
fn position(statement: &Statement, draft: &Draft) -> Result<DVec3> {
    let mut numbers = [0.0, 0.0, 0.0, 1.0];
    let words = statement.words();
    let count = words.clone().count();
    // Three coordinates; then nothing, a weight, a colour, or both.
    if ![3, 4, 6, 7].contains(&count) {
        return Err(draft.refuse_at(
            statement.place(),
            format!("the vertex has {count} numbers"),
            "a vertex has three coordinates, perhaps a weight of 1, perhaps three colour values",
        ));
    }
    let has_weight = count == 4 || count == 7;
    for (number, word) in numbers.iter_mut().zip(words.take(if has_weight { 4 } else { 3 })) {
        *number = word.parse().map_err(|_| {
            draft.refuse_at(
                statement.place(),
                format!("“{}” is not a number", shortened(word)),
                "write coordinates as decimal numbers with a point",
            )
        })?;
    }
    let [x, y, z, weight] = numbers;
    if weight != 1.0 {
        return Err(draft.refuse_at(
            statement.place(),
            format!("the vertex has the weight {weight}"),
            "only a weight of 1 has a meaning for polygons: export the mesh without weights",
        ));
    }
    Ok(DVec3::new(x, y, z))
}

/// The vertex that a corner such as `7`, `7/2`, `7//3` or `-1` names, counted from 0.
fn corner(word: &str, vertices_above: usize, statement: &Statement, draft: &Draft) -> Result<u32> {
    let vertex = word.split('/').next().unwrap_or(word);
    let number: i64 = vertex.parse().map_err(|_| {
        draft.refuse_at(
            statement.place(),
            format!("“{}” is not the number of a vertex", shortened(word)),
            "write corners as vertex, vertex/texture or vertex/texture/normal",
        )
    })?;
    let count = draft.vertex_count();
    let index = match number {
        1.. => number as u64 - 1,
        0 => u64::MAX,
        _ => (vertices_above as u64).checked_sub(number.unsigned_abs()).unwrap_or(u64::MAX),
    };
    if index < count as u64 && index <= u64::from(u32::MAX) {
        return Ok(index as u32);
    }
    let (problem, remedy) = match number {
        0 => ("a corner has the vertex number 0".to_owned(), "OBJ counts vertices from 1".to_owned()),
        1.. => (
            format!("a corner is vertex {number}, but there are {count} vertices"),
            "the file is cut short or its numbers are wrong: export it again".to_owned(),
        ),
        _ => (
            format!("a corner is vertex {number}, counted back from {vertices_above} vertices above it"),
            "the file is cut short or its numbers are wrong: export it again".to_owned(),
        ),
    };
    Err(draft.refuse_at(statement.place(), problem, remedy))
}

/// The object and groups that the next faces belong to.
#[derive(Default)]
struct Names {
    object: String,
    groups: String,
}

impl Names {
    /// Every name by which the faces can be chosen: the object's; each group's; and the groups' whole text,
    /// because many programs write one name with spaces where the format means several names.
    fn list(&self) -> Vec<String> {
        let mut names = Vec::new();
        let each = self.groups.split_whitespace();
        for name in [self.object.as_str(), &self.groups].into_iter().chain(each) {
            if !name.is_empty() && !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
        names
    }
}

/// One statement: a line, with the lines that a backslash at its end continues it on.
struct Statement<'a> {
    line: usize,
    text: Cow<'a, str>,
}

impl Statement<'_> {
    fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or("")
    }

    /// What follows the keyword, for names.
    fn rest(&self) -> &str {
        self.text.trim().split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    }

    /// The words after the keyword, up to a comment.
    fn words(&self) -> impl Iterator<Item = &str> + Clone {
        self.text.split_whitespace().skip(1).take_while(|word| !word.starts_with('#'))
    }

    fn place(&self) -> String {
        format!("line {}", self.line)
    }
}

/// All statements of a file; empty lines and comments are none.
fn statements(bytes: &[u8]) -> impl Iterator<Item = Statement<'_>> {
    let mut lines = numbered_lines(bytes);
    std::iter::from_fn(move || {
        loop {
            let (line, mut text) = lines.next()?;
            if text.trim_start().starts_with('#') || text.trim().is_empty() {
                continue;
            }
            while let Some(start) = text.trim_end().strip_suffix('\\') {
                let (_, next) = lines.next().unwrap_or_default();
                text = Cow::Owned(format!("{start} {next}"));
            }
            return Some(Statement { line, text });
        }
    })
}

/// A word of the file, short enough for a message.
fn shortened(word: &str) -> String {
    const LONGEST: usize = 32;
    match word.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_owned(),
    }
}
