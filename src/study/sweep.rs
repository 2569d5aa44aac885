//! Sweeps: which parameters take which values, together or each with each.
//!
//! ```text
//! [[sweep]]  beam.gantry_deg = "0..360:90"          4 values ┐
//! [[sweep]]  spectrum.kvp = [80, 120]               2 values ├─ 4 × 2 cases, the last table turning fastest
//!            beam.sad_mm  = [900, 1000]             together ┘
//! --set spectrum.kvp=100                            takes the place of the file's values of this key
//! ```

use std::collections::HashSet;

use toml::{Table, Value};

use super::schema::{KEYS, ORGAN_KEYS, UNITS};
use crate::error::{Error, Result};
use crate::scene::SceneText;
use crate::scene::ranges::range;
use crate::scene::text::Step;

/// Keys of which a study has one at most: who sets one takes the others out.
const EXCLUSIVE: [&[&str]; 3] = [
    &["spectrum.energy_keV", "spectrum.kvp", "spectrum.file"],
    &["beam.isocentre", "beam.isocentre_mm"],
    &["paths.field.rectangle_mm", "paths.field.circle_mm", "paths.field.polygon_mm"],
];

/// Where a sweep was written.
#[derive(Clone, Debug, PartialEq)]
enum Place {
    /// In the file's `[[sweep]]` of this index, under this key.
    File(usize, Vec<String>),
    /// In this argument of `--set`.
    Setting(String),
}

/// One swept parameter.
#[derive(Clone, Debug)]
struct Column {
    /// The path to it in the study file.
    path: Vec<String>,
    values: Vec<Value>,
    place: Place,
}

impl Column {
    fn name(&self) -> String {
        self.path.join(".")
    }

    /// What is wrong with it, where it was written.
    fn error(&self, text: &SceneText, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        match &self.place {
            Place::Setting(words) => Error::input(format!("--set {words}"), problem, remedy),
            Place::File(index, keys) => {
                let head = [Step::Key("sweep"), Step::Index(*index)];
                let path: Vec<Step> = head.into_iter().chain(keys.iter().map(|k| Step::Key(k))).collect();
                text.error(&path, format!("sweep of {}: {}", self.name(), problem.into()), "here", remedy)
            }
        }
    }

    /// Whether both cannot be swept: the same parameter, a part of it, or one that excludes it.
    fn overlaps(&self, other: &Self) -> bool {
        let shorter = self.path.len().min(other.path.len());
        let group = |column: &Self| EXCLUSIVE.iter().position(|g| g.contains(&column.name().as_str()));
        self.path[..shorter] == other.path[..shorter]
            || (group(self).is_some() && group(self) == group(other))
    }
}

/// All that is swept: axes to be multiplied, each of parameters that go together.
#[derive(Clone, Debug, Default)]
pub(super) struct Sweep {
    axes: Vec<Vec<Column>>,
}

impl Sweep {
    /// The sweeps of the file's tables, with those of `settings` (`key=values`) in their place; with `zip`, the settings go
    /// together.
    ///
    /// # Errors
    /// Unknown keys, values that cannot be read, a parameter swept twice, values named twice, lists that go together and are
    /// not equally long: with the place.
    pub fn new(text: &SceneText, tables: &[Table], settings: &[String], zip: bool) -> Result<Self> {
        let mut set = Vec::new();
        for words in settings {
            set.push(vec![setting(words)?]);
        }
        if zip {
            set = vec![set.into_iter().flatten().collect()];
        }
        let mut axes = Vec::new();
        for (index, table) in tables.iter().enumerate() {
            let mut columns = Vec::new();
            collect(text, index, table, &mut Vec::new(), &mut columns)?;
            columns.retain(|column| !set.iter().flatten().any(|setting| setting.overlaps(column)));
            axes.push(columns);
        }
        axes.extend(set);
        axes.retain(|axis| !axis.is_empty());
        let sweep = Self { axes };
        sweep.check(text)?;
        Ok(sweep)
    }

    fn check(&self, text: &SceneText) -> Result<()> {
        let columns: Vec<&Column> = self.axes.iter().flatten().collect();
        for (i, column) in columns.iter().enumerate() {
            if let Some(other) = columns[..i].iter().find(|other| other.overlaps(column)) {
                let problem = format!("overlaps with that of {}", other.name());
                return Err(column.error(text, problem, "sweep each parameter once"));
            }
        }
        for axis in &self.axes {
            let length = axis[0].values.len();
            if let Some(column) = axis.iter().find(|column| column.values.len() != length) {
                let problem =
                    format!("{} values cannot go with {length} of {}", column.values.len(), axis[0].name());
                return Err(column.error(
                    text,
                    problem,
                    "give as many of each, or put them in tables of their own to be multiplied",
                ));
            }
            let mut seen = HashSet::new();
            for i in 0..length {
                let values: Vec<String> = axis.iter().map(|column| column.values[i].to_string()).collect();
                if !seen.insert(values.clone()) {
                    let problem = format!("names {} twice", values.join(", "));
                    return Err(axis[0].error(text, problem, "name each once: ranges may not overlap"));
                }
            }
        }
        Ok(())
    }

