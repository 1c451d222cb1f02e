//! Limits: what must not happen on the way; one file each. Those of the joints are the rig's, and hard: see [`super::Stepper`].
//!
//! A limit that is broken pulls back: its rows ask for a share of the way inside. Where a limit need not give way, a step leaves at least
//! half of the room there was, or takes back at least half of a violation, and keeps below a speed, up to what a row as a tangent
//! leaves out: half the second derivative times the square of the motion (for a point of the arm, its distance from the axes times half
//! the squared sum of the joints' motions), and what the noise of readings and of the motion's execution adds. Margins are for these.
mod half_space;
mod in_image;
mod link_distance;
mod pixel_speed;
mod tip_box;
mod tip_speed;
mod virtual_fixture;

pub use half_space::HalfSpace;
pub use in_image::InImage;
pub use link_distance::LinkDistance;
pub use pixel_speed::PixelSpeed;
pub use tip_box::TipBox;
pub use tip_speed::TipSpeed;
pub use virtual_fixture::{Guide, VirtualFixture};

use super::{Arm, Configuration, LimitRows};

/// What a motion of the next `dt` seconds must not do.
pub trait Limit {
    /// Adds rows a·Δq ≤ b.
    fn rows(&self, arm: &Arm, at: &Configuration, dt: f64, rows: &mut LimitRows);
}

/// Share of the room to a limit that one step may take up: a row is the tangent of what it stands for, and steps are not small.
const SHARE: f64 = 0.5;
