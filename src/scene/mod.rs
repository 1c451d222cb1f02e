//! Scenes: a world, a target, a controller and its limits in a file, run to the end.
mod catalog;
mod check;
mod controllers;
mod limits;
mod named;
mod place;
mod plot;
mod read;
mod read_control;
mod read_faults;
mod read_limits;
mod read_target;
mod run;
mod target;

pub use catalog::ALL;
pub use named::{NamedCoupling, NamedFault, NamedSlip};
pub use plot::svg;
pub use run::{Moment, Run, run};
pub use target::{Target, Waypoint};

use crate::rig::Rig;
use crate::servo::image_tasks::ImageTask;
use crate::servo::limits::Guide;
use crate::servo::uncalibrated::Settings;
use crate::servo::{ImageSettings, LoopSettings, PoseSettings, Takes};
use crate::simulate::world::WorldOptions;
use nalgebra::Vector3;
use std::path::PathBuf;

/// What happens in a closed loop, apart from the rig that the controller knows.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What it is called.
    pub name: Option<String>,
    /// The rig that the world is; `None` where the controller knows the truth.
    pub rig: Option<Rig>,
    /// How the world differs from it.
    pub world: WorldOptions,
    /// Trackers that fail.
    pub faults: Vec<NamedFault>,
    /// Joints that slip.
    pub slips: Vec<NamedSlip>,
    /// Joints that others drag along.
    pub couplings: Vec<NamedCoupling>,
    /// What shall meet what; `None` where all features shall be seen where they are with the joints of the target. Features on the hand and
    /// on the target that have their `xyz` in the task are there in the tip's frame, those on the target as the tip has it with the joints of
    /// the target: there the task is solved. Others are where the rig has those of their names.
    pub task: Option<ImageTask>,
    /// What the robot takes.
    pub takes: Takes,
    /// Joints at the beginning [rad or m].
    pub start: Vec<f64>,
    /// Where the arm shall be, which may move.
    pub target: Target,
    /// What turns measurements into commands; `None` is [`Control::ModelBased`] with a rig and without a task, and else
    /// [`Control::Uncalibrated`].
    pub control: Option<Control>,
    /// Limits beside those of the joints, by name.
    pub limits: Vec<(String, LimitKind)>,
    /// When the loop stops.
    pub settings: LoopSettings,
    /// Seconds from one command to the next.
    pub dt: f64,
    /// Files that it was read from beside its own: its rig and what that names, its task, the recording of its target's path.
    pub files: Vec<PathBuf>,
}

/// A controller and its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum Control {
    /// [`crate::servo::ModelBased`].
    ModelBased,
    /// [`crate::servo::ModelBasedTip`], with the largest speeds of the tip [m/s] and [rad/s].
    ModelBasedTip {
        /// Largest speed of its origin and of its turning; infinite for none.
        speed: [f64; 2],
    },
    /// [`crate::servo::ImageBased`].
    ImageBased(ImageSettings),
    /// [`crate::servo::PoseBased`].
    PoseBased(PoseSettings),
    /// [`crate::servo::UncalibratedJoints`], or [`crate::servo::UncalibratedTask`] in a scene with a task.
    Uncalibrated(UncalibratedControl),
}

impl Control {
    /// The word for it in scene files.
    pub fn name(&self) -> &'static str {
        match self {
            Control::ModelBased => "model-based",
            Control::ModelBasedTip { .. } => "model-based-tip",
            Control::ImageBased(_) => "image-based",
            Control::PoseBased(_) => "pose-based",
            Control::Uncalibrated(UncalibratedControl { hybrid: true, .. }) => "hybrid",
            Control::Uncalibrated(_) => "uncalibrated",
        }
    }
}

/// How [`crate::servo::UncalibratedJoints`] servoes in a scene, and [`crate::servo::UncalibratedTask`] in one with a task.
#[derive(Clone, Debug, PartialEq)]
pub struct UncalibratedControl {
    /// Standard deviation that trackers are taken to have [px]; a task has its own.
    pub pixels: f64,
    /// Gain, exploration, and how what is known is updated and trusted.
    pub settings: Settings,
    /// Motions of a joint that it takes for too small to be carried out [rad or m]; of a robot that is moved by its tip, see
    /// [`crate::servo::UncalibratedTask::dead_band`].
    pub dead_band: f64,
    /// True where the rig that is known is followed as far as it is right, false where it is not even looked at.
    pub hybrid: bool,
}

impl Default for UncalibratedControl {
    /// 0.3 px, without any rig.
    fn default() -> Self {
        UncalibratedControl { pixels: 0.3, settings: Settings::default(), dead_band: 0.0, hybrid: false }
    }
}

/// A limit of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LimitKind {
    /// All features inside the images of all cameras by this margin [px].
    InImage(f64),
    /// Largest speed of all features in all images [px/s].
    PixelSpeed(f64),
    /// Largest speed of the tip [m/s].
    TipSpeed(f64),
    /// The tip on one side of a plane: unit normal, and its distance from the world's origin [m].
    HalfSpace(Vector3<f64>, f64),
    /// The tip inside a box along the world's axes, from its smallest to its largest coordinates [m].
    TipBox(Vector3<f64>, Vector3<f64>),
    /// The tip within a distance of a line or a plane [m].
    Follow(Guide, f64),
}
