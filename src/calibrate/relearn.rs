//! A part of a learned rig learned anew from few samples, with everything else held: a camera that was moved or added, another
//! object in the gripper, another place of the base.
use super::{Calibration, Observer, Options, calibrate, list_cameras, list_features};
use crate::Error;
use crate::recording::Recording;
use crate::rig::{Camera, Model, Parameter, Rig, matches};

/// Learns the parameters that match any of `paths` (globs as in the rig file) from `recording`, from no start: their old values
/// are forgotten. Everything else is held, and stays as it is to the last bit. Cameras and features of the recording that the rig
/// does not know are learned too, as if in the world and on the tip (in the world, where cameras on the tip alone see them); to put them elsewhere, list them in the rig with their parent.
///
/// Intrinsics of a camera that is relearned start at what the recording's header says of it, else at the old ones, and are known
/// as roughly as those of a new camera. Relearning all of `robot.joints` takes the features on the arm along: a chain has no
/// room for given frames at both its ends. Relearning a part of the chain starts at the old values.
///
/// Errors: those of [`calibrate()`], and [`Error::Unusable`] where a path names nothing, or the rest of the rig is not complete.
pub fn relearn(
    rig: &Rig,
    recording: &Recording,
    paths: &[String],
    options: &Options,
    observer: Observer<'_>,
) -> Result<Calibration, Error> {
    let mut part = with_new_parts(rig, recording);
    check_paths(&part, paths)?;
    let mut free: Vec<String> = paths.to_vec();
    let whole = |name: &str| is_free(paths, &format!("robot.joints.{name}"));
    if !rig.robot.joints.is_empty() && rig.robot.joints.iter().all(|joint| whole(&joint.name)) {
        free.extend(["features".to_owned(), "robot.base".to_owned()]);
    }
    part.fit = None;
    part.estimate.prior.clear();
    forget(&mut part, recording, &free);
    let everything = part.parameters();
    let held =
        everything.iter().filter(|parameter| part.has_value(parameter) && !is_free(&free, &parameter.path(&part)));
    part.estimate.fixed = held.map(|parameter| parameter.path(&part)).collect();
    if part.robot.base.is_none() && !is_free(&free, "robot.base") {
        part.estimate.fixed.push("robot.base".to_owned());
    }
    check_rest(rig, &part, &free)?;
    check_seen(rig, &part, &free, recording)?;
    let mut learned = calibrate(&part, recording, options, observer)?;
    learned.rig.estimate.clone_from(&rig.estimate);
    restore(&mut learned.rig, rig, &free);
    if let (Some(now), Some(before)) = (&mut learned.rig.fit, &rig.fit) {
        widen(&mut now.joints, &before.joints);
    }
    Ok(learned)
}

/// The rig with the cameras and features that only the recording has, of which nothing is known.
fn with_new_parts(rig: &Rig, recording: &Recording) -> Rig {
    let mut all = rig.clone();
    list_cameras(&mut all, recording);
    list_features(&mut all, recording);
    all
}

/// Few samples have not been everywhere that the rig was learned.
fn widen(ranges: &mut [[f64; 2]], before: &[[f64; 2]]) {
    for (range, before) in ranges.iter_mut().zip(before) {
        *range = [range[0].min(before[0]), range[1].max(before[1])];
    }
}

/// Held values as they were written, which the way through rotations may have changed in the last bit.
fn restore(learned: &mut Rig, rig: &Rig, free: &[String]) {
    let held = |path: String| !is_free(free, &path);
    if held("robot.base".to_owned()) {
        learned.robot.base = rig.robot.base;
    }
    for (learned, camera) in learned.cameras.iter_mut().zip(&rig.cameras) {
        if held(format!("cameras.{}.pose", camera.name)) {
            learned.pose = camera.pose.or(learned.pose);
        }
    }
}

/// True where a parameter, or everything below it, is learned anew.
fn is_free(paths: &[String], path: &str) -> bool {
    paths.iter().any(|pattern| matches(pattern, path))
}

