//! Trackers of whole pixels, and what they tell.
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Which rows are seen in whole pixels: those that have changed by whole pixels only.
#[derive(Debug, Default)]
pub(super) struct WholePixels {
    /// Of each row, how often it has changed so far; `None` where it has changed otherwise.
    changes: Vec<Option<usize>>,
}

/// Changes by whole pixels that are no chance, and how near they are to it [px].
const CHANGES: usize = 4;
const NEAR: f64 = 1e-6;

/// Variance of what rounding leaves out of a pixel [px²].
pub(super) const ROUNDED: f64 = 1.0 / 12.0;

/// Noise of a row of whole pixels is at least this beside its rounding, and wanders by as much in a step [px].
const LEAST_SD: f64 = 0.1;

impl WholePixels {
    /// Of as many rows.
    pub fn new(rows: usize) -> Self {
        WholePixels { changes: vec![Some(0); rows] }
    }

    /// Takes in errors [px], and those before; NaN where a row was not seen.
    pub fn take_in(&mut self, before: &[f64], now: &[f64]) {
        for ((changes, before), now) in self.changes.iter_mut().zip(before).zip(now) {
            let change = (now - before).abs();
            if change > 0.0 && change.is_finite() {
                *changes = changes.filter(|_| (change - change.round()).abs() < NEAR).map(|count| count + 1);
            }
        }
    }

    /// Whether a row is seen in whole pixels.
    pub fn are_of(&self, row: usize) -> bool {
        self.changes[row].is_some_and(|changes| changes >= CHANGES)
    }
}

/// Variance of a row's noise beside the rounding of what moves and of its target [px²], of `variance` in all.
pub(super) fn beside_rounding(variance: f64) -> f64 {
    (variance - 2.0 * ROUNDED).max(LEAST_SD * LEAST_SD)
}

/// Variance by which the target of a row of whole pixels wanders in a step [px²].
pub(super) const WANDER: f64 = LEAST_SD * LEAST_SD;

/// Mean and variance of a standard normal number that is between two.
pub(super) fn between(low: f64, high: f64) -> [f64; 2] {
    // On the side where it decays, shares do not cancel.
    let (sign, low, high) = if low + high > 0.0 { (1.0, low, high) } else { (-1.0, -high, -low) };
    let beyond = |x: f64| 0.5 * libm::erfc(FRAC_1_SQRT_2 * x);
    let share = beyond(low) - beyond(high);
    if share < f64::MIN_POSITIVE {
        return [sign * low, 0.0];
    }
    let density = |x: f64| (-0.5 * x * x).exp() / (2.0 * PI).sqrt();
    let mean = (density(low) - density(high)) / share;
    let variance = 1.0 + (low * density(low) - high * density(high)) / share - mean * mean;
    [sign * mean.clamp(low, high), variance.clamp(0.0, 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_between_two_numbers_are_those_of_a_sum() {
        for (low, high) in [(-0.5, 0.5), (-3.0, 1.0), (2.0, 2.5), (-6.0, -5.0), (7.0, 9.0), (-50.0, 50.0)] {
            let steps = 200_000;
            let at = |i: usize| low + (high - low) * (i as f64 + 0.5) / steps as f64;
            // Over the largest density there is, so that none vanishes.
            let nearest = if low > 0.0 { low } else { f64::min(high, 0.0) };
            let weight = |x: f64| (0.5 * (nearest * nearest - x * x)).exp();
            let sum = |f: &dyn Fn(f64) -> f64| (0..steps).map(|i| weight(at(i)) * f(at(i))).sum::<f64>();
            let mean = sum(&|x| x) / sum(&|_| 1.0);
            let variance = sum(&|x| (x - mean).powi(2)) / sum(&|_| 1.0);
            let found = between(low, high);
            assert!((found[0] - mean).abs() < 1e-6, "{low} to {high}: {found:?}, {mean}");
            assert!((found[1] - variance).abs() < 1e-6, "{low} to {high}: {found:?}, {variance}");
        }
        assert_eq!(between(60.0, 61.0), [60.0, 0.0]);
        assert_eq!(between(-61.0, -60.0), [-60.0, 0.0]);
    }

    #[test]
    fn whole_pixels_are_told_from_others_by_how_they_change() {
        let mut whole = WholePixels::new(4);
        // Against a target that is not whole; seen to a tenth; at rest; lost at times.
        let at =
            |i: usize| [17.3 - i as f64, 0.1 * i as f64, 5.0, if i.is_multiple_of(3) { f64::NAN } else { i as f64 }];
        for i in 0..12 {
            whole.take_in(&at(i), &at(i + 1));
            assert_eq!(whole.are_of(0), i >= 3);
        }
        assert_eq!([0, 1, 2, 3].map(|row| whole.are_of(row)), [true, false, false, true]);
        whole.take_in(&[0.0; 4], &[0.5; 4]);
        assert_eq!([0, 1, 2, 3].map(|row| whole.are_of(row)), [false; 4]);
    }
}
