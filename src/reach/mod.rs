//! Where a robot can be with its features in view: random joint positions within the limits.
mod motions;
mod views;

pub(crate) use motions::{Motions, range};
pub(crate) use views::{Need, Views, sizes};
