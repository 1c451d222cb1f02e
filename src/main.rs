//! The command `handeye`.
use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(handeye::cli::run(std::env::args_os()))
}
