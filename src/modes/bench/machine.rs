//! What a table of times is worth nothing without: the machine, the build and the date.

use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

/// Where and how times were measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Machine {
    /// The processor, as the system names it.
    pub processor: String,
    /// Cores that the program may use.
    pub cores: usize,
    /// Threads that worked.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
    /// Whether the program was built with optimizations and without debug assertions, as times should be measured.
    pub optimized: bool,
    /// The widest instructions that it may use on this machine.
    pub widest_instructions: &'static str,
    /// Memory that the system has left to give, bytes, where it tells.
    pub available_bytes: Option<u64>,
    /// The day, UTC, year-month-day.
    pub date: String,
}

impl Machine {
    /// The one this program runs on.
    pub fn this() -> Self {
        Self {
            processor: processor(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            threads: rayon::current_num_threads(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            optimized: !cfg!(debug_assertions),
            widest_instructions: crate::dispatch::name(),
            available_bytes: kibibytes("/proc/meminfo", "MemAvailable:").map(|kib| kib * 1024),
            date: SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .map_or_else(|_| "unknown".into(), |since| day(since.as_secs() / 86_400)),
        }
    }
}

/// The memory that this process holds now, bytes, where the system tells.
pub fn held_bytes() -> Option<u64> {
    kibibytes("/proc/self/status", "VmRSS:").map(|kib| kib * 1024)
}

/// A figure in kB of a file of Linux's /proc.
fn kibibytes(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    text.lines().find_map(|line| line.strip_prefix(name))?.trim().strip_suffix("kB")?.trim().parse().ok()
}

fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |name| info.lines().find_map(|line| line.strip_prefix(name)?.split_once(": ").map(|f| f.1));
    match (field("model name"), field("cpu family"), field("model\t")) {
        (Some(name), Some(family), Some(model)) => format!("{name} (family {family}, model {model})"),
        _ => "unknown".into(),
    }
}

/// A day counted from 1970-01-01 as year-month-day of the Gregorian calendar: years are counted from March, so that leap
/// days end them, in eras of 400 (Richards, Explanatory Supplement to the Astronomical Almanac, 3rd ed., §15.11).
fn day(since_1970: u64) -> String {
    const DAYS_OF_ERA: u64 = 146_097;
    const FROM_0000_03_01: u64 = 719_468;
    let days = since_1970 + FROM_0000_03_01;
    let (era, of_era) = (days / DAYS_OF_ERA, days % DAYS_OF_ERA);
    let year_of_era = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_have_their_dates() {
        let cases = [(0, "1970-01-01"), (59, "1970-03-01"), (11_016, "2000-02-29"), (20_782, "2026-11-25")];
        for (days, date) in cases {
            assert_eq!(day(days), date);
        }
    }

    #[test]
    fn the_machine_has_cores_and_this_process_holds_memory() {
        let machine = Machine::this();
        assert!(machine.cores >= 1 && machine.threads >= 1);
        if cfg!(target_os = "linux") {
            assert!(held_bytes().is_some_and(|bytes| bytes > 1 << 20) && machine.available_bytes.is_some());
        }
    }
}
