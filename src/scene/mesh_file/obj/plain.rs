//! An OBJ file reduced to what `tobj` can read without doubt, every statement checked and its line known.
//!
//! ```text
//! mtllib body.mtl                    v 0 0 0
//! v 0 0 0 0.5 0.5 0.5                v 1 0 0
//! v 1 0 0                            v 0 1 0
//! g left front                 ─►    f 3 1 2
//! f -1/7//2 \                        (line 5: the face; from face 0 on: “left front”, “left”, “front”)
//!   1 2
//! v 0 1 0
//! ```

use std::borrow::Cow;
use std::fmt::Write;
use std::rc::Rc;

use glam::DVec3;

use super::super::draft::{Draft, NameList};
use super::super::numbered_lines;
use crate::Result;

/// Names longer than this are refused: no person wrote them, and lists of them could not be shown.
const LONGEST_NAME_BYTES: usize = 1024;

/// The geometry of a file, checked.
pub(super) struct Plain {
    /// All `v` with three coordinates, then all `f` with vertex numbers from 1 on; nothing else.
    pub text: String,
    /// How many `v` there are.
    pub vertices: usize,
    /// The line of each `f` in the file.
    pub face_lines: Vec<usize>,
    /// Which faces stand under which names; in order, each with at least one face, except perhaps the last.
    pub sections: Vec<Section>,
}

/// A run of faces under the same names; it ends where the next one begins.
pub(super) struct Section {
    pub names: Vec<NameList>,
    pub first_face: usize,
}

impl Plain {
    /// The geometry of a file. What is left out is noted in `draft`, where nothing else changes.
    ///
    /// # Errors
    /// With its line, the first statement that has no meaning for a surface of finite vertices.
    pub fn of(bytes: &[u8], draft: &mut Draft) -> Result<Self> {
        let mut plain =
            Self { text: String::new(), vertices: 0, face_lines: Vec::new(), sections: Vec::new() };
        // Vertices first: a face may name a vertex that is defined further down.
        for statement in statements(bytes).filter(|s| s.keyword() == "v") {
            write_vertex(&statement, &mut plain.text, draft)?;
            plain.vertices += 1;
        }
        plain.add_faces(bytes, draft)?;
        Ok(plain)
    }

    fn add_faces(&mut self, bytes: &[u8], draft: &mut Draft) -> Result<()> {
        let mut names = Names::default();
        let mut vertices_above = 0;
        let mut triangles = 0;
        let mut left_out: Option<(usize, usize)> = None;
        let mut corners = Vec::new();
        for statement in statements(bytes) {
            match statement.keyword() {
                "v" => vertices_above += 1,
                "f" => {
                    corners.clear();
                    for word in statement.words() {
                        corners.push(corner(word, (vertices_above, self.vertices), &statement, draft)?);
                    }
                    draft.check_corners(corners.len(), statement.place())?;
                    triangles += corners.len() - 2;
                    draft.expect_faces(triangles)?;
                    self.write_face(&corners, statement.line);
                }
                "o" => {
                    names.object = Rc::new([name(&statement, draft)?]);
                    self.begin_section(&names);
                }
                "g" => {
                    names.groups = groups(&name(&statement, draft)?);
                    self.begin_section(&names);
                }
                "l" | "p" | "curv" | "curv2" | "surf" | "bzp" | "bsp" | "cdc" | "cdp" => {
                    let (count, first) = left_out.unwrap_or((0, statement.line));
                    left_out = Some((count + 1, first));
                }
                _ => {}
            }
        }
        if let Some((count, first)) = left_out {
            draft.notice(format!(
                "{count} of lines, points or curves were left out, the first at line {first}"
            ));
        }
        Ok(())
    }

    fn write_face(&mut self, corners: &[u32], line: usize) {
        self.text.push('f');
        for &corner in corners {
            // Writing to a `String` does not fail.
            let _ = write!(self.text, " {}", u64::from(corner) + 1);
        }
        self.text.push('\n');
        self.face_lines.push(line);
    }

    fn begin_section(&mut self, names: &Names) {
        let first_face = self.face_lines.len();
        // A section without faces is of no use, and a file may have many.
        self.sections.pop_if(|last| last.first_face == first_face);
        self.sections.push(Section { names: vec![names.object.clone(), names.groups.clone()], first_face });
    }
}

