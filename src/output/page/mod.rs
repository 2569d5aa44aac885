//! Reports as pages of HTML: one file each, no network, no script; everything they show is in them.

pub mod base64;
pub mod curves;
pub mod plot;

use std::fmt::Write as _;

const STYLE: &str = include_str!("page.css");

/// Colours of series, as CSS.
pub const BLUE: &str = "#2166ac";
/// See [`BLUE`].
pub const ORANGE: &str = "#d6604d";
/// See [`BLUE`].
pub const GREY: &str = "#7a7a7a";
/// See [`BLUE`].
pub const BLACK: &str = "#222222";

/// A whole page: its title as text, and its sections with their headings as HTML; those without content are left out, and a
/// section without a heading gets none.
pub fn document(title: &str, sections: &[(&str, String)]) -> String {
    let title = escape(title);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\"><title>{title}</title>\n\
         <style>{STYLE}</style></head>\n<body><main>\n<h1>{title}</h1>\n"
    );
    for (heading, content) in sections.iter().filter(|(_, content)| !content.is_empty()) {
        if !heading.is_empty() {
            let _ = writeln!(html, "<h2>{heading}</h2>");
        }
        let _ = writeln!(html, "{content}");
    }
    html.push_str("</main></body></html>\n");
    html
}

/// A number in few characters: four digits, or two and a power of ten.
pub fn short(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.1e}");
    }
    let decimals = (3 - magnitude.log10().floor() as i32).clamp(0, 5);
    format!("{value:.*}", decimals as usize)
}

/// A whole number in groups of three.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            // A thin space that does not break.
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// Text that HTML takes for nothing else.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_become_markup_and_numbers_are_grouped() {
        assert_eq!(escape("<b a=\"1\">&"), "&lt;b a=&quot;1&quot;&gt;&amp;");
        assert_eq!(grouped(25_165_824), "25\u{202f}165\u{202f}824");
        assert_eq!((grouped(0), grouped(999)), ("0".into(), "999".into()));
    }

    #[test]
    fn numbers_are_short_and_keep_their_first_digits() {
        let cases = [(0.0, "0"), (1234.56, "1235"), (0.012345, "0.01235"), (-3.2e-13, "-3.2e-13")];
        assert!(cases.iter().all(|&(value, text)| short(value) == text), "{:?}", cases.map(|c| short(c.0)));
        assert_eq!(short(f64::INFINITY), "inf");
    }
}
