//! The `kreisel` program: see [`kreisel::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    kreisel::cli::main()
}
