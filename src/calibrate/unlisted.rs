//! Cameras and features that a recording has and the rig does not list.
use crate::Error;
use crate::recording::{Recording, Sample};
use crate::rig::{Camera, Feature, Parent, Rig, problem_of_fixed};

/// Lists on the tip the cameras that only the recording has: a camera on the hand, of which no rig file says so. False where the rig lists all.
pub fn put_on_tip(rig: &mut Rig, recording: &Recording) -> bool {
    let listed = rig.cameras.len();
    list_cameras(rig, recording);
    rig.cameras[listed..].iter_mut().for_each(|camera| camera.parent = Parent::Tip);
    rig.cameras.len() > listed
}

/// Holds the parameters that a pattern covers at their values; of cameras and features that only the recording has too.
///
/// Errors: [`Error::Unusable`] where it covers nothing, or something that has no value.
pub fn hold(rig: &mut Rig, recording: &Recording, pattern: &str) -> Result<(), Error> {
    let mut listed = rig.clone();
    list_cameras(&mut listed, recording);
    list_features(&mut listed, recording);
    match problem_of_fixed(pattern, &listed) {
        Some(problem) => Err(Error::Unusable(problem)),
        None => {
            rig.estimate.fixed.push(pattern.to_owned());
            Ok(())
        }
    }
}

/// Lists the cameras that only the recording has, in the world.
pub(crate) fn list_cameras(rig: &mut Rig, recording: &Recording) {
    for recorded in &recording.cameras {
        if !rig.cameras.iter().any(|camera| camera.name == recorded.name) {
            rig.cameras.push(Camera { name: recorded.name.clone(), ..Camera::default() });
        }
    }
}

/// Lists the features that only the recording has: on the tip, but in the world where cameras on the tip alone see them.
pub(crate) fn list_features(rig: &mut Rig, recording: &Recording) {
    let is_on_tip: Vec<bool> = recording.cameras.iter().map(|recorded| is_on_tip(rig, &recorded.name)).collect();
    let (mut by_tip, mut by_others) = (vec![false; recording.features.len()], vec![false; recording.features.len()]);
    for Sample { pixels, points, .. } in &recording.samples {
        let seen = pixels.iter().map(|seen| (seen.camera, seen.feature));
        for (camera, feature) in seen.chain(points.iter().map(|seen| (seen.camera, seen.feature))) {
            let by = if is_on_tip[camera as usize] { &mut by_tip } else { &mut by_others };
            by[feature as usize] = true;
        }
    }
    for (index, name) in recording.features.iter().enumerate() {
        if !rig.features.iter().any(|feature| feature.name == *name) {
            let parent = if by_tip[index] && !by_others[index] { Parent::World } else { Parent::Tip };
            rig.features.push(Feature { name: name.clone(), parent, xyz: None });
        }
    }
}

fn is_on_tip(rig: &Rig, camera: &str) -> bool {
    rig.cameras.iter().any(|known| known.name == camera && known.parent == Parent::Tip)
}
