//! What uncalibrated servoing refuses to begin with.
use super::settings::{Settings, Trust, Update};
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
    let explored = &settings.exploration;
    let share = |name: &'static str, value: f64| (name, value, value > 0.0 && value <= 1.0, "above 0 and at most 1");
    let size = |name: &'static str, value: f64| (name, value, value > 0.0 && value.is_finite(), "above 0");
    let least = |name: &'static str, value: f64| (name, value, value >= 0.0 && value.is_finite(), "0 or more");
    let above = |name: &'static str, value: f64| (name, value, value > 0.0, "above 0");
    let mut numbers = vec![
        share("gain", settings.gain),
        size("exploration.size", explored.size),
        size("exploration.largest", explored.largest),
        least("exploration.clarity", explored.clarity),
        size("curvature", settings.curvature),
        least("dither", settings.dither),
        above("divergence", settings.divergence),
        above("worst_condition", settings.worst_condition),
    ];
    match settings.update {
        Update::Keep | Update::Adaptive => {}
        Update::Broyden { rate, gate } => numbers.extend([share("rate", rate), least("gate", gate)]),
        Update::LeastSquares { forgetting, gate } => {
            numbers.extend([share("forgetting", forgetting), least("gate", gate)]);
        }
    }
    if let Some(Trust { motion, confidence, restraint }) = settings.trust {
        let of_trust = [size("motion", motion), least("confidence", confidence), least("restraint", restraint)];
        numbers.extend(of_trust);
    }
    numbers.extend(quantities.iter().map(|quantity| least("dead_band", quantity.dead_band)));
    if let Some((name, value, _, wanted)) = numbers.iter().find(|(_, _, is_fine, _)| !is_fine) {
        return Err(format!("`{name}` is {value}; it has to be {wanted}"));
    }
    let directions = explored.directions.len();
    if (1..n).contains(&directions) || explored.directions.iter().flatten().any(|number| !number.is_finite()) {
        return Err(format!(
            "{directions} exploratory directions; as many as the {n} quantities are needed, of finite numbers"
        ));
    }
    if let Some(direction) = explored.directions.iter().find(|direction| direction.len() != n) {
        return Err(format!("an exploratory direction of {} numbers, where {n} quantities move", direction.len()));
    }
    Ok(())
}
