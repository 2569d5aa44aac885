//! Numbers on the command line. What is wrong with them is said in the words of the option, which `clap` puts around it.

pub fn numbers<const N: usize, T: std::str::FromStr>(text: &str, separator: char) -> Result<[T; N], String> {
    let parts: Vec<T> = text
        .split(separator)
        .map(|part| part.trim().parse().map_err(|_| format!("`{}` is not such a number", part.trim())))
        .collect::<Result<_, _>>()?;
    parts.try_into().map_err(|_| format!("give {N} numbers joined by `{separator}`"))
}

pub fn parse_point(text: &str) -> Result<[f64; 3], String> {
    numbers(text, ',')
}

pub fn parse_pair(text: &str) -> Result<[f64; 2], String> {
    numbers(text, ',')
}

pub fn parse_pixels(text: &str) -> Result<[u32; 2], String> {
    numbers(text, 'x')
}

pub fn parse_extent(text: &str) -> Result<[f64; 2], String> {
    numbers(text, 'x')
}

/// Millimetres, with or without the unit.
pub fn parse_mm(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix("mm").unwrap_or(text).trim();
    number.parse().map_err(|_| "give millimetres, as `0.1mm` or `0.1`".into())
}

pub fn parse_window(text: &str) -> Result<[f64; 2], String> {
    let (low, high) = text.split_once("..").ok_or("give two numbers joined by `..`")?;
    match [low, high].map(|part| part.trim().parse::<f64>()) {
        [Ok(low), Ok(high)] if low < high && low.is_finite() && high.is_finite() => Ok([low, high]),
        _ => Err("give two finite numbers, the lower first, as `0..5`".into()),
    }
}
