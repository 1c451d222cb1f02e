//! Why a servo loop stops.
use super::{Active, Bound, Constraint};
use crate::rig::Rig;

/// Why a loop moves no more. Errors in pixels are those that its controller judges: the mean distance of the features from where they shall be,
/// or of a task in images the root of the mean square of its rows.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// The features are where they shall be.
    Converged {
        /// Error that is left [px].
        error_px: f64,
    },
    /// The error falls no more, although nothing holds the arm back: noise keeps it where it is.
    NoBetter {
        /// Error over the last measurements [px].
        error_px: f64,
        /// Its standard deviation from one measurement to the next [px].
        sd_px: f64,
    },
    /// Limits leave no motion that helps.
    Blocked {
        /// Error that is left [px].
        error_px: f64,
        /// The limits.
        by: Vec<Active>,
        /// Constraints that cannot all hold, where some of them gave way; see [`super::Step::conflict`].
        conflict: Vec<Constraint>,
    },
    /// The error grew beyond any use.
    Diverged {
        /// Error from which it grew [px].
        from_px: f64,
        /// Error now [px].
        error_px: f64,
    },
    /// What is seen does not determine how to move.
    Undetermined {
        /// Why not, and what would help.
        why: String,
    },
    /// Nothing could be made of what was seen for too long.
    Lost {
        /// Why the last measurement was of no use.
        why: String,
        /// For how long [s].
        seconds: f64,
    },
    /// The time is up.
    TimedOut {
        /// Error that is left [px], if it is known.
        error_px: Option<f64>,
        /// How much time there was [s].
        seconds: f64,
    },
}

impl Stop {
    /// One word for programs.
    pub fn name(&self) -> &'static str {
        match self {
            Stop::Converged { .. } => "converged",
            Stop::NoBetter { .. } => "no-better",
            Stop::Blocked { .. } => "blocked",
            Stop::Diverged { .. } => "diverged",
            Stop::Undetermined { .. } => "undetermined",
            Stop::Lost { .. } => "lost",
            Stop::TimedOut { .. } => "timed-out",
        }
    }

    /// True where the features are as near as they can be brought.
    pub fn is_success(&self) -> bool {
        matches!(self, Stop::Converged { .. } | Stop::NoBetter { .. })
    }

    /// In words. `limits`: what the limits of the loop are called, in their order.
    pub fn words(&self, rig: &Rig, limits: &[String]) -> String {
        match self {
            Stop::Converged { error_px } => format!("converged: {error_px:.3} px"),
            Stop::NoBetter { error_px, sd_px } => {
                format!(
                    "cannot do better than {error_px:.3} px, which varies by {sd_px:.3} px from one measurement to the next"
                )
            }
            Stop::Blocked { error_px, by, conflict } => {
                let names = |constraints: &mut dyn Iterator<Item = &Constraint>| {
                    let mut names: Vec<String> = constraints.map(|constraint| constraint.words(rig, limits)).collect();
                    names.sort();
                    names.dedup();
                    names.join(", ")
                };
                let by = names(&mut by.iter().map(|active| &active.constraint));
                let conflict = names(&mut conflict.iter());
                let rest = if conflict.is_empty() { conflict } else { format!("; these cannot all hold: {conflict}") };
                format!("blocked at {error_px:.3} px by {by}{rest}")
            }
            Stop::Diverged { from_px, error_px } => format!("diverged: from {from_px:.3} px to {error_px:.3} px"),
            Stop::Undetermined { why } => format!("undetermined: {why}"),
            Stop::Lost { why, seconds } => format!("lost for {seconds:.3} s: {why}"),
            Stop::TimedOut { error_px: Some(error_px), seconds } => {
                format!("timed out after {seconds:.3} s at {error_px:.3} px")
            }
            Stop::TimedOut { error_px: None, seconds } => format!("timed out after {seconds:.3} s without an error"),
        }
    }
}

impl Constraint {
    /// Its name in words. `limits`: what the limits of the loop are called, in their order.
    pub fn words(&self, rig: &Rig, limits: &[String]) -> String {
        match *self {
            Constraint::Joint { joint, bound, upper } => {
                let end = if upper { "upper" } else { "lower" };
                let what = match bound {
                    Bound::None => "bound",
                    Bound::Position => "limit",
                    Bound::Velocity => "speed limit",
                    Bound::Acceleration => "acceleration limit",
                };
                let joint = rig.robot.joints.get(joint).map_or("?", |joint| joint.name.as_str());
                format!("the {end} {what} of joint `{joint}`")
            }
            Constraint::Limit { limit, .. } => {
                limits.get(limit).map_or_else(|| format!("limit {}", limit + 1), |name| format!("limit `{name}`"))
            }
        }
    }
}
