//! Figure 10: pixel error against servoing commands of a noisy Cartesian controller, its state unobserved.
use super::servoing::Acts;
use super::unobserved::outcome;
use super::{Experiment, Options, Outcome};
use crate::Error;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "figure10",
    about: "servoing a noisy Cartesian controller, its state unobserved, with a rig learned from it",
    source: "Gothoskar et al., figure 10, in words",
    trials: 5,
    is_timed: false,
    is_seeded: true,
    run,
};

fn run(options: &Options) -> Result<Outcome, Error> {
    let curves = [(0.01, Some(1.0), "0.01 m and rad"), (0.02, Some(5.0), "0.02 m and rad")];
    outcome(options, Acts::Tip, curves, "pixel accuracy at 0.01 m and rad, about 5 px at 0.02")
}
