//! Limits: what must not happen on the way; one file each. Those of the joints are the rig's, and hard: see [`super::Stepper`].
//!
//! A limit that is broken pulls back: its rows ask for a share of the way inside.
mod in_image;
mod link_distance;
mod pixel_speed;
mod region;
mod tip_speed;

pub use in_image::InImage;
pub use link_distance::LinkDistance;
pub use pixel_speed::PixelSpeed;
pub use region::HalfSpace;
pub use tip_speed::TipSpeed;

use super::{Arm, Configuration, LimitRows};

/// What a motion of the next `dt` seconds must not do.
pub trait Limit {
    /// Adds rows a·Δq ≤ b.
    fn rows(&self, arm: &Arm, at: &Configuration, dt: f64, rows: &mut LimitRows);
}

/// Share of the room to a limit that one step may take up: a row is the tangent of what it stands for, and steps are not small.
const SHARE: f64 = 0.5;
