//! Finds what the end-to-end tests need, so that a test that cannot run here shows as ignored, with the reason, and not
//! as passed. Where CI is set nothing is ignored: there it must all be had.

use std::path::Path;
use std::process::{Command, Stdio};

/// Recordings that the package does not ship.
const DATA: &str = "../shared/data";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=CI");
    println!("cargo::rerun-if-env-changed=PATH");
    if Path::new(DATA).exists() {
        println!("cargo::rerun-if-changed={DATA}");
    }
    let is_ci = std::env::var_os("CI").is_some();
    let found = [
        ("shared_data", Path::new(DATA).is_dir()),
        ("network_namespaces", can_make_namespaces()),
        ("libcluon", is_on_path("cluon-OD4toJSON")),
    ];
    for (name, is_found) in found {
        println!("cargo::rustc-check-cfg=cfg({name})");
        if is_found || is_ci {
            println!("cargo::rustc-cfg={name}");
        }
    }
}

fn can_make_namespaces() -> bool {
    let mut unshare = Command::new("unshare");
    unshare.args(["--net", "true"]).stderr(Stdio::null());
    unshare.status().is_ok_and(|status| status.success()) && is_on_path("ip")
}

fn is_on_path(program: &str) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths).any(|path| path.join(program).is_file())
}
