//! The controllers of scenes.
use super::{Control, Scene, UncalibratedControl};
use crate::Error;
use crate::rig::{Parent, Rig};
use crate::servo::image_tasks::ImageTask;
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
            Control::Uncalibrated(control) => match &self.task {
                Some(task) => Box::new(self.carrying_out(task.clone(), control, self.rig.as_ref().unwrap_or(known))?),
                None if moves_tip => {
                    return Err(Error::Unusable(format!(
                        "a controller of kind {name} moves joints, this robot takes {}",
                        takes.name()
                    )));
                }
                None => {
                    let (pixels, settings) = (control.pixels, control.settings.clone());
                    let mut controller = if control.hybrid {
                        UncalibratedJoints::with_rig(rig()?, pixels, settings)?
                    } else {
                        UncalibratedJoints::new(&known.robot.joints, pixels, settings)?
                    };
                    controller.takes = takes;
                    controller.dead_bands(&vec![control.dead_band; known.robot.joints.len()])?;
                    Box::new(controller)
                }
            },
        })
    }

    /// The controller of a task; `truth`: the rig on which anybody sees what carries which camera.
    fn carrying_out(
        &self,
        task: ImageTask,
        control: &UncalibratedControl,
        truth: &Rig,
    ) -> Result<UncalibratedTask, Error> {
        let is_carried =
            |name: &String| truth.cameras.iter().any(|camera| camera.name == *name && camera.parent != Parent::World);
        let carried = task.cameras().iter().map(is_carried).collect();
        let mut controller = UncalibratedTask::new(task, self.takes, &truth.robot.joints, control.settings.clone())?;
        controller.dead_band(control.dead_band)?;
        controller.carried = carried;
        Ok(controller)
    }
}

fn needs_rig(controller: &str) -> Error {
    Error::Unusable(format!(
        "a controller of kind {controller} needs a rig that it knows, and none is given: give LEARNED, or `kind = \"uncalibrated\"`"
    ))
}
