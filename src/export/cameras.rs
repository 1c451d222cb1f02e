//! Cameras of a rig as calibration files.
use super::unit::comment;
use crate::Error;
use crate::intrinsics::{Intrinsics, to_kalibr};
use crate::rig::{Camera, Parent, Rig};

/// What a calibration file says of a camera.
///
/// Errors: [`Error::Unusable`] where the rig does not know it.
pub fn to_intrinsics(camera: &Camera) -> Result<Intrinsics, Error> {
    let Camera { name, fx, fy, cx, cy, .. } = camera;
    let (&Some(fx), &Some(fy), &Some(cx), &Some(cy)) = (fx, fy, cx, cy) else {
        return Err(Error::Unusable(format!("camera `{name}` has no fx, fy, cx, cy: a learned rig has")));
    };
    Ok(Intrinsics {
        name: Some(name.clone()),
        size: camera.size,
        model: camera.model.unwrap_or_default(),
        focal: [fx, fy],
        centre: [cx, cy],
        distortion: camera.distortion.clone().unwrap_or_default(),
    })
}

/// All cameras as a Kalibr camchain; those that stand in the world are posed against one another.
///
/// Where the lengths are no metres, a comment above says so.
///
/// Errors: [`Error::Unusable`] for a rig without cameras, for what is not known, and what Kalibr has no words for.
pub fn to_camchain(rig: &Rig) -> Result<String, Error> {
    if rig.cameras.is_empty() {
        return Err(Error::Unusable("the rig has no cameras".into()));
    }
    let in_world = |camera: &Camera| camera.pose.filter(|_| camera.parent == Parent::World);
    let cameras: Result<Vec<_>, Error> =
        rig.cameras.iter().map(|camera| Ok((to_intrinsics(camera)?, in_world(camera)))).collect();
    let cameras = cameras?;
    // Cameras without poses next to each other have no lengths.
    let has_lengths = cameras.windows(2).any(|pair| pair.iter().all(|(_, pose)| pose.is_some()));
    Ok(if has_lengths { comment(rig) } else { String::new() } + &to_kalibr(&cameras)?)
}
