//! What goes into uncalibrated servoing and what comes out.
use crate::rig::Limits;
use crate::servo::{Active, Constraint};

/// Something that is controlled.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Quantity {
    /// Its name, for messages.
    pub name: String,
    /// What bounds it, in its own unit.
    pub limits: Limits,
    /// Motions smaller than this are not carried out, in its own unit; 0 where every motion is.
    pub dead_band: f64,
}

/// Something that is seen: an error that shall become 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Standard deviation of its noise [px]: of √2 times the tracker's where both what moves and its target are tracked.
    pub sd: f64,
    /// The camera that sees it.
    pub camera: usize,
}

/// What to do next.
#[derive(Clone, Debug, PartialEq)]
pub struct Command<'a> {
    /// Motion of every quantity in its own unit: finite, and inside its bounds or 0.
    pub motion: &'a [f64],
    /// Why.
    pub phase: &'a Phase,
    /// What holds the motion back.
    pub active: &'a [Active],
    /// Constraints that cannot all hold, where a limit gave way.
    pub conflict: &'a [Constraint],
}

/// What is being done.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Phase {
    /// Quantities are moved a little to see what each does.
    #[default]
    Exploring,
    /// Errors are made smaller.
    Servoing,
    /// What is left of the errors is noise, or motions that the dead bands swallow. Still servoing: it may leave this phase.
    Converged,
    /// Nothing moves until more is known; the reason in words. Rows that are seen again, and readings that are numbers again, end it.
    Waiting(String),
    /// Nothing moves any more.
    Stopped(Stop),
}

/// Why nothing moves any more.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// The errors grew by more than [`super::Settings::divergence`] in one step.
    Diverged {
        /// By how much [px].
        growth: f64,
    },
    /// What is seen does not determine the motion; the reason in words.
    Undetermined(String),
}
