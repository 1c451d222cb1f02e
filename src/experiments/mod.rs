//! Published experiments in simulation, beside their figures: of the paper, Gothoskar, Lázaro-Gredilla, Agarwal, Bekiroglu, George,
//! "Learning a generative model for robot control using visual feedback", and of the thesis, Ramirez, "Towards Practical Uncalibrated
//! Visual Servoing".
//!
//! One file each; being listed in [`ALL`] is what runs it from the command line and covers it by the tests.
pub mod camera_rotation;
mod controlled;
mod figure10;
mod figure11;
mod figure3;
mod figure4;
mod figure5;
mod figure6;
mod figure7;
mod figure8;
mod figure9;
mod graph;
mod grasping;
mod insertion;
mod manipulation;
mod outcome;
mod plot;
mod relearn;
mod servoing;
mod setting;
mod table1;
mod table2;
mod table3;
mod table4;
mod table5;
mod table6;
mod table7;
mod table8;
mod unobserved;
mod without_rig;

pub use outcome::{Outcome, Published, Row};
pub use plot::svg;

use crate::Error;
use crate::error::suggestion;

/// How often and from which seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// How many trials, each with a recording of its own.
    pub trials: usize,
    /// Seed of the first trial: the same seed gives the same figures, bit for bit, on any number of threads; but for times.
    pub seed: u64,
}

/// One published experiment.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it asks, in one line.
    pub about: &'static str,
    /// Where the published figures stand.
    pub source: &'static str,
    /// Trials where nobody asks for a number: some seconds on one core.
    pub trials: usize,
    /// True where the figures are times, which no seed makes the same.
    pub is_timed: bool,
    /// False where nothing is drawn, so that every seed gives the same figures.
    pub is_seeded: bool,
    run: fn(&Options) -> Result<Outcome, Error>,
}

/// Every experiment, in the order of the paper, then of the thesis.
pub const ALL: &[Experiment] = &[
    table1::EXPERIMENT,
    table2::EXPERIMENT,
    table3::EXPERIMENT,
    table4::EXPERIMENT,
    table5::EXPERIMENT,
    figure3::EXPERIMENT,
    figure4::EXPERIMENT,
    table6::EXPERIMENT,
    figure5::EXPERIMENT,
    figure6::EXPERIMENT,
    figure7::EXPERIMENT,
    table7::EXPERIMENT,
    table8::EXPERIMENT,
    figure8::EXPERIMENT,
    figure9::EXPERIMENT,
    figure10::EXPERIMENT,
    figure11::EXPERIMENT,
    grasping::EXPERIMENT,
    insertion::EXPERIMENT,
    camera_rotation::TABLE5_1,
    camera_rotation::TABLE5_2,
    camera_rotation::TABLE5_3,
    camera_rotation::FIGURE5_8,
    camera_rotation::FIGURE5_9,
    camera_rotation::FIGURE5_10,
    without_rig::FIGURE5_17,
    without_rig::DEAD_BAND,
    without_rig::WRENCH,
    without_rig::PICK,
    without_rig::DEPTH_CAMERA,
    without_rig::MOVING_TARGET,
    without_rig::VIRTUAL_SPRING,
    without_rig::DRONE,
];

/// The experiment of that name.
///
/// Errors: [`Error::Unusable`] with the known names where there is none.
pub fn find(name: &str) -> Result<&'static Experiment, Error> {
    ALL.iter().find(|experiment| experiment.name == name).ok_or_else(|| {
        let known = suggestion(name, ALL.iter().map(|experiment| experiment.name));
        Error::Unusable(format!("no experiment is called `{name}` {known}"))
    })
}

impl Experiment {
    /// Runs all trials, on as many threads as there are; on one where they are timed.
    ///
    /// Errors: [`Error::Unusable`] for 0 trials; what simulation and learning refuse.
    pub fn run(&self, options: &Options) -> Result<Outcome, Error> {
        if options.trials == 0 {
            return Err(Error::Unusable("0 trials are asked for, at least 1 is needed".to_owned()));
        }
        (self.run)(options)
    }
}
