//! Nothing here talks to a network: nothing that could is built in, and no command opens a socket.
#![cfg(target_os = "linux")]

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::nested_balls;

const PROGRAM: &str = env!("CARGO_BIN_EXE_chordfield");

/// What programs open connections by; `.ci/deny.toml` bans the same.
const CRATES: [&str; 16] = [
    "async-io",
    "async-std",
    "attohttpc",
    "curl",
    "h2",
    "hyper",
    "isahc",
    "mio",
    "native-tls",
    "openssl",
    "quinn",
    "reqwest",
    "rustls",
    "socket2",
    "tokio",
    "ureq",
];

/// All files below a folder that end so.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let below = |path: PathBuf| if path.is_dir() { files(&path, ending) } else { vec![path] };
    entries.flat_map(below).filter(|path| path.extension().is_some_and(|e| e == ending)).collect()
}

#[test]
fn nothing_that_opens_connections_is_built_in() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let lock = std::fs::read_to_string(root.join("Cargo.lock")).expect("the lock");
    assert!(lock.contains("name = \"clap\"\n"), "packages are named so");
    for name in CRATES {
        assert!(!lock.contains(&format!("name = \"{name}\"\n")), "{name} is a dependency");
    }
    let sources = files(&root.join("src"), "rs");
    assert!(sources.len() > 100);
    for source in sources {
        let text = std::fs::read_to_string(&source).expect("a source");
        for word in ["std::net", "TcpStream", "UdpSocket", "UnixStream", "UnixDatagram"] {
            assert!(!text.contains(word), "{} has {word}", source.display());
        }
    }
    // What resolves the names of other machines would be imported from the C library.
    let program = std::fs::read(PROGRAM).expect("the program");
    let imports = |name: &str| {
        let name = [&b"\0"[..], name.as_bytes(), b"\0"].concat();
        program.windows(name.len()).any(|bytes| bytes == name)
    };
    assert!(imports("rename") && !imports("getaddrinfo"));
}

/// By the system's own account of each call.
#[test]
fn no_command_opens_a_socket() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("balls.toml", &nested_balls(16));
    write("study.toml", "scene = \"balls.toml\"\npaths = { points = [{ at_mm = [0, 0, 0] }] }\n");
    let traced = |program: &str, args: &[&str]| {
        let strace =
            ["-f", "-qq", "-o", "calls", "-e", "trace=socket,connect,bind,listen,accept,sendto", program];
        let run = Command::new("strace").current_dir(folder.path()).args(strace).args(args).output().ok()?;
        let calls = std::fs::read_to_string(folder.path().join("calls")).unwrap_or_default();
        Some((run.status.code(), calls))
    };
    // A shell that does open one, to nobody: what sees this would see ours.
    let probe = traced("bash", &["-c", ": < /dev/tcp/127.0.0.1/9"]);
    if !probe.is_some_and(|(_, calls)| calls.contains("socket(")) {
        let words = "strace is not here, or may not trace: no call was looked at\n";
        std::io::Write::write_all(&mut std::io::stderr(), words.as_bytes()).expect("standard error");
        return;
    }
    let commands: [&[&str]; 9] = [
        &["project", "balls.toml", "--method", "ritree", "--save-trees", "balls.trees"],
        &["audit", "balls.toml", "-o", "audit"],
        &["dose", "study.toml", "-o", "dose"],
        &["trace", "random-volumes", "--count", "1", "--size", "8x8", "-o", "trace"],
        &["bench", "curve", "balls.toml", "--sizes", "8x8", "--rounds", "1", "-o", "bench"],
        &["check", "balls.toml"],
        &["phantom", "export", "calibration", "phantom"],
        &["completions", "bash"],
        &["--help"],
    ];
    for args in commands {
        let (code, calls) = traced(PROGRAM, args).expect("as before");
        assert_eq!(code, Some(0), "{args:?}: {calls}");
        assert!(!calls.contains("socket(") && !calls.contains("connect("), "{args:?}: {calls}");
    }
}
