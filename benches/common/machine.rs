//! What a table of times is worth nothing without: machine, compiler, flags and date.

use std::process::Command;

/// The head of the table, in Markdown.
pub fn heading() -> String {
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let rust_flags = std::env::var("RUSTFLAGS").unwrap_or_else(|_| "none".to_owned());
    let profile =
        if cfg!(debug_assertions) { "WITH DEBUG ASSERTIONS" } else { "bench (opt-level 3, no LTO)" };
    let widest = if cfg!(target_feature = "avx2") { "AVX2" } else { "the baseline's" };
    format!(
        "# Exact lengths: time per ray\n\n\
         * processor: {}, {cores} cores\n* compiler: {}\n* profile: {profile}; RUSTFLAGS: {rust_flags}; \
         wide instructions at compile time: {widest}\n* date: {}\n",
        cpu_model(),
        says("rustc", &["--version"]),
        says("date", &["-u", "+%Y-%m-%d"]),
    )
}

fn cpu_model() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |name| info.lines().find_map(|line| line.strip_prefix(name)?.split_once(": ").map(|f| f.1));
    match (field("model name"), field("cpu family"), field("model\t")) {
        (Some(name), Some(family), Some(model)) => format!("{name} (family {family}, model {model})"),
        _ => "unknown".to_owned(),
    }
}

/// The first line a program prints.
fn says(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output();
    let text = output.ok().and_then(|output| String::from_utf8(output.stdout).ok()).unwrap_or_default();
    text.lines().next().unwrap_or("unknown").to_owned()
}
