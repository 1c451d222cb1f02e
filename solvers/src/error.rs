//! What a minimiser cannot work on. Not converging is not among it: that is a result.

/// Why a problem was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A residual is NaN or infinite where the minimiser starts.
    #[error("factor {factor} gives {value} at the starting values")]
    NotFinite {
        /// Index of the factor, in the order in which factors were added.
        factor: usize,
        /// What it gave.
        value: f64,
    },
    /// Nothing is free.
    #[error("the problem has no free node, so there is nothing to estimate")]
    NothingFree,
    /// The data leave a free node open, so it has no covariance.
    #[error("the data do not determine every free node: the normal equations are singular")]
    Singular,
    /// A factor is on too many nodes, or on none.
    #[error("a factor is on 1 to {most} nodes, found {found}")]
    Arguments {
        /// How many.
        found: usize,
        /// How many at most.
        most: usize,
    },
}
