//! Paths from a CSV file.

use glam::DVec3;

use super::paths::ListedPath;
use crate::error::{Error, Result};
use crate::geometry::Segment;
use crate::scene::panel::MAX_COORDINATE_MM;
use crate::scene::regular_file::Kind;

/// A list of some ten million paths. Larger studies are fields or sweeps, or lists in several files.
pub(super) const PATH_FILE: Kind = Kind {
    name: "list of paths",
    max_bytes: 1 << 30,
    if_too_large: "split the list, one study for each part",
};

/// The columns that each row must have, in any order; `weight` may be left out.
const COLUMNS: [&str; 7] =
    ["source_x_mm", "source_y_mm", "source_z_mm", "target_x_mm", "target_y_mm", "target_z_mm", "weight"];

/// The paths of a CSV text; blank lines and lines that begin with `#` are passed over.
///
/// # Errors
/// A missing or unknown column; a row with too few or too many fields, a field that is no finite number, a source that is
/// its target, a weight that is none: with the line of `file`.
pub(super) fn read(file: &str, text: &str) -> Result<Vec<ListedPath>> {
    let mut lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (head_line, head) = lines.next().unwrap_or((1, ""));
    let columns = columns(head)
        .map_err(|(problem, remedy)| Error::input(format!("{file}:{head_line}"), problem, remedy))?;
    let paths: Vec<ListedPath> = lines
        .map(|(number, line)| {
            row(&columns, line)
                .map_err(|(problem, remedy)| Error::input(format!("{file}:{number}"), problem, remedy))
        })
        .collect::<Result<_>>()?;
    if paths.is_empty() {
        return Err(Error::input(file, "the list has no paths", "give at least one row"));
    }
    Ok(paths)
}

type Refused = (String, &'static str);

/// Which of [`COLUMNS`] each field is.
fn columns(head: &str) -> Result<Vec<usize>, Refused> {
    let mut columns = Vec::new();
    for name in head.split(',').map(str::trim) {
        match COLUMNS.iter().position(|known| *known == name) {
            Some(column) if !columns.contains(&column) => columns.push(column),
            Some(_) => return Err((format!("the column {name} is there twice"), "name each once")),
            None => return Err((format!("{name:?} is no column of a list of paths"), HEAD_REMEDY)),
        }
    }
    match (0..6).find(|column| !columns.contains(column)) {
        Some(missing) => Err((format!("the column {} is missing", COLUMNS[missing]), HEAD_REMEDY)),
        None => Ok(columns),
    }
}

const HEAD_REMEDY: &str = "begin the list with source_x_mm,source_y_mm,source_z_mm,target_x_mm,target_y_mm,target_z_mm \
                           and, if paths count differently, weight";

fn row(columns: &[usize], line: &str) -> Result<ListedPath, Refused> {
    let mut values = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let mut fields = line.split(',').map(str::trim);
    for &column in columns {
        let field = fields.next().unwrap_or_default();
        let value: f64 = field.parse().unwrap_or(f64::NAN);
        if !value.is_finite() || value.abs() > MAX_COORDINATE_MM {
            let problem = format!("{} is {field:?}, not a finite number of millimetres", COLUMNS[column]);
            return Err((problem, "correct or drop the row"));
        }
        values[column] = value;
    }
    if fields.next().is_some() {
        return Err((format!("{line:?} has more fields than the head"), "give one field for each column"));
    }
    let [sx, sy, sz, tx, ty, tz, photons] = values;
    listed([sx, sy, sz, tx, ty, tz], photons)
}

/// A path of a list, checked.
pub(super) fn listed([sx, sy, sz, tx, ty, tz]: [f64; 6], photons: f64) -> Result<ListedPath, Refused> {
    let (source_mm, target_mm) = (DVec3::new(sx, sy, sz), DVec3::new(tx, ty, tz));
    if photons.is_nan() || photons <= 0.0 {
        return Err((
            format!("the weight {photons} is not positive"),
            "give weights above zero, or drop the row",
        ));
    }
    if Segment::between(source_mm, target_mm).is_none() {
        let problem = "source and target do not make a path: they coincide, or are not finite".into();
        return Err((problem, "give two points apart, in millimetres"));
    }
    Ok(ListedPath { source_mm, target_mm, photons })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "source_x_mm,source_y_mm,source_z_mm,target_x_mm,target_y_mm,target_z_mm";

    #[test]
    fn rows_are_read_whatever_the_order_of_columns() {
        let text = "# by hand\nweight,target_x_mm,target_y_mm,target_z_mm,source_x_mm,source_y_mm,source_z_mm\n\n2,1,2,3,4,5,6\n";
        let paths = read("paths.csv", text).expect("a list");
        let expected = ListedPath {
            source_mm: DVec3::new(4.0, 5.0, 6.0),
            target_mm: DVec3::new(1.0, 2.0, 3.0),
            photons: 2.0,
        };
        assert_eq!(paths, [expected]);
        assert_eq!(read("paths.csv", &format!("{HEAD}\n1,2,3,4,5,6\n")).expect("a list")[0].photons, 1.0);
    }

    #[test]
    fn bad_rows_are_refused_with_their_line() {
        for (rows, place) in [
            ("1,2,3,4,5,6\n1,2,NaN,4,5,6\n", "paths.csv:3"),
            ("1,2,3,4,5,inf\n", "paths.csv:2"),
            ("1,2,3,4,5\n", "paths.csv:2"),
            ("1,2,3,4,5,6,7\n", "paths.csv:2"),
            ("1,2,3,1,2,3\n", "paths.csv:2"),
            ("1,2,3,1,2,x\n", "paths.csv:2"),
            ("", "paths.csv"),
        ] {
            let Err(Error::Input { subject, .. }) = read("paths.csv", &format!("{HEAD}\n{rows}")) else {
                panic!("accepted {rows:?}")
            };
            assert_eq!(subject, place, "{rows:?}");
        }
        for head in ["", "source_x_mm", "x,y,z", "source_x_mm,source_x_mm"] {
            assert!(read("paths.csv", &format!("{head}\n1,2,3,4,5,6\n")).is_err(), "{head}");
        }
        let weighted = format!("{HEAD},weight\n1,2,3,4,5,6,0\n");
        assert!(read("paths.csv", &weighted).is_err());
    }
}