    /// The names of all swept parameters.
    pub fn keys(&self) -> Vec<String> {
        self.axes.iter().flatten().map(Column::name).collect()
    }

    /// How many cases there are; at least one. `None` if they cannot be counted.
    pub fn cases(&self) -> Option<usize> {
        self.axes.iter().try_fold(1_usize, |cases, axis| cases.checked_mul(axis[0].values.len()))
    }

    /// The values of a case, in the order of [`keys`](Self::keys).
    pub fn values(&self, case: usize) -> Vec<Value> {
        self.columns_of(case).map(|(column, i)| column.values[i].clone()).collect()
    }

    /// Puts a case's values into the study's document.
    pub fn apply(&self, case: usize, document: &mut Table) {
        self.apply_some(case, |_| true, document);
    }

    /// As [`apply`](Self::apply), for one parameter only.
    pub fn apply_only(&self, case: usize, key: &str, document: &mut Table) {
        self.apply_some(case, |column| column.name() == key, document);
    }

    fn apply_some(&self, case: usize, is_meant: impl Fn(&Column) -> bool, document: &mut Table) {
        for (column, i) in self.columns_of(case).filter(|(column, _)| is_meant(column)) {
            let name = column.name();
            let rivals = EXCLUSIVE.iter().find(|group| group.contains(&name.as_str()));
            for rival in rivals.into_iter().copied().flatten() {
                let steps: Vec<&str> = rival.split('.').collect();
                let (last, way) = (steps[steps.len() - 1], &steps[..steps.len() - 1]);
                if let Some(table) =
                    way.iter().try_fold(&mut *document, |t, key| t.get_mut(*key)?.as_table_mut())
                {
                    table.remove(last);
                }
            }
            let (last, way) = (column.path.len() - 1, &column.path);
            let mut table = &mut *document;
            for key in &way[..last] {
                let entry = table.entry(key.clone()).or_insert_with(|| Value::Table(Table::new()));
                if !entry.is_table() {
                    *entry = Value::Table(Table::new());
                }
                let Some(inner) = entry.as_table_mut() else { return };
                table = inner;
            }
            table.insert(way[last].clone(), column.values[i].clone());
        }
    }

    /// The error of the parameter at `path`, where it was swept. `None` if it is not.
    pub fn blame(&self, text: &SceneText, path: &str, problem: &str, remedy: &str) -> Option<Error> {
        let is_meant = |column: &&Column| {
            let name = column.name();
            path == name || path.strip_prefix(&name).is_some_and(|rest| rest.starts_with('.'))
        };
        let column = self.axes.iter().flatten().find(is_meant)?;
        Some(column.error(text, problem, remedy))
    }

    /// A case's columns, each with the index of its value.
    fn columns_of(&self, case: usize) -> impl Iterator<Item = (&Column, usize)> {
        let mut rest = case;
        let mut indices: Vec<usize> = Vec::with_capacity(self.axes.len());
        for axis in self.axes.iter().rev() {
            indices.push(rest % axis[0].values.len());
            rest /= axis[0].values.len();
        }
        let indices = indices.into_iter().rev();
        self.axes.iter().zip(indices).flat_map(|(axis, i)| axis.iter().map(move |column| (column, i)))
    }
}

/// The columns of a `[[sweep]]` table; keys may be dotted or quoted.
fn collect(
    text: &SceneText,
    index: usize,
    table: &Table,
    way: &mut Vec<String>,
    columns: &mut Vec<Column>,
) -> Result<()> {
    for (key, value) in table {
        way.push(key.clone());
        if let Value::Table(inner) = value {
            collect(text, index, inner, way, columns)?;
        } else {
            let place = Place::File(index, way.clone());
            let mut column = Column { path: way.clone(), values: Vec::new(), place };
            column.path = resolve(&way.join(".")).map_err(|(p, remedy)| column.error(text, p, remedy))?;
            column.values = match value {
                Value::Array(values) => values.clone(),
                Value::String(words) => list(words, turns(&column.path))
                    .map_err(|p| column.error(text, p, "write a list, or a range as \"0..360:30\""))?,
                single => vec![single.clone()],
            };
            if column.values.is_empty() {
                return Err(column.error(text, "the list is empty", "give at least one value"));
            }
            columns.push(column);
        }
        way.pop();
    }
    Ok(())
}

