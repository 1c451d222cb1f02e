//! Tests for factors, functions and variables of your own: their derivatives against differences, their axioms.
mod differences;
mod function;
mod graph;
mod variable;

pub use function::{factor, function};
pub use graph::graph;
pub use variable::variable;

/// How well everything agreed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Entries that were compared.
    pub entries: usize,
    /// The largest error, as a share of what is tolerated.
    pub worst: f64,
}

/// The entry that disagrees most.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what} [{row}, {column}] is {found}, expected {expected}")]
pub struct Mismatch {
    /// What was compared.
    pub what: String,
    /// Row of the entry: a residual, or a coordinate.
    pub row: usize,
    /// Column of the entry.
    pub column: usize,
    /// What an independent computation gives.
    pub expected: f64,
    /// What the code under test gives.
    pub found: f64,
    /// The error, as a share of what is tolerated.
    pub excess: f64,
}

/// Relative error of a derivative that is tolerated. Differences in double precision err by 1e-10.
const TOLERANCE: f64 = 1e-6;

/// Compares entry by entry and remembers the worst.
#[derive(Default)]
struct Comparison {
    entries: usize,
    worst: Option<Mismatch>,
}

impl Comparison {
    /// One entry. `size` is what an error is relative to, `uncertainty` how well the expected value is known.
    fn entry(&mut self, what: &str, at: (usize, usize), expected: f64, found: f64, size: f64, uncertainty: f64) {
        self.entries += 1;
        let size = size.max(f64::MIN_POSITIVE);
        let allowed = TOLERANCE * size + (10.0 * uncertainty).min(1e-3 * size);
        let error = (expected - found).abs() / allowed;
        let excess = if error.is_nan() { f64::INFINITY } else { error };
        if self.worst.as_ref().is_none_or(|worst| excess > worst.excess) {
            self.worst = Some(Mismatch { what: what.to_string(), row: at.0, column: at.1, expected, found, excess });
        }
    }

    fn finish(self) -> Result<Agreement, Mismatch> {
        match self.worst {
            Some(worst) if worst.excess > 1.0 => Err(worst),
            worst => Ok(Agreement { entries: self.entries, worst: worst.map_or(0.0, |worst| worst.excess) }),
        }
    }
}
