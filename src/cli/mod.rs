//! The command line: one file per subcommand, which answers; printing happens in `answer.rs`.
//!
//! Only [`run`] is public: programs of any language that bring the command along call it.
mod answer;
mod calibrate;
mod check;
mod completions;
mod convert;
mod counts;
mod demo;
mod detect;
mod evaluate;
mod experiment;
mod export;
mod folds;
mod infer;
mod inputs;
mod monitor;
mod noise;
mod progress;
mod reading;
mod servo;
mod simulate;
mod suggest;
mod survey;
mod table;
mod task;
mod trust;
mod unsaid;
mod words;
mod written;

use answer::{Answer, Refusal, print};
use clap::Parser;
use handeye::Error;
use std::ffi::OsString;
use words::as_typed;

const EXAMPLES: &str = "\
Examples:
  handeye demo                                                     needs no file
  handeye calibrate motions.jsonl -o learned.toml                  from the recording alone
  handeye calibrate motions.jsonl --rig arm.toml -o learned.toml   from what is known of the rig
  handeye evaluate learned.toml fresh.jsonl                        judge it on other samples
  handeye infer learned.toml fresh.jsonl                           joints and poses from pixels alone
  handeye servo learned.toml ur5-reach                             move features to pixels, in simulation
  handeye task wrench                                              what a task in images leaves open

Exit status: 0 done; 1 the work could not be done, with the reason; 2 unusable input or arguments.";

/// Learns one model of a robot arm, its cameras and the features they track from a recording
///
/// The model predicts every pixel from the joints. Nothing needs to be known beforehand; what is known is used. Rigs are
/// TOML files, recordings JSON Lines, ROS 2 bags (MCAP), CSV or LeRobot datasets; metres, radians, seconds, pixels.
#[derive(Parser)]
#[command(name = "handeye", version, after_help = EXAMPLES, arg_required_else_help = true, max_term_width = 120)]
struct Cli {
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    Demo(demo::Demo),
    Check(check::Check),
    Simulate(simulate::Simulate),
    Calibrate(calibrate::Calibrate),
    Evaluate(evaluate::Evaluate),
    Infer(infer::Infer),
    Monitor(monitor::MonitorCommand),
    Suggest(suggest::Suggest),
    Servo(servo::Servo),
    Task(task::Task),
    Experiment(experiment::ExperimentCommand),
    Convert(convert::Convert),
    Detect(detect::Detect),
    Export(export::Export),
    Completions(completions::Completions),
}

/// Runs the command `handeye` with these arguments, of which the first is the program's name, prints what comes of it, and returns the exit
/// status: 0 done; 1 the work could not be done; 2 unusable input or arguments.
pub fn run(arguments: impl Iterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.collect();
    match parse(&arguments) {
        Ok(cli) => print(cli.run(&as_typed(&arguments)), cli.json),
        Err(refusal) => refusal.print(),
    }
}

fn parse(arguments: &[OsString]) -> Result<Cli, Refusal> {
    let is_json = arguments.iter().any(|argument| argument == "--json");
    Cli::try_parse_from(arguments).map_err(|error| Refusal { error, is_json })
}

impl Cli {
    /// Does what was asked for; `typed` is the command itself, for pages.
    fn run(&self, typed: &str) -> Result<Answer, Error> {
        match &self.command {
            Command::Demo(demo) => demo.run(self.json),
            Command::Check(check) => check.run(self.json),
            Command::Simulate(simulate) => simulate.run(),
            Command::Calibrate(calibrate) => calibrate.run(self.json, typed),
            Command::Evaluate(evaluate) => evaluate.run(typed),
            Command::Infer(infer) => infer.run(),
            Command::Monitor(monitor) => monitor.run(),
            Command::Suggest(suggest) => suggest.run(),
            Command::Servo(servo) => servo.run(self.json, typed),
            Command::Task(task) => task.run(),
            Command::Experiment(experiment) => experiment.run(),
            Command::Convert(convert) => convert.run(),
            Command::Detect(detect) => detect.run(),
            Command::Export(export) => export.run(),
            Command::Completions(completions) => completions.run(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_do_not_clash_in_any_command() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
