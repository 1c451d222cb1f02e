//! Which of a rig's cameras and features a task means.
use super::{Feature, ImageTask, Place};
use crate::Error;
use crate::rig::{Parent, Rig};
use nalgebra::Vector3;

/// Cameras and features of a task as a rig has them, in the task's order.
pub(crate) struct InRig {
    /// Index of each camera, and whether it is on the hand.
    pub cameras: Vec<(usize, bool)>,
    /// Where each feature is.
    pub features: Vec<Found>,
}

/// Where a feature of a task is.
pub(crate) enum Found {
    /// In the images, and nowhere else.
    Image,
    /// At its `xyz` in the task [m].
    Task(Vector3<f64>),
    /// Where the rig's feature of this index is.
    Rig(usize),
}

impl ImageTask {
    /// The hand is the rig's tip, and what the target has without `xyz` in the task is fixed in the world.
    ///
    /// Errors: [`Error::Unusable`] where the rig has no camera or feature of a name, has it on a link before the tip, or has a feature on the
    /// tip that the task has on the target, or the other way round.
    pub(crate) fn in_rig(&self, rig: &Rig) -> Result<InRig, Error> {
        let camera = |name: &String| {
            let index = rig.cameras.iter().position(|camera| camera.name == *name).ok_or_else(|| {
                let known: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
                Error::Unusable(format!("the rig has no camera `{name}` (known: {})", known.join(", ")))
            })?;
            Ok((index, is_on_hand(rig, rig.cameras[index].parent, &format!("camera `{name}`"))?))
        };
        let cameras = self.cameras().iter().map(camera).collect::<Result<_, Error>>()?;
        let features = self.features().iter().map(|feature| find(rig, feature)).collect::<Result<_, Error>>()?;
        Ok(InRig { cameras, features })
    }
}

fn find(rig: &Rig, Feature { name, place }: &Feature) -> Result<Found, Error> {
    let on_hand = match place {
        Place::Image(_) => return Ok(Found::Image),
        Place::Hand(Some(xyz)) | Place::Target(Some(xyz)) => return Ok(Found::Task(*xyz)),
        Place::Hand(None) => true,
        Place::Target(None) => false,
    };
    let place = place.name();
    let index = rig.features.iter().position(|known| known.name == *name).ok_or_else(|| {
        Error::Unusable(format!("feature `{name}` on {place} is not in the rig: give its `xyz` in the task"))
    })?;
    if is_on_hand(rig, rig.features[index].parent, &format!("feature `{name}`"))? != on_hand {
        return Err(Error::Unusable(format!("feature `{name}` is on {place} in the task, and not so in the rig")));
    }
    Ok(Found::Rig(index))
}

fn is_on_hand(rig: &Rig, parent: Parent, what: &str) -> Result<bool, Error> {
    match parent {
        Parent::World => Ok(false),
        Parent::Tip => Ok(true),
        Parent::Link(link) if link + 1 == rig.robot.joints.len() => Ok(true),
        Parent::Link(_) => Err(Error::Unusable(format!(
            "{what} is on a link before the tip; a task is of what is on the tip or in the world"
        ))),
    }
}
