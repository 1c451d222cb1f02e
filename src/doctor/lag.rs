//! A lag between the clocks of robot and images, found in turns with the rig under it.
use super::pixels::learn;
use super::thin::thinned;
use super::{Misfit, Watch};
use crate::calibrate::{Motion, Options, SAME_LAG, interpolated};
use crate::recording::Recording;
use crate::rig::Rig;

/// Turns of learning a rig and finding the lag under it.
const ROUNDS: usize = 6;

/// A lag found.
pub(super) struct Lag {
    /// By how much joints are stamped late [s].
    pub seconds: f64,
    /// Some of the recording, without it.
    pub recording: Recording,
    /// Of the fastest samples, as recorded and without it.
    pub misfits: [Option<Misfit>; 2],
}

/// The lag at which a rig explains the fastest samples best, found in turns with the rig; `learned`: that of the data as recorded. `None` where
/// there is none, or nothing can be learned.
pub(super) fn lag(
    motion: &Motion<'_>,
    rig: &Rig,
    learned: &Rig,
    options: &Options,
    watch: &mut Watch<'_>,
) -> Option<Lag> {
    let some = thinned(motion.recording);
    let mut without = learned.clone();
    let mut seconds = 0.0;
    for _ in 0..ROUNDS {
        let best = motion.best_lag(&without)?;
        let is_settled = (best - seconds).abs() < SAME_LAG * motion.period;
        if is_settled {
            break;
        }
        seconds = best;
        without = learn(rig, &interpolated(motion.recording, &some, seconds), options, "a lag", watch).ok()?.rig;
    }
    let misfit = |rig: &Rig, lag: f64| motion.misfit(rig, lag).map(Misfit::from);
    let misfits = [misfit(learned, 0.0), misfit(&without, seconds)];
    (seconds != 0.0).then(|| Lag { seconds, recording: interpolated(motion.recording, &some, seconds), misfits })
}
