//! Whether a scene can be run.
use super::{Control, LimitKind, Scene, UncalibratedControl};
use crate::Error;
use crate::rig::Rig;
use crate::servo::Takes;
use crate::servo::image_tasks::{ImageTask, Place};

/// That a scene fits its true rig and the one that is known, that nothing in it is without effect, and that it ends.
pub(super) fn check(scene: &Scene, control: &Control, truth: &Rig, known: &Rig) -> Result<(), Error> {
    let n = truth.robot.joints.len();
    let lists = [
        ("start", scene.start.len()),
        ("target.joints", scene.target.joints.len()),
        ("target.velocity", if scene.target.velocity.is_empty() { n } else { scene.target.velocity.len() }),
    ];
    for (name, found) in lists {
        if found != n {
            return Err(Error::Unusable(format!("`{name}` of the scene has {found} numbers, the rig has {n} joints")));
        }
    }
    let images = scene.limits.iter().find(|(_, kind)| matches!(kind, LimitKind::InImage(_)));
    if let (Some((limit, _)), Some(camera)) = (images, known.cameras.iter().find(|camera| camera.size.is_none())) {
        return Err(Error::Unusable(format!(
            "limit `{limit}`: camera `{}` of the known rig has no `size`, so nothing says where its images end",
            camera.name
        )));
    }
    let is_without_rig = matches!(control, Control::Uncalibrated(UncalibratedControl { hybrid: false, .. }));
    if let (true, Some((limit, _))) = (is_without_rig, scene.limits.first()) {
        let who = if scene.task.is_some() { "a task is" } else { "servoing of kind uncalibrated is" };
        return Err(Error::Unusable(format!("limit `{limit}` needs a rig, and {who} carried out without one")));
    }
    if scene.task.is_some() && !is_without_rig {
        let name = control.name();
        return Err(Error::Unusable(format!(
            "a task is carried out by a controller of kind uncalibrated, this is {name}"
        )));
    }
    let (has_task, carries) = (scene.task.is_some(), scene.task.as_ref().is_some_and(carries));
    let idle = [("path", !scene.target.path.is_empty()), ("velocity", has_task && !scene.target.velocity.is_empty())];
    if let (false, Some((key, _))) = (carries, idle.iter().find(|(_, is_given)| *is_given)) {
        return Err(Error::Unusable(format!("`target.{key}` of the scene {MOVES_NOTHING}")));
    }
    let execution = &scene.world.execution;
    let moves_tip = matches!(scene.takes, Takes::PoseDelta | Takes::PoseVelocity);
    let without_effect = [
        ("`pose` of the scene's `execution`", execution.pose.is_noisy() && !moves_tip),
        ("`joints` of the scene's `execution`", execution.joints > 0.0 && moves_tip),
        ("`dead_band` of the scene's `execution`", execution.dead_band > 0.0 && moves_tip),
        ("`gain` of the scene's `execution`", !execution.gain.is_empty() && moves_tip),
        ("`couplings` of the scene's robot", !scene.couplings.is_empty() && moves_tip),
    ];
    if let Some((what, _)) = without_effect.iter().find(|(_, is_idle)| *is_idle) {
        let takes = scene.takes.name();
        return Err(Error::Unusable(format!("{what} has no effect on a robot that takes {takes}")));
    }
    let (timeout, dt) = (scene.settings.timeout, scene.dt);
    if !(dt > 0.0 && dt.is_finite()) {
        return Err(Error::Unusable(format!("a scene cannot go on in steps of {dt} s")));
    }
    let ticks = timeout / dt;
    if ticks > MOST_TICKS {
        return Err(Error::Unusable(format!(
            "a loop of {timeout} s in steps of {dt} s would have {ticks:.0} steps, at most {MOST_TICKS} are run"
        )));
    }
    Ok(())
}

/// Why `path` or `velocity` of a target is refused.
pub(super) const MOVES_NOTHING: &str = "moves nothing: what a target takes along are features on the target with their `xyz` in the task that are named in its `tasks`, and there are none";

/// Whether the target of a task takes anything along where it moves that the task looks at.
pub(super) fn carries(task: &ImageTask) -> bool {
    let is_carried = |feature: &usize| matches!(task.features()[*feature].place, Place::Target(Some(_)));
    task.parts().iter().any(|part| part.kind.features().iter().any(is_carried))
}

/// More steps than anybody wants to see.
const MOST_TICKS: f64 = 1e6;
