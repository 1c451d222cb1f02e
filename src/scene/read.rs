//! Reading scene files, with a place for every mistake.
use super::Scene;
use super::check::{MOVES_NOTHING, carries};
use super::read_control::read_control;
use super::read_faults::{read_couplings, read_faults, read_slips};
use super::read_limits::read_limits;
use super::read_target::{read_target, read_task};
use crate::Error;
use crate::rig::read::document::{Field, Fields, Node, Source, parse};
use crate::rig::read::noise::read_pose_noise;
use crate::rig::{Rig, catalog, files_named, read_text};
use crate::servo::{LoopSettings, Takes, image_tasks};
use crate::simulate::world::{Execution, Tracker, WorldOptions};
use std::path::{Path, PathBuf};

impl Scene {
    /// Reads a scene file.
    ///
    /// Errors: [`Error::Io`], and [`Error::Malformed`] for whatever is wrong inside or in the rig file that it names.
    pub fn read(path: &Path) -> Result<Scene, Error> {
        let folder = path.parent().unwrap_or(Path::new(""));
        Scene::parse(&read_text(path)?, &path.display().to_string(), folder)
    }

    /// Reads the text of a scene file, which messages call `file_name`; a rig file that it names stands in `folder`.
    pub fn parse(text: &str, file_name: &str, folder: &Path) -> Result<Scene, Error> {
        let source = Source { file: file_name, text };
        let document = parse(&source)?;
        let root = Node::root(&source, document.as_table()).table(&[
            "name",
            "rig",
            "seed",
            "dt",
            "robot",
            "tracker",
            "task",
            "target",
            "controller",
            "limits",
            "loop",
        ])?;
        let section = |name: &str, known: &[&str]| -> Result<Option<Fields<'_>>, Error> {
            root.field(name).map(|field| Ok(field.value.table(known)?.labelled(name))).transpose()
        };
        let rig = root.optional("rig", |node| read_rig(node, folder))?;
        let robot = section("robot", &["start", "takes", "readings", "latency", "execution", "slips", "couplings"])?
            .ok_or_else(|| root.error("has no table `robot`, which says where the arm starts"))?;
        let target = section("target", &["joints", "velocity", "until", "path"])?
            .ok_or_else(|| root.error("has no table `target`, which says where the features shall be seen"))?;
        let task = root.optional("task", |node| read_task(node, folder))?;
        if let (None, Some(path)) = (&task, target.field("path")) {
            return Err(path
                .value
                .error("moves the target of a `task`, and the scene has none; `velocity` moves joints"));
        }
        let moved = ["path", "velocity"].into_iter().find_map(|key| target.field(key));
        if let (Some(false), Some(field)) = (task.as_ref().map(carries), moved) {
            return Err(field.value.error(MOVES_NOTHING));
        }
        let tracker = section("tracker", &["kind", "sd", "at", "points", "missed", "faults"])?;
        let tracker = tracker.as_ref();
        let (kind, missed) = tracker.map_or(Ok((Tracker::Exact, 0.0)), read_tracker)?;
        let has_depth = rig.as_ref().is_none_or(|rig| rig.cameras.iter().any(|camera| camera.depth));
        let points = tracker.map(|fields| fields.optional("points", |node| read_points(node, has_depth)));
        let points = points.transpose()?.flatten();
        let control = match root.field("controller") {
            Some(field) => Some(read_control(field.value, task.is_some())?),
            None => None,
        };
        let takes =
            robot.optional("takes", |node| node.word("kind of command", Takes::ALL, Takes::name))?.unwrap_or_default();
        let default = WorldOptions::default();
        let scene = Scene {
            name: root.optional("name", |node| node.text().map(str::to_owned))?,
            world: WorldOptions {
                execution: robot.optional("execution", read_execution)?.unwrap_or_default(),
                readings: robot.optional("readings", read_readings)?.unwrap_or(default.readings),
                slips: Vec::new(),
                tracker: kind,
                points: points.unwrap_or(default.points),
                faults: Vec::new(),
                missed,
                latency: robot.optional("latency", Node::not_negative)?.unwrap_or(default.latency),
                seed: root.optional("seed", Node::whole)?.unwrap_or(default.seed),
            },
            faults: tracker.map(read_faults).transpose()?.unwrap_or_default(),
            slips: read_slips(&robot)?,
            couplings: read_couplings(&robot)?,
            task,
            takes,
            start: joints(&robot, "start", rig.as_ref())?,
            target: read_target(&target, rig.as_ref(), folder)?,
            control,
            limits: match root.field("limits") {
                Some(field) => read_limits(field.value)?,
                None => Vec::new(),
            },
            settings: match root.field("loop") {
                Some(field) => read_settings(field.value)?,
                None => LoopSettings::default(),
            },
            dt: root.optional("dt", Node::positive)?.unwrap_or(1.0),
            files: [
                file_beside(root.field("rig"), catalog::ALL, folder),
                file_beside(root.field("task"), image_tasks::catalog::ALL, folder),
                file_beside(target.field("path"), &[], folder),
            ]
            .into_iter()
            .flatten()
            .flat_map(|file| [vec![file.clone()], files_named(&file)].concat())
            .collect(),
            rig,
        };
        Ok(scene)
    }
}

/// The file that a key names, where it names one and not what is shipped.
fn file_beside(field: Option<Field>, shipped: &[(&str, &str)], folder: &Path) -> Option<PathBuf> {
    let name = field?.value.text().ok()?;
    (!shipped.iter().any(|(known, _)| *known == name)).then(|| folder.join(name))
}

