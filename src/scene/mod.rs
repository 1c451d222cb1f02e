//! Scenes: a world, a target, a controller and its limits in a file, run to the end.
mod catalog;
mod plot;
mod read;
mod read_control;
mod read_faults;
mod read_limits;
mod run;

pub use catalog::ALL;
pub use plot::svg;
pub use read_faults::NamedFault;
pub use run::{Moment, Run, run};

use crate::rig::Rig;
use crate::servo::limits::Guide;
use crate::servo::{ImageSettings, LoopSettings, PoseSettings, Takes};
use crate::simulate::world::WorldOptions;
use nalgebra::Vector3;

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
    /// What the robot takes.
    pub takes: Takes,
    /// Joints at the beginning [rad or m].
    pub start: Vec<f64>,
    /// Where the features shall be seen: where they are with these joints, which may move.
    pub target: Target,
    /// What turns measurements into commands; `None` is [`Control::ModelBased`] with a rig, and [`Control::Uncalibrated`] without.
    pub control: Option<Control>,
    /// Limits beside those of the joints, by name.
    pub limits: Vec<(String, LimitKind)>,
    /// When the loop stops.
    pub settings: LoopSettings,
    /// Seconds from one command to the next.
    pub dt: f64,
}

/// Joints whose pixels are aimed at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Target {
    /// At the beginning [rad or m].
    pub joints: Vec<f64>,
    /// How fast they move [rad/s or m/s]; empty for a target that stands still.
    pub velocity: Vec<f64>,
    /// For how long they move [s].
    pub until: f64,
}

impl Target {
    /// Where it is after some seconds.
    pub fn at(&self, time: f64) -> Vec<f64> {
        let time = time.min(self.until);
        let speed = |i: usize| self.velocity.get(i).copied().unwrap_or(0.0);
        self.joints.iter().enumerate().map(|(i, joint)| joint + speed(i) * time).collect()
    }
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
    /// [`crate::servo::UncalibratedJoints`].
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

/// How [`crate::servo::UncalibratedJoints`] servoes in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncalibratedControl {
    /// Standard deviation that trackers are taken to have [px].
    pub pixels: f64,
    /// Share of the errors that a command takes away, in (0, 1]; `None` is the default of its settings.
    pub gain: Option<f64>,
    /// True where the rig that is known is followed as far as it is right, false where it is not even looked at.
    pub hybrid: bool,
}

impl Default for UncalibratedControl {
    /// 0.3 px, without any rig.
    fn default() -> Self {
        UncalibratedControl { pixels: 0.3, gain: None, hybrid: false }
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
