//! Figure 11: pixel error against servoing commands of a noisy joint controller, its state unobserved.
use super::servoing::Acts;
use super::unobserved::outcome;
use super::{Experiment, Options, Outcome};
use crate::Error;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "figure11",
    about: "servoing a noisy joint controller, its state unobserved, with a rig learned from it",
    source: "Gothoskar et al., figure 11, in words",
    trials: 5,
    is_timed: false,
    is_seeded: true,
    run,
};

fn run(options: &Options) -> Result<Outcome, Error> {
    let curves = [(0.01, Some(1.0), "0.01 rad"), (0.02, Some(1.0), "0.02 rad")];
    outcome(options, Acts::Joints, curves, "pixel accuracy at 0.01 and at 0.02 rad")
}
