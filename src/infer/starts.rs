//! Starts that fill the limits of the joints evenly.
use super::joint_box::JointBox;

/// An endless sequence of joints inside their limits.
///
/// The Kronecker sequence of the generalised golden ratio (Roberts 2018): xₖ = frac(s + k α) with αᵢ = φ⁻ⁱ and φⁿ⁺¹ = φ + 1. It leaves
/// smaller gaps than random numbers, and needs no state but a position.
#[derive(Clone, Debug)]
pub(super) struct Starts {
    phi: f64,
    /// Position in every coordinate before its own α: shift by the seed, and steps so far.
    shift: f64,
    count: u64,
}

impl Starts {
    pub fn new(n: usize, seed: u64) -> Self {
        // The fixed point of φ = (1 + φ)^(1 / (n + 1)).
        let power = 1.0 / (n + 1) as f64;
        let phi = (0..16).fold(1.5_f64, |phi, _| (1.0 + phi).powf(power));
        let shift = (seed as f64 * 0.618_033_988_749_895).fract();
        Starts { phi, shift, count: 0 }
    }

    pub fn next(&mut self, limits: &JointBox, joints: &mut [f64]) {
        self.count += 1;
        let mut alpha = 1.0;
        for (i, joint) in joints.iter_mut().enumerate() {
            alpha /= self.phi;
            let (lower, upper) = limits.range(i);
            *joint = lower + (upper - lower) * (self.shift + self.count as f64 * alpha).fract();
        }
    }
}
