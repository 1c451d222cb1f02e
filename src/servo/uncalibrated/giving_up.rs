//! What a loop is told where servoing without a rig goes on no more.
use super::signals::{Phase, Stop as Gave};
use crate::Error;
use crate::servo::Stop;

/// Why a controller gives up in a phase, if it does. `error_px`: the mean error of `n` features or rows now [px].
///
/// Errors: [`Error::NotEnoughData`] where it waits for what later measurements may bring.
pub(in crate::servo) fn stop_of(phase: &Phase, error_px: f64, n: usize) -> Result<Option<Stop>, Error> {
    Ok(match phase {
        Phase::Waiting(why) => return Err(Error::NotEnoughData(why.clone())),
        Phase::Stopped(Gave::Undetermined(why)) => Some(Stop::Undetermined { why: why.clone() }),
        Phase::Stopped(Gave::Diverged { growth }) => {
            let from_px = (error_px - growth / n.max(1) as f64).max(0.0);
            Some(Stop::Diverged { from_px, error_px })
        }
        Phase::Exploring | Phase::Servoing | Phase::Converged => None,
    })
}

/// Why nothing moves where the joints have to be read and are not.
pub(in crate::servo) fn not_read() -> Error {
    Error::NotEnoughData("the joints are not read, or not as numbers".to_owned())
}