/// A `key=values` of the command line.
fn setting(words: &str) -> Result<Column> {
    let refuse =
        |(problem, remedy): (String, String)| Error::input(format!("--set {words}"), problem, remedy);
    let (key, values) = words.split_once('=').ok_or_else(|| {
        refuse(("it has no `=`".into(), "write, for example, --set beam.gantry=0..360:30".into()))
    })?;
    let path = resolve(key.trim()).map_err(refuse)?;
    let values = list(values, turns(&path)).map_err(|problem| {
        refuse((problem, "write values joined by commas, or a range as 0..360:30".into()))
    })?;
    Ok(Column { path, values, place: Place::Setting(words.into()) })
}

/// Whether a parameter comes round after 360.
fn turns(path: &[String]) -> bool {
    path.last().is_some_and(|key| key.ends_with("_deg"))
}

/// The path that a key means; units may be left out. Otherwise the problem, and the remedy.
fn resolve(key: &str) -> Result<Vec<String>, (String, String)> {
    let is_meant = |known: &str| {
        known == key || UNITS.iter().any(|unit| known.strip_suffix(unit).is_some_and(|bare| bare == key))
    };
    // Exact names first: `beam.isocentre` is an organ, `beam.isocentre_mm` a point.
    if let Some(known) = KEYS.iter().find(|k| **k == key).or_else(|| KEYS.iter().find(|k| is_meant(k))) {
        return Ok(known.split('.').map(String::from).collect());
    }
    // An organ's name may have dots of its own.
    let organ = key.strip_prefix("organ.").and_then(|rest| rest.rsplit_once('.'));
    if let Some((organ, last)) = organ
        && let Some(known) = ORGAN_KEYS
            .iter()
            .find(|known| **known == last || UNITS.iter().any(|unit| known.strip_suffix(unit) == Some(last)))
    {
        return Ok(["organ", organ, known].map(String::from).to_vec());
    }
    let parameters = format!("{}, organ.NAME.{}", KEYS.join(", "), ORGAN_KEYS.join(", organ.NAME."));
    Err((format!("a study has no parameter `{key}`"), format!("name one of {parameters}")))
}

/// Values joined by commas: numbers, ranges, TOML values, or words. Commas within brackets, braces and quotes join nothing.
fn list(words: &str, turns: bool) -> Result<Vec<Value>, String> {
    let mut values = Vec::new();
    let (mut depth, mut quoted, mut start) = (0_i32, false, 0);
    let ends =
        words.char_indices().map(|(i, c)| (i, c, i + c.len_utf8())).chain([(words.len(), ',', words.len())]);
    for (i, c, next) in ends {
        match c {
            '"' => quoted = !quoted,
            '[' | '{' if !quoted => depth += 1,
            ']' | '}' if !quoted => depth -= 1,
            ',' if i == words.len() || (depth <= 0 && !quoted) => {
                values.extend(item(words[start..i].trim(), turns)?);
                start = next;
            }
            _ => {}
        }
    }
    Ok(values)
}

/// One of them.
fn item(word: &str, turns: bool) -> Result<Vec<Value>, String> {
    let is_number_like = word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    if word.is_empty() {
        return Err("a value is missing".into());
    }
    if is_number_like && word.contains("..") {
        return Ok(range(word, turns)?.into_iter().map(number).collect());
    }
    if let Ok(value) = word.parse::<f64>() {
        return Ok(vec![number(value)]);
    }
    match format!("value = {word}").parse::<Table>().ok().and_then(|mut table| table.remove("value")) {
        Some(value) => Ok(vec![value]),
        None => Ok(vec![Value::String(word.into())]),
    }
}

