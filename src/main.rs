//! The command `handeye`: standard output is data, standard error is talk.
mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    let (result, is_json) = match cli::parse(std::env::args_os()) {
        Ok(arguments) => (arguments.run(), arguments.json),
        Err(refusal) => return refusal.print(),
    };
    cli::print(result, is_json)
}
