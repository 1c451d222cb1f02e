//! Servoing without a rig: the Jacobian from what is controlled to what is seen is estimated by moving, and kept on the way.
//!
//! Whatever is controlled are [`Quantity`]s: joints, coordinates of a tip, the heading of a drone. Whatever is seen are rows: errors in
//! pixels that shall become 0, each with its [`Row::sd`]. [`Uncalibrated`] explores, servoes through the same constrained step as with a
//! rig, and stops where it must. A [`Foresight`], such as a rig that may be outdated, takes the place of exploring and is corrected on the way.
//! [`crate::servo::UncalibratedJoints`] is the controller for joints and pixels around it. After Ramirez, "Towards Practical Uncalibrated
//! Visual Servoing", 2016; [`Settings::plain`] is his controller, the defaults are ours.
mod checks;
mod controller;
mod dither;
mod estimate;
mod exploration;
mod foresight;
mod giving_up;
mod learning;
mod phases;
mod settings;
mod signals;
mod stall;
mod trust;
mod views;
mod whole_pixels;

pub use controller::Uncalibrated;
pub use estimate::Estimate;
pub use foresight::Foresight;
pub(super) use giving_up::stop_of;
pub use settings::{Exploration, Settings, Trust, Update};
pub use signals::{Command, Phase, Quantity, Row, Stop};