/// Writes a `v` statement without its weight and colour. An error if its place is not one.
fn write_vertex(statement: &Statement, text: &mut String, draft: &Draft) -> Result<()> {
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
    for (number, word) in numbers.iter_mut().zip(words.clone().take(if has_weight { 4 } else { 3 })) {
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
    draft.check_position(DVec3::new(x, y, z), statement.place())?;
    // As the file has it: rounding a number is for `tobj` alone.
    text.push('v');
    for word in words.take(3) {
        text.push(' ');
        text.push_str(word);
    }
    text.push('\n');
    Ok(())
}

/// The vertex that a corner such as `7`, `7/2`, `7//3` or `-1` names, counted from 0.
fn corner(
    word: &str,
    (vertices_above, count): (usize, usize),
    statement: &Statement,
    draft: &Draft,
) -> Result<u32> {
    let vertex = word.split('/').next().unwrap_or(word);
    let number: i64 = vertex.parse().map_err(|_| {
        draft.refuse_at(
            statement.place(),
            format!("“{}” is not the number of a vertex", shortened(word)),
            "write corners as vertex, vertex/texture or vertex/texture/normal",
        )
    })?;
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
    object: NameList,
    groups: NameList,
}

/// Every name by which the faces after a `g` can be chosen: each group's; and before them the groups' whole
/// text, because many programs write one name with spaces where the format means several names.
fn groups(text: &str) -> NameList {
    let mut names = vec![text.to_owned()];
    names.extend(text.split_whitespace().filter(|&name| name != text).map(str::to_owned));
    names.into()
}

/// What follows `o` or `g`.
fn name(statement: &Statement, draft: &Draft) -> Result<String> {
    let name = statement.rest();
    if name.len() <= LONGEST_NAME_BYTES {
        return Ok(name.to_owned());
    }
    Err(draft.refuse_at(
        statement.place(),
        format!("the name “{}” has {} bytes", shortened(name), name.len()),
        format!("give objects and groups names of at most {LONGEST_NAME_BYTES} bytes"),
    ))
}

/// One statement: a line, with the lines that a backslash at its end continues it on.
pub(super) struct Statement<'a> {
    line: usize,
    text: Cow<'a, str>,
}

impl Statement<'_> {
    pub fn keyword(&self) -> &str {
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
pub(super) fn statements(bytes: &[u8]) -> impl Iterator<Item = Statement<'_>> {
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn plain(text: &str) -> Plain {
        Plain::of(text.as_bytes(), &mut Draft::new(Path::new("p.obj"), 100)).expect("a plain text")
    }

    #[test]
    fn only_vertices_and_faces_are_left_and_their_lines_are_known() {
        let found = plain(
            "mtllib /etc/body.mtl\no liver\nusemtl\nv 0 0 0 0.5 0.5 0.5\nvt 0 0\nvn 0 0 1\ns off\n\
             f -1/7//2 \\\n  3 \\\n2 # over three lines\nl 1 2\nv 1e-1 0 0 1\nv 0 1 0\nf 1//1 2/2 3\n",
        );
        assert_eq!(found.text, "v 0 0 0\nv 1e-1 0 0\nv 0 1 0\nf 1 3 2\nf 1 2 3\n");
        assert_eq!((found.vertices, found.face_lines), (3, vec![8, 14]));
    }

    #[test]
    fn sections_without_faces_are_dropped_and_names_are_shared() {
        let found =
            plain("v 0 0 0\no body\ng a b\nf 1 1 1\ng c\ng d\no limb\nf 1 1 1\nf 1 1 1\ng a b\nf 1 1 1\n");
        let firsts: Vec<usize> = found.sections.iter().map(|section| section.first_face).collect();
        assert_eq!(firsts, [0, 1, 3]);
        let names: Vec<String> = found.sections.iter().map(|s| s.names.concat().join(",")).collect();
        assert_eq!(names, ["body,a b,a,b", "limb,d", "limb,a b,a,b"]);
        assert!(Rc::ptr_eq(&found.sections[1].names[0], &found.sections[2].names[0]));
    }
}
