//! An online calibrator: watches a learned rig predict what is seen, says when and what part of it moved, and learns that part again.
//!
//! Every sample is tested against what the rig predicts (`null.rs`). On an alarm, each part is moved alone to explain the
//! samples since the change (`blocks.rs`); the part whose motion explains them best, at a price for its degrees of freedom, is
//! the cause.
mod blocks;
mod monitor;
mod null;
mod seen;

pub use blocks::{Cause, Score};
pub use monitor::Monitor;

use crate::rig::Rig;

/// How a rig is watched. The defaults suit a rig learned from some fifty samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitorOptions {
    /// Largest probability of an alarm at a sample of an unchanged rig.
    pub false_alarm_rate: f64,
    /// Recent samples that are kept.
    pub buffer: usize,
    /// First samples, from which the size and the spread of the rig's own errors are estimated.
    pub burn_in: usize,
    /// Samples since a change from which the part that moved is learned again.
    pub relearn_samples: usize,
    /// Small drifts are followed where the gradient norm is this many times that of the first full buffer.
    pub follow_ratio: f64,
}

impl Default for MonitorOptions {
    fn default() -> Self {
        MonitorOptions { false_alarm_rate: 1e-6, buffer: 50, burn_in: 20, relearn_samples: 5, follow_ratio: 3.0 }
    }
}

/// What came of a sample.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Nothing to compare: no joints, no image with three detections of what the rig knows, or a number that is not finite.
    Skipped,
    /// As predicted, or not yet told from it.
    Unchanged,
    /// Part of the rig moved.
    Changed(Change),
    /// The part that moved has been learned again, from this many samples; the rig predicts with it from here on.
    Relearned {
        /// What had moved, judged by all samples since.
        cause: Cause,
        /// How many samples it was learned from.
        samples: usize,
        /// The rig with it.
        rig: Box<Rig>,
    },
    /// A part drifted and was followed by one damped Gauss-Newton step.
    Followed {
        /// What drifted.
        cause: Cause,
        /// Norm of the gradient before the step, as [`Monitor::gradient_norm`] has it.
        gradient_norm: f64,
    },
}

/// A change, and what explains it.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The first sample that is not as predicted, counted from 0 as they were observed.
    pub since: usize,
    /// What moved.
    pub cause: Cause,
    /// Bound on the probability of so clear an alarm at a sample of an unchanged rig.
    pub p_value: f64,
    /// Every explanation, best first.
    pub scores: Vec<Score>,
}

/// Explanations whose scores differ by less are not told apart: a likelihood ratio of e.
const AS_GOOD: f64 = 2.0;

impl Change {
    /// Other parts whose motion explains the samples as well: only samples at other positions, or another camera, can tell.
    pub fn as_good(&self) -> impl Iterator<Item = Cause> {
        let best = self.scores.first().map_or(f64::INFINITY, |score| score.bic);
        let others = self.scores.iter().skip(1).filter(move |score| score.bic < best + AS_GOOD);
        others.filter(|_| self.cause != Cause::Unexplained).map(|score| score.cause)
    }
}
