//! Polygon files (PLY), text and binary of either byte order.
//!
//! ```text
//! ply │ format … 1.0 │ element vertex 24, property float x … │ element face 12, property list … │ end_header
//! then each element's rows, in the order of the header
//! ```
//!
//! Used are x, y, z of `vertex` and the list `vertex_indices` (or `vertex_index`) of `face`; vertices and faces
//! are counted from 0. Every other element and property is skipped. `ply-rs-bw` reads the rows; the header is
//! checked here before, because a reader believes it: counts must fit into the bytes that follow, and
//! nothing may be declared twice. Source: G. Turk, *The PLY Polygon File Format*, 1994.

use std::io::ErrorKind;

use glam::DVec3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::draft::Draft;
use crate::{Error, Result};

const POSITION: [&str; 3] = ["x", "y", "z"];
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];
const HEADER: &str = "header";
const EXPORT_AGAIN: &str = "the file was cut short or is damaged: export or copy it again";

/// Whether bytes begin as PLY does.
pub(super) fn is_ply(bytes: &[u8]) -> bool {
    bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r")
}

/// Reads a whole file into `draft`. Errors name the vertex or face, counted from 0, or the line of a text.
pub(super) fn read(bytes: &[u8], draft: &mut Draft) -> Result<()> {
    if !is_ply(bytes) {
        return Err(draft.refuse("the file does not begin with “ply”", "give a PLY file"));
    }
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new()
        .read_header(&mut reader)
        .map_err(|e| parse_error(&e, HEADER, true, draft))?;
    let rows = *reader.get_ref();
    check_header(&header, &bytes[..bytes.len() - rows.len()], rows.len(), draft)?;

    let mut faces = Vec::new();
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => {
                let vertices: Vec<Position> = read_rows(&mut reader, element, &header, draft)?;
                for (i, vertex) in vertices.iter().enumerate() {
                    draft.add_vertex(vertex.0, format_args!("vertex {i} (from 0)"))?;
                }
            }
            "face" => faces = read_rows::<Corners>(&mut reader, element, &header, draft)?,
            _ => {
                read_rows::<Skipped>(&mut reader, element, &header, draft)?;
            }
        }
    }
    for (i, Corners(face)) in faces.into_iter().enumerate() {
        add_face(i, face.as_deref(), draft)?;
    }
    Ok(())
}

fn read_rows<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &Header,
    draft: &Draft,
) -> Result<Vec<E>> {
    Parser::<E>::new()
        .read_payload_for_element(reader, element, header)
        .map_err(|e| parse_error(&e, &element.name, header.encoding == Encoding::Ascii, draft))
}

fn add_face(i: usize, corners: Option<&[u32]>, draft: &mut Draft) -> Result<()> {
    let place = format_args!("face {i} (from 0)");
    let count = draft.vertex_count();
    let Some(corners) = corners else {
        return Err(draft.refuse_at(place, "a corner has a negative vertex number", EXPORT_AGAIN));
    };
    if let Some(unknown) = corners.iter().find(|&&v| v as usize >= count) {
        let problem =
            format!("a corner is vertex {unknown}, but the last of {count} vertices is number {}", count - 1);
        return Err(draft.refuse_at(place, problem, EXPORT_AGAIN));
    }
    draft.add_polygon(corners, place)
}

