//! Rows of a table, as CSV (RFC 4180) or as JSON lines: one object per row, with the heads of columns as keys.

use crate::output::audit::csv::field;

/// How tables are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated, with one line of heads.
    Csv,
    /// JSON lines.
    JsonLines,
}

impl Format {
    /// The ending of file names.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::JsonLines => "jsonl",
        }
    }
}

/// Rows on their way to a file. Numbers are the shortest that read back as the same float.
pub struct Rows {
    format: Format,
    heads: &'static [&'static str],
    column: usize,
    text: String,
    digits: zmij::Buffer,
}

impl Rows {
    /// No rows yet.
    pub fn new(format: Format, heads: &'static [&'static str]) -> Self {
        Self { format, heads, column: 0, text: String::new(), digits: zmij::Buffer::new() }
    }

    /// What a file begins with: the line of heads of a CSV, with those of columns that follow.
    pub fn head(&self, more: &[String]) -> String {
        match self.format {
            Format::Csv => {
                let heads =
                    self.heads.iter().map(|head| (*head).to_owned()).chain(more.iter().map(|m| field(m)));
                heads.collect::<Vec<_>>().join(",") + "\n"
            }
            Format::JsonLines => String::new(),
        }
    }

    /// The rows so far.
    pub fn text(self) -> String {
        self.text
    }

    fn next(&mut self) {
        let head = self.heads[self.column];
        self.begin(head);
    }

    fn begin(&mut self, head: &str) {
        let is_first = self.column == 0;
        match self.format {
            Format::Csv if is_first => {}
            Format::Csv => self.text.push(','),
            Format::JsonLines => {
                self.text.push(if is_first { '{' } else { ',' });
                self.text.push_str(&json_text(head));
                self.text.push(':');
            }
        }
        self.column += 1;
    }

    /// Words.
    pub fn word(&mut self, word: &str) -> &mut Self {
        self.next();
        self.put_word(word);
        self
    }

    fn put_word(&mut self, word: &str) {
        match self.format {
            Format::Csv => self.text.push_str(&field(word)),
            Format::JsonLines => self.text.push_str(&json_text(word)),
        }
    }

    /// A whole number.
    pub fn count(&mut self, count: u64) -> &mut Self {
        self.next();
        // Without the detour of a formatter: there are some of them in each of very many rows.
        let (mut digits, mut at, mut rest) = ([0_u8; 20], 20, count);
        loop {
            at -= 1;
            digits[at] = b'0' + (rest % 10) as u8;
            rest /= 10;
            if rest == 0 {
                break;
            }
        }
        self.text.extend(digits[at..].iter().map(|digit| char::from(*digit)));
        self
    }

    /// A number; nothing if it is not finite.
    pub fn number(&mut self, value: f64) -> &mut Self {
        self.next();
        if value.is_finite() {
            let digits = self.digits.format_finite(value);
            // Whole numbers without the `.0`.
            self.text.push_str(digits.strip_suffix(".0").unwrap_or(digits));
        } else if self.format == Format::JsonLines {
            self.text.push_str("null");
        }
        self
    }

    /// A number, or nothing.
    pub fn maybe(&mut self, value: Option<f64>) -> &mut Self {
        self.number(value.unwrap_or(f64::NAN))
    }

    /// Three numbers.
    pub fn point(&mut self, [x, y, z]: [f64; 3]) -> &mut Self {
        self.number(x).number(y).number(z)
    }

    /// A swept parameter's value, under its own head.
    pub fn value(&mut self, head: &str, value: &toml::Value) -> &mut Self {
        self.begin(head);
        match (value, self.format) {
            (toml::Value::String(word), _) => self.put_word(word),
            (value, Format::Csv) => self.put_word(&value.to_string()),
            (value, Format::JsonLines) => {
                self.text.push_str(&serde_json::to_string(value).unwrap_or_else(|_| "null".into()));
            }
        }
        self
    }

    /// Ends the row.
    pub fn end(&mut self) {
        if self.format == Format::JsonLines {
            self.text.push('}');
        }
        self.text.push('\n');
        self.column = 0;
    }
}

/// A text as JSON has it.
fn json_text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(format: Format) -> String {
        let mut rows = Rows::new(format, &["organ", "paths", "length_mm", "area_mm2"]);
        rows.word("left, lower \"lobe\"").count(1_234_567_890_123).number(0.1 + 0.2).maybe(None);
        rows.value("spectrum.kvp", &toml::Value::Integer(80)).end();
        rows.word("liver").count(0).number(2.0).number(1e-300).value("scene", &"head".into()).end();
        rows.head(&["spectrum.kvp".into()]) + &rows.text()
    }

    #[test]
    fn csv_has_heads_quotes_and_numbers_that_read_back() {
        assert_eq!(
            rows(Format::Csv),
            "organ,paths,length_mm,area_mm2,spectrum.kvp\n\
             \"left, lower \"\"lobe\"\"\",1234567890123,0.30000000000000004,,80\nliver,0,2,1e-300,head\n"
        );
    }

    #[test]
    fn json_lines_are_json() {
        let text = rows(Format::JsonLines);
        let lines: Vec<serde_json::Value> =
            text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        assert_eq!(lines[0]["organ"], "left, lower \"lobe\"");
        assert_eq!(lines[0]["length_mm"].as_f64(), Some(0.1 + 0.2));
        assert!(lines[0]["area_mm2"].is_null());
        assert_eq!((&lines[0]["spectrum.kvp"], &lines[1]["scene"]), (&80.into(), &"head".into()));
    }
}
