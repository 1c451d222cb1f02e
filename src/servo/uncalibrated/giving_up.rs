//! What a loop is told where servoing without a rig goes on no more.
use super::signals::{Phase, Stop as Gave};
use crate::Error;
use crate::servo::Stop;

/// Why a controller gives up in a phase, if it does. `from_px`, `error_px`: the error that its loop judges, before and now [px].
///
/// Errors: [`Error::NotEnoughData`] where it waits for what later measurements may bring.
pub(in crate::servo) fn stop_of(phase: &Phase, from_px: f64, error_px: f64) -> Result<Option<Stop>, Error> {
    Ok(match phase {
        Phase::Waiting(why) => return Err(Error::NotEnoughData(why.clone())),
        Phase::Stopped(Gave::Undetermined(why)) => Some(Stop::Undetermined { why: why.clone() }),
        Phase::Stopped(Gave::Diverged { .. }) => Some(Stop::Diverged { from_px, error_px }),
        Phase::Exploring | Phase::Servoing | Phase::Converged => None,
    })
}
