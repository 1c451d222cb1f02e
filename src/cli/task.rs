//! `handeye task`: what a task in images fixes, leaves free, and where else it may end.
use super::answer::Answer;
use super::inputs::{read_rig, unknown};
use super::words::count;
use clap::Args;
use handeye::Error;
use handeye::servo::image_tasks::{CheckSettings, Geometry, ImageTask, Motion, TaskCheck, catalog, check};
use handeye::solvers::{Pose, manifold::so3};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Say which degrees of freedom a task in images fixes, which motions it leaves free, and where else it may end
///
/// Without --rig, features that have no `xyz` are drawn in general position, and cameras likewise. What is found then holds for almost all
/// places; shapes with symmetries may end in more: give their `xyz`.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye task wrench                          a shipped task
  handeye task task.toml --rig learned.toml    with the cameras and features of a rig
  handeye task task.toml --json")]
pub struct Task {
    /// A task file, or the name of a shipped task (wrench, peg-in-hole, ring)
    #[arg(value_name = "TASK")]
    task: PathBuf,
    /// The cameras, and the features that have no `xyz` in the task: a rig file or a shipped rig
    #[arg(long, value_name = "RIG")]
    rig: Option<PathBuf>,
    /// Placements from which solved ones are searched for
    #[arg(long, value_name = "N", default_value_t = 80, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    starts: u32,
    /// Seed of these and of what is drawn
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
}

impl Task {
    pub fn run(&self) -> Result<Answer, Error> {
        let task = read_task(&self.task)?;
        let geometry = match &self.rig {
            Some(path) => Geometry::of_rig(&task, &read_rig(path)?.rig)?,
            None => Geometry::drawn(&task, self.seed),
        };
        let settings = CheckSettings { starts: self.starts as usize, seed: self.seed, ..CheckSettings::default() };
        let found = check(&task, &geometry, &settings)?;
        let title = task.name().map_or_else(|| self.task.display().to_string(), str::to_owned);
        let source = match &self.rig {
            Some(path) => format!("cameras of {}", path.display()),
            None => "cameras drawn, about a right angle apart".to_owned(),
        };
        Ok(Answer::new(text(&title, &source, &task, &found), to_json(&task, &found)))
    }
}

/// Reads a task file, or takes the shipped task of that name where there is no such file.
fn read_task(argument: &Path) -> Result<ImageTask, Error> {
    let name = argument.display().to_string();
    if argument.exists() {
        return ImageTask::read(argument);
    }
    match catalog::ALL.iter().find(|(known, _)| *known == name) {
        Some((_, text)) => ImageTask::parse(text, &format!("models/tasks/{name}.toml")),
        None => Err(unknown(argument, "task", catalog::ALL)),
    }
}

fn text(title: &str, source: &str, task: &ImageTask, found: &TaskCheck) -> String {
    let cameras = count(task.cameras().len(), "camera");
    let mut text = format!("{title}: {} in {cameras} ({source})\n\n", count(found.rows, "row"));
    text += &format!("  fixes    {} of 6 degrees of freedom\n", found.fixed);
    let free = if found.free.words.is_empty() { vec!["nothing".to_owned()] } else { found.free.words.clone() };
    for (index, words) in free.iter().enumerate() {
        text += &format!("  {:<8} {words}\n", if index == 0 { "free" } else { "" });
    }
    if let Some(weakest) = &found.weakest {
        let shown = if matches!(weakest.motion, Motion::Translation { .. }) {
            format!("{:.2} px per mm", 1e-3 * weakest.px)
        } else {
            format!("{:.2} px per degree", weakest.px * 1_f64.to_radians())
        };
        text += &format!("  weakest  {}: {shown}\n", weakest.words);
    }
    if found.alternatives.is_empty() {
        text += "  unique   no other placement was found\n";
    } else {
        text += &format!("\nit may also end in {}:\n", count(found.alternatives.len(), "other placement"));
        for other in &found.alternatives {
            let fixed = if other.fixed == found.fixed { String::new() } else { format!(" ({} fixed)", other.fixed) };
            text += &format!("  {}{fixed}\n", other.words);
        }
    }
    if let [[most, _], .., [least, times]] = found.ranks.as_slice() {
        text += &format!("\nnot everywhere the same: {most} fixed in general, {least} at {times} placements\n");
    }
    let [starts, solved] = found.starts;
    text + &format!("\n{solved} of {starts} starts led to a placement that solves it")
        + &format!(", with {:.1e} px left at most in the first\n", found.error_px)
}

fn pose(pose: &Pose) -> Value {
    json!({ "xyz": pose.translation.as_slice(), "rotation_vector": so3::log(&pose.rotation).as_slice() })
}

fn motion(motion: &Motion) -> Value {
    match motion {
        Motion::Translation { direction } => json!({ "kind": "translation", "direction": direction.as_slice() }),
        Motion::Rotation { point, direction } => {
            json!({ "kind": "rotation", "point": point.as_slice(), "direction": direction.as_slice() })
        }
        Motion::Screw { point, direction, pitch } => json!({
            "kind": "screw",
            "point": point.as_slice(),
            "direction": direction.as_slice(),
            "pitch": pitch,
        }),
    }
}

fn to_json(task: &ImageTask, found: &TaskCheck) -> Value {
    json!({
        "name": task.name(),
        "rows": found.rows,
        "fixed": found.fixed,
        "free": found.free.motions.iter().map(motion).collect::<Vec<_>>(),
        "free_words": found.free.words,
        "weakest": found.weakest.as_ref().map(|weakest| {
            json!({ "motion": motion(&weakest.motion), "px": weakest.px, "words": weakest.words })
        }),
        "placement": pose(&found.placement),
        "error_px": found.error_px,
        "alternatives": found.alternatives.iter().map(|other| json!({
            "placement": pose(&other.placement),
            "angle": other.displacement.angle,
            "along": other.displacement.along,
            "axis": { "point": other.displacement.point.as_slice(), "direction": other.displacement.direction.as_slice() },
            "fixed": other.fixed,
            "starts": other.starts,
            "error_px": other.error_px,
            "words": other.words,
        })).collect::<Vec<_>>(),
        "starts": found.starts[0],
        "solved": found.starts[1],
        "ranks": found.ranks.iter().map(|[rank, times]| json!({ "fixed": rank, "placements": times })).collect::<Vec<_>>(),
    })
}
