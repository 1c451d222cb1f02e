//! Cameras of a rig as calibration files.
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
/// Errors: [`Error::Unusable`] for what is not known, and what Kalibr has no words for.
pub fn to_camchain(rig: &Rig) -> Result<String, Error> {
    let in_world = |camera: &Camera| camera.pose.filter(|_| camera.parent == Parent::World);
    let cameras: Result<Vec<_>, Error> =
        rig.cameras.iter().map(|camera| Ok((to_intrinsics(camera)?, in_world(camera)))).collect();
    to_kalibr(&cameras?)
}
