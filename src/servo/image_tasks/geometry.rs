//! Where a task's features and cameras are in space, for the checker and for simulation.
use super::{Feature, Found, ImageTask, InRig, Part, Place, Seen};
use crate::Error;
use crate::camera::{CameraModel, PARAMETERS};
use crate::rig::{Model, ModelCamera, Rig};
use handeye_solvers::{Pose, Scalar};
use nalgebra::Vector3;

/// Cameras and features of a task, by its indices. The hand is one rigid body; everything else stands still in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// The cameras.
    pub cameras: Vec<View>,
    /// Features on the hand in its frame, those on the target in the world [m]; of features on the image, nothing that counts.
    pub points: Vec<Vector3<f64>>,
}

/// A camera of a [`Geometry`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Its lens.
    pub model: CameraModel,
    /// Its intrinsics, as in [`crate::rig::ModelCamera`].
    pub intrinsics: [f64; PARAMETERS],
    /// `world_from_camera`, or `hand_from_camera`.
    pub pose: Pose,
    /// True where the hand carries it.
    pub on_hand: bool,
}

impl Geometry {
    /// From a complete rig, whose tip is the hand. Features that have a place in the task are there, others where the rig has those of the
    /// same names.
    ///
    /// Errors: [`Error::Unusable`] where the rig is not complete, has no camera or feature of a name, has it on a link before the tip, or on the
    /// tip where the task has it on the target.
    pub fn of_rig(task: &ImageTask, rig: &Rig) -> Result<Self, Error> {
        let InRig { cameras, features } = task.in_rig(rig)?;
        let model = Model::new(rig)?;
        let view = |(index, on_hand): (usize, bool)| {
            let ModelCamera { model, intrinsics, pose, .. } = model.cameras[index];
            View { model, intrinsics, pose, on_hand }
        };
        let point = |found: Found| match found {
            Found::Image => Vector3::zeros(),
            Found::Task(xyz) => xyz,
            Found::Rig(index) => model.features[index].xyz,
        };
        let (cameras, points) = (cameras.into_iter().map(view).collect(), features.into_iter().map(point).collect());
        Ok(Geometry { cameras, points })
    }

    /// What exact trackers see with the hand at `world_from_hand`; NaN where a feature is behind a camera.
    pub fn see(&self, task: &ImageTask, world_from_hand: &Pose) -> Seen {
        let mut seen = Seen::new(task);
        for (camera, view) in self.cameras.iter().enumerate() {
            for (index, feature) in task.features().iter().enumerate() {
                if matches!(feature.place, Place::Image(_)) {
                    continue;
                }
                let point = self.in_camera(feature, index, view, world_from_hand);
                seen.points[camera][index] = point.into();
                if view.model.is_in_front(&point) {
                    seen.pixels[camera][index] = view.model.project(&view.intrinsics, &point);
                }
            }
        }
        seen
    }

    /// True where every camera has in front of it what it shall see.
    pub(super) fn is_visible(&self, task: &ImageTask, pose: &Pose) -> bool {
        let mut pairs = task.parts().iter().flat_map(|part| part.cameras.iter().map(move |camera| (part, *camera)));
        pairs.all(|(part, camera)| {
            let view = &self.cameras[camera];
            part.kind.features().into_iter().all(|index| {
                let feature = &task.features()[index];
                matches!(feature.place, Place::Image(_))
                    || view.model.is_in_front(&self.in_camera(feature, index, view, pose))
            })
        })
    }

    /// Every row of the task with the hand there, in the order of [`ImageTask::errors`].
    pub(super) fn errors<T: Scalar>(&self, task: &ImageTask, pose: &Pose<T>) -> Vec<T> {
        let mut errors = Vec::with_capacity(task.rows());
        for part in task.parts() {
            for &camera in &part.cameras {
                self.errors_of(task, part, camera, pose, &mut errors);
            }
        }
        errors
    }

    fn errors_of<T: Scalar>(&self, task: &ImageTask, part: &Part, camera: usize, pose: &Pose<T>, errors: &mut Vec<T>) {
        let view = &self.cameras[camera];
        let look = |index: usize| {
            let feature = &task.features()[index];
            if let Place::Image(pixels) = &feature.place {
                let [u, v] = pixels[camera];
                return Vector3::new(u, v, 1.0).map(T::from);
            }
            let point = self.in_camera(feature, index, view, pose);
            if part.kind.is_spatial() {
                return point;
            }
            let [u, v] = view.model.project(&view.intrinsics.map(T::from), &point);
            Vector3::new(u, v, T::from(1.0))
        };
        let seen: Vec<Vector3<T>> = part.kind.features().into_iter().map(look).collect();
        part.kind.errors(&seen, errors);
    }

    fn in_camera<T: Scalar>(&self, feature: &Feature, index: usize, view: &View, pose: &Pose<T>) -> Vector3<T> {
        let point = self.points[index].map(T::from);
        let camera = view.pose.lift::<T>();
        match (&feature.place, view.on_hand) {
            // Both on one body.
            (Place::Hand(_), true) => camera.inverse_transform(&point),
            (Place::Hand(_), false) => camera.inverse_transform(&pose.transform(&point)),
            (_, true) => camera.inverse_transform(&pose.inverse_transform(&point)),
            (_, false) => camera.inverse_transform(&point),
        }
    }
}

impl Place {
    /// Where it is in the hand's frame or in the world [m], where that is known; features on the image need no place.
    pub(super) fn xyz(&self) -> Option<Vector3<f64>> {
        match self {
            Place::Hand(xyz) | Place::Target(xyz) => *xyz,
            Place::Image(_) => Some(Vector3::zeros()),
        }
    }
}
