//! What is tracked.
use nalgebra::Vector3;

/// A point that trackers follow in the images.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Its name.
    pub name: String,
    /// What it is fixed to.
    pub place: Place,
}

/// What a feature is fixed to.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// What the robot moves. Where it is in a frame of the hand [m], where that is known: only the checker asks.
    Hand(Option<Vector3<f64>>),
    /// What stands still. Where it is in the world [m], likewise.
    Target(Option<Vector3<f64>>),
    /// The images: a pixel per camera, NaN in those where it is not.
    Image(Vec<[f64; 2]>),
}

impl Place {
    /// The words of task files.
    pub const NAMES: &'static [&'static str] = &["hand", "target", "image"];

    /// Its name in task files.
    pub fn name(&self) -> &'static str {
        match self {
            Place::Hand(_) => "hand",
            Place::Target(_) => "target",
            Place::Image(_) => "image",
        }
    }
}
