//! What tasks and limits write: linear rows in the joints' motion.

/// Rows J Δq ≈ e of the tasks of one priority, each divided by its standard deviation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TaskRows {
    n: usize,
    jacobian: Vec<f64>,
    errors: Vec<f64>,
    /// The share of each error that one step shall take away.
    shares: Vec<f64>,
}

/// Rows a·Δq ≤ b of the limits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LimitRows {
    n: usize,
    pub(super) rows: Vec<f64>,
    pub(super) bounds: Vec<f64>,
    pub(super) strengths: Vec<f64>,
    /// Which limit each is of, and its place among that limit's.
    pub(super) of: Vec<(usize, usize)>,
    /// The limit that adds rows now, and where its first one is.
    now: (usize, usize),
}

impl TaskRows {
    /// None yet, over `n` joints.
    pub fn clear(&mut self, n: usize) {
        self.n = n;
        self.jacobian.clear();
        self.errors.clear();
        self.shares.clear();
    }

    /// Adds a row: `slopes`, one per joint, times the motion shall be `change`. `sd`: standard deviation in their unit.
    pub fn push(&mut self, slopes: impl IntoIterator<Item = f64>, change: f64, sd: f64) {
        let weight = 1.0 / sd;
        self.jacobian.extend(slopes.into_iter().map(|slope| slope * weight));
        self.errors.push(change * weight);
        self.shares.push(1.0);
        debug_assert_eq!(self.jacobian.len(), self.n * self.errors.len());
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.errors.len()
    }

    /// True where there is none.
    pub fn is_empty(&self) -> bool {
        self.errors.is_empty()
    }

    /// A row over its standard deviation: slopes by the joints, and the change that is wanted.
    pub fn row(&self, i: usize) -> (&[f64], f64) {
        (&self.jacobian[i * self.n..(i + 1) * self.n], self.errors[i])
    }

    /// Slopes of every row by one joint.
    pub(super) fn column(&self, joint: usize) -> impl Iterator<Item = f64> {
        self.jacobian.iter().skip(joint).step_by(self.n.max(1)).copied()
    }

    /// What one step shall do of a row's error.
    pub(super) fn wanted(&self, i: usize) -> f64 {
        self.shares[i] * self.errors[i]
    }

    /// Lets one step take away this share only of the errors from the row `first` on.
    pub fn share(&mut self, first: usize, share: f64) {
        self.shares[first..].fill(share);
    }

    /// Sum of the squares of e.
    pub fn errors(&self) -> f64 {
        self.errors.iter().map(|error| error * error).sum()
    }

    /// Sum of the squares of J Δq - e.
    pub fn cost(&self, motion: &[f64]) -> f64 {
        let rest = |i| {
            let (slopes, change) = self.row(i);
            slopes.iter().zip(motion).map(|(slope, step)| slope * step).sum::<f64>() - change
        };
        (0..self.len()).map(|i| rest(i).powi(2)).sum()
    }
}

impl LimitRows {
    /// None yet, over `n` joints.
    pub fn clear(&mut self, n: usize) {
        self.n = n;
        self.now = (0, 0);
        self.rows.clear();
        self.bounds.clear();
        self.strengths.clear();
        self.of.clear();
    }

    /// Adds a row: `slopes`, one per joint, times the motion shall be at most `bound`, in any unit. A `strength` from 1 to 100
    /// says who gives way where rows cannot all hold: the smaller.
    pub fn push(&mut self, slopes: impl IntoIterator<Item = f64>, bound: f64, strength: f64) {
        let (limit, first) = self.now;
        self.of.push((limit, self.len() - first));
        self.rows.extend(slopes);
        self.bounds.push(bound);
        self.strengths.push(strength);
        debug_assert_eq!(self.rows.len(), self.n * self.bounds.len());
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.bounds.len()
    }

    /// True where there is none.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// The rows that follow are of the limit of that index.
    pub fn begin(&mut self, limit: usize) {
        self.now = (limit, self.len());
    }
}
