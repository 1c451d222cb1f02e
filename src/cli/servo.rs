//! `handeye servo`: a closed loop in simulation.
use super::answer::Answer;
use super::inputs::{check_output, is_same, read_rig, unknown, write_output};
use super::progress::Line;
use super::table::Table;
use super::words::{count, file_name};
use clap::Args;
use handeye::Error;
use handeye::report::{About, servo_html};
use handeye::rig::{Rig, files_named};
use handeye::scene::{self, Moment, Run, Scene};
use handeye::servo::{Command, Stop};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Servo in simulation, and report the pixel error against step
///
/// The controller knows LEARNED; the world is the rig that the scene names, or LEARNED itself where it names none. Without LEARNED the
/// controller is uncalibrated: it explores, and knows nothing but the joints' limits; so is that of a scene with a task in images. The loop says why it stopped: converged, no better
/// given the noise, blocked by limits, diverged, undetermined, lost, timed out.
#[derive(Args)]
#[command(
    allow_missing_positional = true,
    after_help = "\
Examples:
  handeye servo learned.toml ur5-reach --plot reach.svg    a shipped scene
  handeye servo learned.toml ur5-reach --report reach.html  an animation to look at
  handeye servo learned.toml scene.toml --json
  handeye servo ur5-uncalibrated                           without any rig
  handeye servo ur5-wrench                                 a task in images, without any rig
  handeye servo ur5 ur5-noisy --seed 7"
)]
pub struct Servo {
    /// The rig that the controller knows: a file in which every value is given, or the name of a shipped rig
    #[arg(value_name = "LEARNED")]
    rig: Option<PathBuf>,
    /// A scene file, or the name of a shipped scene (ur5-reach, ur5-visual, ur5-noisy, ur5-uncalibrated, ur5-wrench, ur5-moving)
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Seed of all noise, in place of the scene's
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Draw the errors against time and the features' paths in every image
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Also write a page to read: the loop as an animation over the images, errors and joints against time, what held it back
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
}

/// Rows of the printed table at most.
const ROWS: usize = 24;

impl Servo {
    pub fn run(&self, is_json: bool, typed: &str) -> Result<Answer, Error> {
        let input = self.rig.as_deref().map(read_rig).transpose()?;
        let mut scene = read_scene(&self.scene)?;
        let of_rig = self.rig.as_deref().map_or_else(Vec::new, files_named);
        let inputs: Vec<PathBuf> =
            self.rig.iter().chain([&self.scene]).chain(&scene.files).chain(&of_rig).cloned().collect();
        for output in self.plot.iter().chain(&self.report) {
            check_output(output, &inputs)?;
        }
        if let (Some(plot), Some(page)) = (&self.plot, &self.report)
            && is_same(plot, page)
        {
            return Err(Error::Unusable(format!("{}: given for two outputs", page.display())));
        }
        scene.world.seed = self.seed.unwrap_or(scene.world.seed);
        let line = Line::new(is_json);
        let known = input.as_ref().map(|input| &input.rig);
        let run = scene::run(known, &scene, &mut |moment| {
            line.show(&progress(moment));
            ControlFlow::Continue(())
        })?;
        drop(line);
        let title = scene.name.clone().unwrap_or_else(|| self.scene.display().to_string());
        if let Some(path) = &self.plot {
            write_output(path, &scene::svg(&title, &run))?;
        }
        let world = scene.rig.as_ref().or(known);
        if let (Some(path), Some(world)) = (&self.report, world) {
            let with_rig = self.rig.as_deref().map(|rig| format!(", with the rig {}", file_name(rig)));
            let titled = format!("{title}{}", with_rig.unwrap_or_default());
            let about = About { title: &titled, command: typed, notes: &[] };
            let page = servo_html(&about, world, known.is_some(), &run)?;
            write_output(path, &page)?;
        }
        let nothing = Rig::default();
        let rig = known.or(scene.rig.as_ref()).unwrap_or(&nothing);
        let words = run.stop.words(rig, &run.limits);
        let mut answer = Answer::new(text(&title, &run, &words), to_json(&run, &words, rig));
        // Who follows a target goes on to the end of the time.
        let is_over = matches!(run.stop, Stop::TimedOut { error_px: Some(_), .. }) && scene.settings.follow;
        if !run.stop.is_success() && !is_over {
            answer.failure = Some(words);
        }
        Ok(answer)
    }
}

/// Reads a scene file, or takes the shipped scene of that name where there is no such file.
fn read_scene(argument: &Path) -> Result<Scene, Error> {
    let name = argument.display().to_string();
    if argument.exists() {
        return Scene::read(argument);
    }
    match scene::ALL.iter().find(|(known, _)| *known == name) {
        Some((_, text)) => Scene::parse(text, &format!("models/scenes/{name}.toml"), Path::new("")),
        None => Err(unknown(argument, "scene", scene::ALL)),
    }
}

fn progress(moment: &Moment) -> String {
    let error = moment.error_px.map_or("nothing seen".to_owned(), |error| format!("{error:.3} px"));
    let state = match &moment.waits {
        Some(why) => format!("waits: {why}"),
        None => format!("{} held back", count(moment.active.len(), "constraint")),
    };
    format!("{:8.2} s  {error:>12}  {:8.2} mm  {state}", moment.time, 1e3 * moment.error_m)
}

fn text(title: &str, run: &Run, words: &str) -> String {
    let mut table = Table::new(&["step", "time s", "px", "mm", ""]);
    let n = run.moments.len();
    let stride = n.div_ceil(ROWS).max(1);
    for (index, moment) in run.moments.iter().enumerate().filter(|(index, _)| index % stride == 0 || index + 1 == n) {
        let state = match (&moment.waits, moment.active.len()) {
            (Some(why), _) => format!("  waits: {why}"),
            (None, 0) => String::new(),
            (None, held) => format!("  held back by {}", count(held, "constraint")),
        };
        let px = moment.error_px.map_or("-".to_owned(), |error| format!("{error:.3}"));
        let numbers = [format!("{:.2}", moment.time), px, format!("{:.3}", 1e3 * moment.error_m)];
        table.row([index.to_string()].into_iter().chain(numbers).chain([state]));
    }
    format!("{title}\n\n{table}\n{words}, after {}\n", count(run.commands, "command"))
}

fn to_json(run: &Run, words: &str, rig: &Rig) -> Value {
    let step = |moment: &Moment| {
        json!({
            "time": moment.time,
            "error_px": moment.error_px,
            "error_m": moment.error_m,
            "joints": moment.joints,
            "active": moment.active.iter().map(|active| active.constraint.words(rig, &run.limits)).collect::<Vec<_>>(),
            "conflict": moment.conflict.iter().map(|constraint| constraint.words(rig, &run.limits)).collect::<Vec<_>>(),
            "moves": moment.command != Command::Hold,
            "waits": moment.waits,
        })
    };
    json!({
        "stop": run.stop.name(),
        "reason": words,
        "commands": run.commands,
        "error_px": run.moments.last().and_then(|moment| moment.error_px),
        "error_m": run.moments.last().map(|moment| moment.error_m),
        "steps": run.moments.iter().map(step).collect::<Vec<_>>(),
    })
}