/// Whole numbers as TOML's integers, so that they serve where a count is asked for.
fn number(value: f64) -> Value {
    /// The largest up to which f64 knows every whole number.
    const MOST: f64 = 9e15;
    if value.fract() == 0.0 && value.abs() < MOST {
        Value::Integer(value as i64)
    } else {
        Value::Float(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(tables: &str, settings: &[&str], zip: bool) -> Result<Sweep> {
        let document: Table = tables.parse().expect("TOML");
        let tables: Vec<Table> = match document.get("sweep") {
            Some(Value::Array(tables)) => tables.iter().filter_map(|t| t.as_table().cloned()).collect(),
            _ => Vec::new(),
        };
        let text = SceneText::new("study.toml", document.to_string());
        let settings: Vec<String> = settings.iter().map(|s| (*s).into()).collect();
        Sweep::new(&text, &tables, &settings, zip)
    }

    fn cases(sweep: &Sweep) -> Vec<String> {
        let all = 0..sweep.cases().expect("countable");
        all.map(|case| {
            let values: Vec<String> = sweep.values(case).iter().map(Value::to_string).collect();
            values.join(" ")
        })
        .collect()
    }

    #[test]
    fn tables_are_multiplied_and_keys_of_one_table_go_together() {
        let text = "[[sweep]]\nbeam.gantry_deg = \"0..360:120\"\n[[sweep]]\n\"spectrum.kvp\" = [80, 120]\n\
                    beam.sad = \"900,1000\"";
        let sweep = sweep(text, &[], false).expect("a sweep");
        assert_eq!(sweep.keys(), ["beam.gantry_deg", "spectrum.kvp", "beam.sad_mm"]);
        assert_eq!(
            cases(&sweep),
            ["0 80 900", "0 120 1000", "120 80 900", "120 120 1000", "240 80 900", "240 120 1000"]
        );
    }

    #[test]
    fn settings_are_multiplied_or_zipped_and_take_the_files_place() {
        let file = "[[sweep]]\nbeam.gantry_deg = [1, 2, 3]\nbeam.couch_deg = [4, 5, 6]";
        let product = sweep(file, &["beam.gantry=0,90", "spectrum.kvp=80"], false).expect("a sweep");
        assert_eq!(product.keys(), ["beam.couch_deg", "beam.gantry_deg", "spectrum.kvp"]);
        assert_eq!(cases(&product)[..3], ["4 0 80", "4 90 80", "5 0 80"]);
        let zipped = sweep("", &["beam.gantry=0,90", "beam.couch=10,20"], true).expect("a sweep");
        assert_eq!(cases(&zipped), ["0 10", "90 20"]);
        assert_eq!(cases(&sweep("", &[], false).expect("none")), [""]);
    }

    #[test]
    fn values_are_numbers_ranges_vectors_and_words() {
        let values =
            |words: &str| list(words, false).map(|v| v.iter().map(Value::to_string).collect::<Vec<_>>());
        assert_eq!(values("0..1:0.5").expect("a range"), ["0", "0.5", "1"]);
        assert_eq!(values("[0,0,1],[2, 3, 4]").expect("vectors"), ["[0, 0, 1]", "[2, 3, 4]"]);
        assert_eq!(values("liver, \"a, b\"").expect("words"), ["\"liver\"", "\"a, b\""]);
        assert!(values("0..10").is_err() && values("1,,2").is_err());
        assert_eq!(list("0..360:180", true).expect("a range").len(), 2, "the end is the start again");
        assert_eq!(list("0..360:180", false).expect("a range").len(), 3);
    }

    #[test]
    fn setting_one_of_several_sources_takes_the_others_out() {
        let mut document: Table = "[spectrum]\nenergy_keV = 60\nfilters = []".parse().expect("TOML");
        sweep("", &["spectrum.kvp=80"], false).expect("a sweep").apply(0, &mut document);
        let spectrum = document["spectrum"].as_table().expect("a table");
        assert_eq!(spectrum.keys().collect::<Vec<_>>(), ["filters", "kvp"]);
    }

    #[test]
    fn overlaps_unequal_lists_and_unknown_keys_are_refused_with_their_place() {
        for (file, settings, line, words) in [
            ("[[sweep]]\nbeam.gantry_deg = [1]\n[[sweep]]\nbeam.gantry_deg = [2]", "", Some(4), "overlaps"),
            ("[[sweep]]\nspectrum.kvp = [80]\nspectrum.energy_keV = [60]", "", Some(3), "overlaps"),
            ("[[sweep]]\nbeam.gantry_deg = [1, 2]\nbeam.couch_deg = [1]", "", Some(3), "cannot go with"),
            ("[[sweep]]\nbeam.gantry_deg = \"0..90:30,60..120:30\"", "", Some(2), "names 60 twice"),
            ("[[sweep]]\nbeam.gantri_deg = [1]", "", Some(2), "no parameter"),
            ("[[sweep]]\nbeam.gantry_deg = []", "", Some(2), "empty"),
            ("", "beam.gantry=1 beam.gantry_deg=2", None, "overlaps"),
            ("", "beam.gantry", None, "no `=`"),
        ] {
            let settings: Vec<&str> = settings.split_whitespace().collect();
            let text = SceneText::new("study.toml", file);
            let tables: Table = file.parse().expect("TOML");
            let tables: Vec<Table> = tables
                .get("sweep")
                .and_then(Value::as_array)
                .map(|all| all.iter().filter_map(|t| t.as_table().cloned()).collect())
                .unwrap_or_default();
            let settings: Vec<String> = settings.iter().map(|s| (*s).into()).collect();
            let error = Sweep::new(&text, &tables, &settings, false).expect_err(file);
            assert!(error.to_string().contains(words), "{error}");
            assert_eq!(error.line(), line, "{error}");
        }
    }
}
