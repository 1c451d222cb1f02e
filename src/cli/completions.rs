//! `handeye completions`: what a shell needs to complete the command line.
use super::Cli;
use super::answer::Answer;
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use handeye::Error;
use serde_json::json;

/// Print a script that completes handeye's command line in a shell
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye completions bash > ~/.local/share/bash-completion/completions/handeye
  handeye completions zsh > ~/.zfunc/_handeye
  handeye completions fish > ~/.config/fish/completions/handeye.fish")]
pub struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    pub fn run(&self) -> Result<Answer, Error> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "handeye", &mut script);
        let script = String::from_utf8_lossy(&script).into_owned();
        let json = json!({ "shell": self.shell.to_string(), "script": script });
        Ok(Answer::new(script, json))
    }
}
