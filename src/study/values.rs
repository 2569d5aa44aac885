//! A parameter's values as words: `80,120`, `0..360:30`, `[0, 0, 100],[0, 0, 200]`, `adult,head`.

use toml::{Table, Value};

use crate::scene::ranges::range;

/// Values joined by commas: numbers, ranges, TOML values, or words. Commas within brackets, braces and quotes join nothing.
pub(super) fn list(words: &str, turns: bool) -> Result<Vec<Value>, String> {
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
}
