//! Losses: how much a large residual may pull.

/// ρ(s) of the squared whitened norm s = |r/σ|²; a factor costs ρ(s)/2. Widths k are in standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Loss {
    /// ρ = s: Gaussian noise.
    #[default]
    Squared,
    /// ρ = s up to k², then 2k√s - k²: grows linearly.
    Huber(f64),
    /// ρ = k² ln(1 + s/k²): heavy tails.
    Cauchy(f64),
    /// ρ = s k² / (s + k²): gross outliers lose all pull. Not convex: start it with [`crate::Graduated`].
    GemanMcClure(f64),
}

impl Loss {
    /// (ρ(s), ρ'(s)). `graduation` >= 1 widens Geman-McClure towards the squared loss (Yang et al. 2020, eq. 9, with k² μ
    /// in place of c̄² μ); 1 is the loss itself.
    #[inline]
    pub fn evaluate(self, s: f64, graduation: f64) -> (f64, f64) {
        match self {
            Loss::Squared => (s, 1.0),
            Loss::Huber(k) if s <= k * k => (s, 1.0),
            Loss::Huber(k) => {
                let root = s.sqrt();
                (2.0 * k * root - k * k, k / root)
            }
            Loss::Cauchy(k) => {
                let ratio = s / (k * k);
                (k * k * ratio.ln_1p(), 1.0 / (1.0 + ratio))
            }
            Loss::GemanMcClure(k) => {
                let c = graduation * k * k;
                let share = c / (s + c);
                (s * share, share * share)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Loss; 4] = [Loss::Squared, Loss::Huber(1.5), Loss::Cauchy(0.8), Loss::GemanMcClure(2.0)];

    #[test]
    fn every_loss_is_the_squared_one_near_zero_and_its_slope_is_its_derivative() {
        for loss in ALL {
            let (small, slope) = loss.evaluate(1e-10, 1.0);
            assert!((small / 1e-10 - 1.0).abs() < 1e-6 && (slope - 1.0).abs() < 1e-6, "{loss:?}");
            for s in [0.3, 1.0, 5.0, 80.0] {
                let h = 1e-6 * s;
                let difference = (loss.evaluate(s + h, 1.0).0 - loss.evaluate(s - h, 1.0).0) / (2.0 * h);
                assert!((difference - loss.evaluate(s, 1.0).1).abs() < 1e-7, "{loss:?} at {s}");
            }
        }
    }
}