/// Refuses a header that lacks what is needed, declares anything twice, or announces more than follows it.
fn check_header(header: &Header, text: &[u8], rows_bytes: usize, draft: &Draft) -> Result<()> {
    // The parser keeps the last of two declarations with one name, and would then misread every row.
    let declared =
        |keyword: &[u8]| text.split(|&b| b == b'\n').filter(|line| line.starts_with(keyword)).count();
    let properties = header.elements.values().map(|e| e.properties.len()).sum::<usize>();
    if declared(b"element") != header.elements.len() || declared(b"property") != properties {
        return Err(draft.refuse(
            "the header declares an element or a property twice",
            "give every element, and every property of an element, its own name",
        ));
    }
    let Some(vertex) = header.elements.get("vertex").filter(|vertex| vertex.count > 0) else {
        return Err(
            draft.refuse("the header declares no vertices", "export the mesh with its vertices and faces")
        );
    };
    if let Some(missing) = POSITION.iter().find(|name| !has_scalar(vertex, name)) {
        return Err(draft.refuse(
            format!("the vertices have no coordinate “{missing}”"),
            "export x, y and z as float or double",
        ));
    }
    let Some(face) = header.elements.get("face").filter(|face| face.count > 0) else {
        return Err(draft.refuse("no faces: a point cloud", "make a surface first"));
    };
    draft.expect_faces(face.count)?;
    let Some(corners) = face.properties.values().find(|p| CORNERS.contains(&p.name.as_str())) else {
        return Err(draft.refuse(
            "the faces have no list “vertex_indices”",
            "export polygons (not triangle strips) with a list vertex_indices or vertex_index",
        ));
    };
    if !is_integer_list(&corners.data_type) {
        return Err(draft.refuse(
            format!("“{}” is not a list of whole numbers", corners.name),
            "declare it as “property list uchar int vertex_indices”, or export the mesh again",
        ));
    }
    let mut needed = 0usize;
    for element in header.elements.values() {
        let row = least_row_bytes(element, header.encoding);
        if row == 0 && element.count > 0 {
            return Err(draft.refuse(
                format!("the element “{}” has rows, but no properties", element.name),
                "remove it from the header",
            ));
        }
        needed = needed.saturating_add(element.count.saturating_mul(row));
        // The last line of a text may lack its end.
        if needed > rows_bytes.saturating_add(1) {
            return Err(draft.refuse(
                format!(
                    "the header announces {} of “{}”, which needs at least {needed} bytes in all, but {rows_bytes} follow",
                    element.count, element.name
                ),
                EXPORT_AGAIN,
            ));
        }
    }
    Ok(())
}

fn has_scalar(element: &ElementDef, name: &str) -> bool {
    element.properties.get(name).is_some_and(|p| matches!(p.data_type, PropertyType::Scalar(_)))
}

fn is_integer_list(data_type: &PropertyType) -> bool {
    let is_real = |scalar: &ScalarType| matches!(scalar, ScalarType::Float | ScalarType::Double);
    matches!(data_type, PropertyType::List(length, item) if !is_real(length) && !is_real(item))
}

/// The fewest bytes that a row takes: empty lists, and in a text one digit and one space or line end a number.
fn least_row_bytes(element: &ElementDef, encoding: Encoding) -> usize {
    let binary = |scalar: &ScalarType| match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let bytes = |property: &PropertyType| match property {
        _ if encoding == Encoding::Ascii => 2,
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => binary(scalar),
    };
    element.properties.values().map(|p| bytes(&p.data_type)).sum()
}

/// The parser's refusal in this library's words. It counts lines in a header and a text, but rows in binary.
fn parse_error(error: &ParseError, part: &str, is_text: bool, draft: &Draft) -> Error {
    let problem = match (error.kind(), part) {
        (ErrorKind::UnexpectedEof, HEADER) => "the file ends before “end_header”".to_owned(),
        (_, HEADER) => "the header is not understood".to_owned(),
        (ErrorKind::UnexpectedEof, _) => format!("the file ends before the last {part} row"),
        _ => format!("a {part} row is not what the header declares"),
    };
    match error.line() {
        Some(line) if is_text => draft.refuse_at(format!("line {line}"), problem, EXPORT_AGAIN),
        _ => draft.refuse(problem, EXPORT_AGAIN),
    }
}

/// A vertex row's position.
struct Position(DVec3);

impl PropertyAccess for Position {
    fn new() -> Self {
        Self(DVec3::ZERO)
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(axis) = POSITION.iter().position(|axis| *axis == name) else {
            return PropertyAccessResult::Ignored;
        };
        self.0[axis] = match property {
            Property::Float(x) => f64::from(x),
            Property::Double(x) => x,
            Property::Char(x) => f64::from(x),
            Property::UChar(x) => f64::from(x),
            Property::Short(x) => f64::from(x),
            Property::UShort(x) => f64::from(x),
            Property::Int(x) => f64::from(x),
            Property::UInt(x) => f64::from(x),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// A face row's vertex numbers; `None` if one is negative.
struct Corners(Option<Vec<u32>>);

impl PropertyAccess for Corners {
    fn new() -> Self {
        Self(Some(Vec::new()))
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = property.to_u32_list();
        PropertyAccessResult::Set
    }
}

/// A row of no interest.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