/// A shipped rig, or a file beside the scene.
fn read_rig(node: &Node, folder: &Path) -> Result<Rig, Error> {
    let name = node.text()?;
    if catalog::ALL.iter().any(|(known, _)| *known == name) {
        return catalog::rig(name);
    }
    Rig::read(&folder.join(name)).map_err(|error| match error {
        Error::Io { source, .. } => {
            let known: Vec<&str> = catalog::ALL.iter().map(|(known, _)| *known).collect();
            node.error(format!(
                "`{name}` is no rig file beside the scene ({source}), nor a shipped rig ({})",
                known.join(", ")
            ))
        }
        error => error,
    })
}

/// Joints that have to be given, as many as the rig has where the scene names one.
pub(super) fn joints(fields: &Fields, key: &str, rig: Option<&Rig>) -> Result<Vec<f64>, Error> {
    let field =
        fields.field(key).ok_or_else(|| fields.error(format!("has no `{key}` (one number per joint, rad or m)")))?;
    per_joint(&field.value, rig)
}

/// One number per joint, of the rig where the scene names one.
pub(super) fn per_joint(node: &Node, rig: Option<&Rig>) -> Result<Vec<f64>, Error> {
    let found = node.any_numbers()?;
    match rig.map(|rig| rig.robot.joints.len()) {
        Some(n) if n != found.len() => Err(node.error(format!("has {} numbers, the rig has {n} joints", found.len()))),
        None if found.is_empty() => Err(node.error("has no number, and every joint needs one")),
        _ => Ok(found),
    }
}

/// A standard deviation, or `false` for a robot that gives no readings.
fn read_readings(node: &Node) -> Result<Option<f64>, Error> {
    match node.flag() {
        Ok(false) => Ok(None),
        Ok(true) => Ok(Some(0.0)),
        Err(_) => node.not_negative().map(Some),
    }
}

/// Noise of the points that depth cameras give.
fn read_points(node: &Node, has_depth: bool) -> Result<f64, Error> {
    if has_depth { node.not_negative() } else { Err(node.error("is noise of depth cameras, and the rig has none")) }
}

fn read_execution(node: &Node) -> Result<Execution, Error> {
    let fields = node.clone().table(&["joints", "pose", "share", "dead_band", "gain"])?;
    let default = Execution::default();
    Ok(Execution {
        joints: fields.optional("joints", Node::not_negative)?.unwrap_or(default.joints),
        pose: fields.optional("pose", read_pose_noise)?.unwrap_or(default.pose),
        share: fields.optional("share", Node::not_negative)?.unwrap_or(default.share),
        dead_band: fields.optional("dead_band", Node::not_negative)?.unwrap_or(default.dead_band),
        gain: fields.optional("gain", Node::any_numbers)?.unwrap_or(default.gain),
        couplings: Vec::new(),
    })
}

fn read_tracker(fields: &Fields) -> Result<(Tracker, f64), Error> {
    let sd = fields.optional("sd", Node::not_negative)?;
    let at = fields.optional("at", Node::positive)?;
    let kind = fields.optional("kind", |node| node.word("tracker", &["exact", "rounded", "gaussian"], |name| name))?;
    let tracker = match (kind, sd, at) {
        (None | Some("gaussian"), Some(sd), Some(at)) => Tracker::ByDistance { sd, at },
        (None | Some("gaussian"), Some(sd), None) => Tracker::Gaussian(sd),
        (Some("gaussian"), None, _) => return Err(fields.error("is gaussian and has no `sd` (px)")),
        (None, None, Some(_)) => {
            return Err(fields.error("has `at` (m), the distance of its `sd`, and no `sd` (px)"));
        }
        (Some(kind), Some(_), _) => return Err(fields.error(format!("is {kind}, and `sd` is for gaussian ones"))),
        (Some(kind), None, Some(_)) => return Err(fields.error(format!("is {kind}, and `at` is for gaussian ones"))),
        (Some("rounded"), None, None) => Tracker::Rounded,
        _ => Tracker::Exact,
    };
    let missed = fields.optional("missed", |node| {
        let share = node.number()?;
        if (0.0..=1.0).contains(&share) {
            Ok(share)
        } else {
            Err(node.error(format!("must be from 0 to 1, found {share}")))
        }
    })?;
    Ok((tracker, missed.unwrap_or(0.0)))
}

fn read_settings(node: Node) -> Result<LoopSettings, Error> {
    let fields = node.table(&[
        "tolerance_px",
        "settled",
        "window",
        "diverged",
        "timeout",
        "watchdog",
        "patience",
        "look_then_move",
        "follow",
    ])?;
    let fields = fields.labelled("loop");
    let default = LoopSettings::default();
    Ok(LoopSettings {
        tolerance_px: fields.optional("tolerance_px", Node::positive)?.unwrap_or(default.tolerance_px),
        settled: fields.optional("settled", Node::whole)?.unwrap_or(default.settled),
        window: fields.optional("window", Node::whole)?.unwrap_or(default.window),
        diverged: fields.optional("diverged", Node::positive)?.unwrap_or(default.diverged),
        timeout: fields.optional("timeout", Node::positive)?.unwrap_or(default.timeout),
        watchdog: fields.optional("watchdog", Node::positive)?.unwrap_or(default.watchdog),
        patience: fields.optional("patience", Node::positive)?.unwrap_or(default.patience),
        look_then_move: fields.optional("look_then_move", Node::flag)?.unwrap_or(default.look_then_move),
        follow: fields.optional("follow", Node::flag)?.unwrap_or(default.follow),
    })
}
