//! The README's commands do what it says. Its Rust code is a doctest of the library.
use crate::cli::Folder;
use std::process::Command;

/// Commands of the README's console blocks, in order.
fn commands() -> Vec<String> {
    let text = include_str!("../../README.md");
    let blocks = text.split("```console\n").skip(1).map(|rest| rest.split("```").next().unwrap_or_default());
    blocks.flat_map(str::lines).filter_map(|line| line.strip_prefix("$ ")).map(str::to_owned).collect()
}

#[test]
fn the_first_two_commands_are_the_demonstration_and_the_tests() {
    assert_eq!(commands()[..2], ["cargo run --release -- demo", "cargo test"]);
}

#[test]
fn every_console_block_runs_in_an_empty_folder() {
    let folder = Folder::new("readme");
    for command in commands() {
        let arguments = match command.strip_prefix("cargo run --release -- ").or(command.strip_prefix("handeye ")) {
            Some(arguments) => arguments,
            // That is what is running.
            None if command == "cargo test" => continue,
            None => panic!("the README has a command that is not run here: {command}"),
        };
        let mut program = Command::new(env!("CARGO_BIN_EXE_handeye"));
        let output = program.args(arguments.split_whitespace()).current_dir(folder.path()).output().unwrap();
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "$ {command}\n{complaint}");
        assert!(!output.stdout.is_empty(), "$ {command}: says nothing");
    }
}
