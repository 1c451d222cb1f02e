//! The camera rotation experiment of Ramirez, "Towards Practical Uncalibrated Visual Servoing", 2016, section 5.2: a Puma 560 brings three
//! points of its tool to where two cameras shall see them, and the cameras are carried around the target.
mod around;
mod baseline;
mod published;
mod run;
mod tables;
mod world;

pub use run::{ITERATIONS, Run, carried_around, servo};
pub use world::{Scene, Tracker, View, World};

pub(super) use around::{FIGURE5_8, FIGURE5_9};
pub(super) use baseline::FIGURE5_10;
pub(super) use tables::{TABLE5_1, TABLE5_2, TABLE5_3};
