//! How much of the error a step takes away.

/// Share of the error that one step of a visual controller takes away, kept within 0 and 1.
///
/// 1 arrives with one step where the interaction matrix is right and nothing holds the motion back. A loop of a fixed rate whose error
/// shall fall by λ [1/s] takes 1 - exp(-λ dt).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gain {
    /// The same at any error.
    Constant(f64),
    /// Small where the error x is large and large near the goal, where a constant gain would either start too fast or end too slowly:
    ///
    ///   λ(x) = (λ₀ - λ∞) exp(-s x / |λ₀ - λ∞|) + λ∞
    ///
    /// x is the largest entry of the error: [px] image-based, [rad] or [m] pose-based. ViSP's `vpAdaptiveGain` is the same function
    /// (of normalised coordinates: its slope is fx times this one).
    Adaptive {
        /// λ₀, at the goal.
        near: f64,
        /// λ∞, where the error is large.
        far: f64,
        /// s: how fast the gain falls as the error grows from 0 [1/px, or 1/rad and 1/m].
        slope: f64,
    },
}

impl Gain {
    /// The share at an error whose largest entry is `error`.
    pub fn share(&self, error: f64) -> f64 {
        let share = match *self {
            Gain::Constant(share) => share,
            Gain::Adaptive { near, far, .. } if near == far => far,
            Gain::Adaptive { near, far, slope } => {
                (near - far) * (-slope * error.abs() / (near - far).abs()).exp() + far
            }
        };
        if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
    }
}

impl Default for Gain {
    /// The whole error.
    fn default() -> Self {
        Gain::Constant(1.0)
    }
}
