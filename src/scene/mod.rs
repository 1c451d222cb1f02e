//! Scenes: a world, a target, a controller and its limits in a file, run to the end.
mod catalog;
mod plot;
mod read;
mod read_control;
mod read_limits;
mod run;

pub use catalog::ALL;
pub use plot::svg;
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
    /// What the robot takes.
    pub takes: Takes,
    /// Joints at the beginning [rad or m].
    pub start: Vec<f64>,
    /// Where the features shall be seen: where they are with these joints, which may move.
    pub target: Target,
    /// What turns measurements into commands.
    pub control: Control,
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
