//! What `truestage --version` says: the version, which commit was checked out when it was built, and for which target.

use std::env;
use std::path::Path;
use std::process::Command;

fn main() {
    let target = env::var("TARGET").unwrap_or_default();
    let built = match commit() {
        Some(commit) => format!("commit {commit}, {target}"),
        // Sources without their history: an archive, or a crate.
        None => target,
    };
    let version = env!("CARGO_PKG_VERSION");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-env=TRUESTAGE_VERSION={version} ({built})");
}

/// Of this project's own history, not of what its sources may lie in.
fn commit() -> Option<String> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).parent()?;
    let top = git(&["rev-parse", "--show-toplevel"])?;
    if here.canonicalize().ok()? != Path::new(&top).canonicalize().ok()? {
        return None;
    }
    // It changes with each commit, and lies elsewhere in a worktree.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).exists() {
        println!("cargo:rerun-if-changed={log}");
    }
    git(&["rev-parse", "--short=12", "HEAD"])
}

fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    let said = said.trim();
    (output.status.success() && !said.is_empty()).then(|| said.to_owned())
}