/// Every path must name something that the rig or the recording has.
fn check_paths(rig: &Rig, paths: &[String]) -> Result<(), Error> {
    let all: Vec<String> = rig.parameters().iter().map(|parameter| parameter.path(rig)).collect();
    for path in paths {
        if path != "robot.base" && !all.iter().any(|known| matches(path, known)) {
            return Err(Error::Unusable(format!(
                "--relearn `{path}` names nothing in the rig or the recording, which have {}: a path is such as `cameras.left`, \
                 `features.tool*`, `robot.base` or `robot.joints.*.offset`",
                names(rig)
            )));
        }
    }
    Ok(())
}

/// Joints, cameras and features by name, the first few of each.
fn names(rig: &Rig) -> String {
    const MOST: usize = 8;
    let list = |what: &str, names: Vec<&str>| {
        let more = if names.len() > MOST { ", ..." } else { "" };
        format!("{what} {}{more}", names[..names.len().min(MOST)].join(", "))
    };
    let joints = rig.robot.joints.iter().map(|joint| joint.name.as_str()).collect();
    let cameras = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let features = rig.features.iter().map(|feature| feature.name.as_str()).collect();
    [list("joints", joints), list("cameras", cameras), list("features", features)].join("; ")
}

/// Takes out the values that are learned anew.
fn forget(rig: &mut Rig, recording: &Recording, free: &[String]) {
    let old = rig.clone();
    let chain = old.robot.joints.iter().all(|joint| is_free(free, &format!("robot.joints.{}", joint.name)));
    for parameter in old.parameters().into_iter().filter(|parameter| is_free(free, &parameter.path(&old))) {
        match parameter {
            Parameter::JointField { .. } if !chain => {}
            Parameter::CameraField { camera, .. } => {
                let camera = &mut rig.cameras[camera];
                let Some(header) = recording.cameras.iter().find(|recorded| recorded.name == camera.name) else {
                    continue;
                };
                camera.fx = header.fx.or(camera.fx);
                camera.fy = header.fy.or(camera.fy);
                camera.cx = header.cx.or(camera.cx);
                camera.cy = header.cy.or(camera.cy);
                if header.model.is_none() || header.model == camera.model {
                    camera.distortion = header.distortion.clone().or(camera.distortion.take());
                }
            }
            parameter => rig.forget(&parameter),
        }
    }
    if chain {
        // Links' own frames stood against the rows that are forgotten.
        rig.robot.start = None;
        rig.robot.joints.iter_mut().for_each(|joint| joint.frame = None);
    }
}

/// What is held must be complete: what a rig lacks is not learned on the side, but for cameras and features that are new.
fn check_rest(rig: &Rig, part: &Rig, free: &[String]) -> Result<(), Error> {
    let missing = |parameter: &&Parameter| {
        let path = parameter.path(part);
        !matches!(parameter, Parameter::Base) && !part.has_value(parameter) && !is_free(free, &path)
    };
    let parameters = rig.parameters();
    match parameters.iter().find(missing) {
        Some(parameter) => Err(Error::Unusable(format!(
            "the rig has no value for `{}`, which is neither learned anew nor can be held: calibrate the whole rig first",
            parameter.path(rig)
        ))),
        None if rig.cameras.is_empty() && rig.features.is_empty() => Model::new(rig).map(|_| ()),
        None => Ok(()),
    }
}

/// A camera that is learned anew must have seen something; one that only the recording's header names need not.
fn check_seen(rig: &Rig, part: &Rig, free: &[String], recording: &Recording) -> Result<(), Error> {
    let seen = |name: &str| {
        let is_of = |camera: u32| recording.cameras[camera as usize].name == name;
        recording.samples.iter().any(|sample| {
            sample.pixels.iter().any(|seen| is_of(seen.camera)) || sample.points.iter().any(|seen| is_of(seen.camera))
        })
    };
    let is_asked_for = |(index, camera): &(usize, &Camera)| {
        camera.pose.is_none() && (*index < rig.cameras.len() || is_free(free, &format!("cameras.{}.pose", camera.name)))
    };
    let mut wanted = part.cameras.iter().enumerate().filter(is_asked_for).map(|(_, camera)| camera);
    match wanted.find(|camera| !seen(&camera.name)) {
        Some(camera) => Err(Error::NotEnoughData(format!(
            "camera `{}` is to be learned, and no sample of the recording has a detection of it",
            camera.name
        ))),
        None => Ok(()),
    }
}
