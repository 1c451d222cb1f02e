//! Whether servoing gets anywhere.

/// What is left of the errors, from step to step.
#[derive(Debug)]
pub(super) struct Stall {
    /// The least of it so far, and the steps since it fell.
    least: f64,
    steps: usize,
    /// Sum over these steps of how noisy errors were.
    noise: f64,
    /// What was left when the Jacobian was explored anew last.
    explored_at: f64,
    /// What was left when a motion was tried, and how many were since.
    tried_at: f64,
    trials: usize,
}

/// Steps without a fall by at least this share, after which the Jacobian is taken for wrong.
const STEPS: usize = 12;
const LEAST_FALL: f64 = 0.1;

/// Errors that no motion is known to remove speak against the Jacobian where they are more than noise by this many standard deviations of
/// their χ², and at least this share of what is left.
const UNEXPLAINED: f64 = 6.0;
const LARGE: f64 = 0.5;

/// Exploring anew has to pay: what is left falls below this share of what was left before, or it is not done again.
const PAYS: f64 = 0.5;

/// Errors below this many standard deviations, root mean square, are left: exploring would disturb more than it mends.
const WORTH: f64 = 4.0;

impl Default for Stall {
    fn default() -> Self {
        Stall {
            least: f64::INFINITY,
            steps: 0,
            noise: 0.0,
            explored_at: f64::INFINITY,
            tried_at: f64::INFINITY,
            trials: 0,
        }
    }
}

impl Stall {
    /// True where errors should have become smaller for long, and are more than noise. `left`: the sum of the squared errors of `rows` rows
    /// over their variances; `noise`: by how much they changed otherwise than expected in the last step, as a mean square over variances, 1
    /// where the variances are right; `is_excused`: something else keeps them where they are.
    pub fn judge(&mut self, left: f64, rows: usize, noise: f64, is_excused: bool) -> bool {
        if is_excused || left < (1.0 - LEAST_FALL) * self.least {
            (self.least, self.steps, self.noise) = (left, 0, 0.0);
            return false;
        }
        self.steps += 1;
        self.noise += noise;
        let by_noise = WORTH * WORTH * rows as f64 * f64::max(1.0, self.noise / self.steps as f64);
        self.steps > STEPS && left > by_noise && left < PAYS * self.explored_at
    }

    /// True where a motion shall be tried to learn from, which is at most once per quantity for each time that it has paid. `left` and `rows`: as
    /// for [`Stall::judge`]; `removable`: by how much a motion is known to reduce it.
    pub fn tries(&mut self, left: f64, removable: f64, rows: usize, quantities: usize) -> bool {
        let (unexplained, freedoms) = (left - removable, rows.saturating_sub(quantities) as f64);
        if freedoms == 0.0 || unexplained < (LARGE * left).max(freedoms + UNEXPLAINED * (2.0 * freedoms).sqrt()) {
            return false;
        }
        if left < PAYS * self.tried_at {
            (self.tried_at, self.trials) = (left, 0);
        }
        self.trials += 1;
        self.trials <= quantities
    }

    /// What shall be seen has moved.
    pub fn shifts(&mut self) {
        *self = Stall { tried_at: self.tried_at, trials: self.trials, ..Stall::default() };
    }

    /// The Jacobian is explored anew where so much is left.
    pub fn explores(&mut self) {
        *self = Stall { explored_at: self.least, ..Stall::default() };
    }
}
