//! The controllers of scenes.
use super::{Control, Scene, UncalibratedControl};
use crate::Error;
use crate::rig::{Parent, Rig};
use crate::servo::{
    Controller, ImageBased, ModelBased, ModelBasedTip, PoseBased, Takes, UncalibratedJoints, UncalibratedTask,
};

impl Scene {
    /// The controller. `learned`: the rig that it knows; `known`: whose joints it moves.
    ///
    /// Errors: [`Error::Unusable`] where it needs a rig, or does not suit what the robot takes; those of its making.
    pub(super) fn controller(
        &self,
        control: &Control,
        learned: Option<&Rig>,
        known: &Rig,
    ) -> Result<Box<dyn Controller>, Error> {
        let (takes, name) = (self.takes, control.name());
        let moves_tip = matches!(takes, Takes::PoseDelta | Takes::PoseVelocity);
        let rig = || learned.ok_or_else(|| needs_rig(name));
        Ok(match control {
            Control::ModelBased => {
                let mut controller = ModelBased::new(rig()?)?;
                controller.takes = takes;
                Box::new(controller)
            }
            Control::ModelBasedTip { speed } => {
                let mut controller = ModelBasedTip::new(rig()?)?;
                (controller.takes, controller.speed) = (takes, *speed);
                if !moves_tip {
                    return Err(Error::Unusable(format!(
                        "a controller that moves the tip needs a robot that takes pose-deltas or pose-velocities, this takes {}",
                        takes.name()
                    )));
                }
                Box::new(controller)
            }
            Control::ImageBased(settings) => {
                let mut controller = ImageBased::new(rig()?, settings.clone())?;
                controller.takes = takes;
                Box::new(controller)
            }
            Control::PoseBased(settings) => {
                let mut controller = PoseBased::new(rig()?, settings.clone())?;
                controller.takes = takes;
                Box::new(controller)
            }
            Control::Uncalibrated(control) if self.task.is_some() => {
                let Some(task) = self.task.clone() else { return Err(needs_rig(name)) };
                let truth = self.rig.as_ref().unwrap_or(known);
                let mut controller = UncalibratedTask::new(task, takes, &truth.robot.joints, control.settings.clone())?;
                controller.dead_band(control.dead_band)?;
                // What anybody sees who looks at the robot.
                let is_carried = |name: &String| {
                    truth.cameras.iter().any(|camera| camera.name == *name && camera.parent != Parent::World)
                };
                let cameras = self.task.iter().flat_map(|task| task.cameras());
                controller.carried = cameras.map(is_carried).collect();
                Box::new(controller)
            }
            Control::Uncalibrated(_) if moves_tip => {
                return Err(Error::Unusable(format!(
                    "a controller of kind {name} moves joints, this robot takes {}",
                    takes.name()
                )));
            }
            Control::Uncalibrated(UncalibratedControl { pixels, settings, dead_band, hybrid }) => {
                let settings = settings.clone();
                let mut controller = if *hybrid {
                    UncalibratedJoints::with_rig(rig()?, *pixels, settings)?
                } else {
                    UncalibratedJoints::new(&known.robot.joints, *pixels, settings)?
                };
                controller.takes = takes;
                controller.dead_bands(&vec![*dead_band; known.robot.joints.len()])?;
                Box::new(controller)
            }
        })
    }
}

fn needs_rig(controller: &str) -> Error {
    Error::Unusable(format!(
        "a controller of kind {controller} needs a rig that it knows, and none is given: give LEARNED, or `kind = \"uncalibrated\"`"
    ))
}
