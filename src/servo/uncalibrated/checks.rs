//! What uncalibrated servoing refuses to begin with.
use super::settings::Settings;
use super::signals::{Quantity, Row};

/// Errors: what is wrong, and what would do.
pub(super) fn check(quantities: &[Quantity], rows: &[Row], settings: &Settings) -> Result<(), String> {
    let (n, m) = (quantities.len(), rows.len());
    if n == 0 || m < n {
        return Err(format!(
            "{n} quantities and {m} rows: at least 1 quantity is needed, and as many rows as quantities"
        ));
    }
    if let Some(row) = rows.iter().position(|row| !(row.sd >= 0.0 && row.sd.is_finite())) {
        return Err(format!("row {row}: a standard deviation of {} px; it has to be 0 or more", rows[row].sd));
    }
    if !(settings.gain > 0.0 && settings.gain <= 1.0) {
        return Err(format!("a gain of {}; it has to be above 0 and at most 1", settings.gain));
    }
    let explored = &settings.exploration;
    if !(explored.size > 0.0 && explored.size.is_finite()) {
        return Err(format!("exploratory motions of {}; they have to be above 0", explored.size));
    }
    if let Some(direction) = explored.directions.iter().find(|direction| direction.len() != n) {
        return Err(format!("an exploratory direction of {} numbers, where {n} quantities move", direction.len()));
    }
    Ok(())
}
