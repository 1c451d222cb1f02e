//! Small strictly convex quadratic programs, exactly: the dual active set method.
use super::quadratic_program::{Constraint, Qp, dot};

/// The method of Goldfarb and Idnani (1983, algorithm 1). It starts at the unconstrained minimum and adds the constraint that is violated
/// most, one after the other, so that the point always is the minimum under the constraints that are active.
///
/// With H = L Lᵀ and N the active a's as columns it keeps J = L⁻ᵀ Q and R such that Jᵀ N = (R, 0)ᵀ and Jᵀ H J = I.
#[derive(Default)]
pub(crate) struct ActiveSet {
    n: usize,
    /// x.
    pub x: Vec<f64>,
    /// Multiplier of every active constraint.
    pub multipliers: Vec<f64>,
    /// Places of the active constraints: upper bounds, lower bounds, rows.
    active: Vec<usize>,
    is_active: Vec<bool>,
    /// Lengths of the a's, by which violations are compared.
    norms: Vec<f64>,
    /// J by columns.
    j: Vec<f64>,
    /// R by columns.
    r: Vec<f64>,
    /// Jᵀ a of the constraint that comes in.
    d: Vec<f64>,
    /// How fast the multipliers of the active constraints fall as its own rises.
    falls: Vec<f64>,
    /// Constraints that cannot all hold, where that was found.
    pub conflict: Vec<Constraint>,
}

/// How the method ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// At the minimum.
    Found,
    /// The constraints in `conflict` cannot all hold; without any one of them, the others can.
    Conflict,
    /// Rounding keeps it from an end.
    Undecided,
}

/// Violations below this, in units of the box, are rounding.
const ROUNDING: f64 = 1e-10;

/// A constraint whose part outside the span of the active ones is a smaller share of it depends on them.
const DEPENDENT: f64 = 1e-11;

/// Constraints that are added, per constraint, before the method gives up.
const CHANGES: usize = 4;

impl ActiveSet {
    /// `factor`: L by rows; `minimum`: -H⁻¹ g; `scale`: units of the unknowns.
    pub fn solve(&mut self, qp: &Qp<'_>, factor: &[f64], minimum: &[f64], scale: &[f64]) -> Outcome {
        self.start(qp, factor, minimum, scale);
        for _ in 0..CHANGES * self.is_active.len() {
            let Some(entering) = self.most_violated(qp) else { return Outcome::Found };
            match self.add(qp, entering) {
                Outcome::Found => {}
                end => return end,
            }
        }
        Outcome::Undecided
    }

    /// Active constraints with their multipliers.
    pub fn active(&self) -> impl Iterator<Item = (Constraint, f64)> {
        self.active.iter().zip(&self.multipliers).map(|(&place, &multiplier)| (self.named(place), multiplier))
    }

    fn start(&mut self, qp: &Qp<'_>, factor: &[f64], minimum: &[f64], scale: &[f64]) {
        let (n, m) = (minimum.len(), qp.bounds.len());
        self.n = n;
        self.active.clear();
        self.multipliers.clear();
        self.conflict.clear();
        self.is_active.clear();
        self.is_active.resize(2 * n + m, false);
        self.x.clear();
        self.x.extend_from_slice(minimum);
        self.norms.clear();
        self.norms.extend(scale.iter().chain(scale));
        self.norms.extend((0..m).map(|i| {
            let row = &qp.rows[i * n..(i + 1) * n];
            row.iter().zip(scale).map(|(a, d)| (a * d) * (a * d)).sum::<f64>().sqrt().max(f64::MIN_POSITIVE)
        }));
        for list in [&mut self.j, &mut self.r] {
            list.clear();
            list.resize(n * n, 0.0);
        }
        // L⁻ᵀ, whose columns are the rows of L⁻¹.
        for column in 0..n {
            for i in column..n {
                let inner: f64 = (column..i).map(|k| factor[i * n + k] * self.j[k * n + column]).sum();
                self.j[i * n + column] = (f64::from(u8::from(i == column)) - inner) / factor[i * n + i];
            }
        }
    }

    /// The constraint that is violated by the most of its length.
    fn most_violated(&self, qp: &Qp<'_>) -> Option<usize> {
        let n = self.n;
        let (mut worst, mut most) = (None, ROUNDING);
        let mut consider = |place: usize, violation: f64| {
            let norm = self.norms[place];
            if violation > most * norm && !self.is_active[place] {
                (worst, most) = (Some(place), violation / norm);
            }
        };
        for (i, ((&x, &lower), &upper)) in self.x.iter().zip(qp.lower).zip(qp.upper).enumerate() {
            consider(i, x - upper.max(lower));
            consider(n + i, lower - x);
        }
        for (i, (row, bound)) in qp.rows.chunks_exact(n.max(1)).zip(qp.bounds).enumerate() {
            consider(2 * n + i, dot(row, &self.x) - bound);
        }
        worst
    }

    /// a·x - b.
    fn violation(&self, qp: &Qp<'_>, place: usize) -> f64 {
        let n = self.n;
        match place {
            _ if place < n => self.x[place] - qp.upper[place].max(qp.lower[place]),
            _ if place < 2 * n => qp.lower[place - n] - self.x[place - n],
            _ => dot(&qp.rows[(place - 2 * n) * n..][..n], &self.x) - qp.bounds[place - 2 * n],
        }
    }

    /// Moves to the minimum where a violated constraint holds too, letting go of those that then hold nothing back.
    fn add(&mut self, qp: &Qp<'_>, entering: usize) -> Outcome {
        let n = self.n;
        let mut multiplier = 0.0;
        // Every round but the last lets go of one.
        for _ in 0..=n {
            self.direction(qp, entering);
            let q = self.active.len();
            let square = |d: &[f64]| dot(d, d);
            let (outside, all) = (square(&self.d[q..]), square(&self.d));
            let depends = outside <= DEPENDENT * DEPENDENT * all;
            let full = if depends { f64::INFINITY } else { self.violation(qp, entering) / outside };
            let (mut step, mut leaving) = (full, None);
            for (k, (&falls, &multiplier)) in self.falls.iter().zip(&self.multipliers).enumerate() {
                let counts = falls * self.norms[self.active[k]] > DEPENDENT * self.norms[entering];
                if counts && multiplier / falls < step {
                    (step, leaving) = (multiplier / falls, Some(k));
                }
            }
            if depends && leaving.is_none() {
                self.name_conflict(entering);
                return Outcome::Conflict;
            }
            if !step.is_finite() {
                return Outcome::Undecided;
            }
            multiplier += step;
            self.multipliers.iter_mut().zip(&self.falls).for_each(|(multiplier, falls)| *multiplier -= step * falls);
            let Some(leaving) = leaving else {
                self.multipliers.push(multiplier);
                self.enter(entering);
                self.settle(qp);
                return Outcome::Found;
            };
            if !depends {
                for k in q..n {
                    let along = step * self.d[k];
                    self.x.iter_mut().zip(&self.j[k * n..]).for_each(|(x, j)| *x -= along * j);
                }
            }
            self.leave(leaving);
        }
        Outcome::Undecided
    }

    /// d = Jᵀ a, and R⁻¹ times its part in the span of the active constraints.
    fn direction(&mut self, qp: &Qp<'_>, place: usize) {
        let (n, q) = (self.n, self.active.len());
        self.d.clear();
        match place {
            _ if place < n => self.d.extend((0..n).map(|k| self.j[k * n + place])),
            _ if place < 2 * n => self.d.extend((0..n).map(|k| -self.j[k * n + place - n])),
            _ => {
                let row = &qp.rows[(place - 2 * n) * n..][..n];
                self.d.extend((0..n).map(|k| dot(row, &self.j[k * n..(k + 1) * n])));
            }
        }
        self.falls.clear();
        self.falls.extend_from_slice(&self.d[..q]);
        back_substitute(&self.r, n, &mut self.falls);
    }

    /// Appends a constraint whose d is known: rotations turn d into (R's new column, 0).
    fn enter(&mut self, place: usize) {
        let (n, q) = (self.n, self.active.len());
        for k in (q + 1..n).rev() {
            let (above, here) = (self.d[k - 1], self.d[k]);
            if here != 0.0 {
                let length = (above * above + here * here).sqrt();
                rotate(&mut self.j, n, k - 1, above / length, here / length);
                self.d[k - 1] = length;
            }
        }
        self.r[q * n..q * n + q + 1].copy_from_slice(&self.d[..=q]);
        self.active.push(place);
        self.is_active[place] = true;
    }

    /// Takes out the k-th active constraint: rotations make R triangular again.
    fn leave(&mut self, k: usize) {
        let n = self.n;
        self.is_active[self.active.remove(k)] = false;
        self.multipliers.remove(k);
        let q = self.active.len();
        self.r.copy_within((k + 1) * n..(q + 1) * n, k * n);
        for i in k..q {
            let (above, here) = (self.r[i * n + i], self.r[i * n + i + 1]);
            let length = (above * above + here * here).sqrt();
            let (c, s) = (above / length, here / length);
            for column in i..q {
                let (a, b) = (self.r[column * n + i], self.r[column * n + i + 1]);
                (self.r[column * n + i], self.r[column * n + i + 1]) = (c * a + s * b, c * b - s * a);
            }
            rotate(&mut self.j, n, i, c, s);
        }
    }

    /// x and the multipliers anew from the active constraints alone, so that nothing of the way there is left in them:
    /// x = J y with Rᵀ y₁ = b and y₂ = -J₂ᵀ g; R u = -(y₁ + J₁ᵀ g).
    fn settle(&mut self, qp: &Qp<'_>) {
        let (n, q) = (self.n, self.active.len());
        self.x.fill(0.0);
        for k in 0..n {
            let column = &self.j[k * n..(k + 1) * n];
            let slope = dot(column, qp.gradient);
            let y = if k < q {
                let place = self.active[k];
                let bound = match place {
                    _ if place < n => qp.upper[place].max(qp.lower[place]),
                    _ if place < 2 * n => -qp.lower[place - n],
                    _ => qp.bounds[place - 2 * n],
                };
                // d holds y.
                let y = (bound - dot(&self.r[k * n..k * n + k], &self.d[..k])) / self.r[k * n + k];
                self.multipliers[k] = -(y + slope);
                y
            } else {
                -slope
            };
            self.d[k] = y;
            self.x.iter_mut().zip(column).for_each(|(x, j)| *x += y * j);
        }
        back_substitute(&self.r, n, &mut self.multipliers);
        self.multipliers.iter_mut().for_each(|multiplier| *multiplier = multiplier.max(0.0));
    }

    /// Where a = Σ falls aᵢ over independent aᵢ with no positive falls, a and the aᵢ of the negative ones add up to 0 with positive
    /// weights, while their b add up to less: they cannot all hold. The weights are the only ones, hence the set is minimal.
    fn name_conflict(&mut self, entering: usize) {
        let length = self.norms[entering];
        self.conflict.push(self.named(entering));
        for (&place, &falls) in self.active.iter().zip(&self.falls) {
            if -falls * self.norms[place] > ROUNDING * length {
                self.conflict.push(self.named(place));
            }
        }
    }

    fn named(&self, place: usize) -> Constraint {
        match place {
            _ if place < self.n => Constraint::Upper(place),
            _ if place < 2 * self.n => Constraint::Lower(place - self.n),
            _ => Constraint::Row(place - 2 * self.n),
        }
    }
}

/// x = R⁻¹ x, R by columns of `n`.
fn back_substitute(r: &[f64], n: usize, x: &mut [f64]) {
    for i in (0..x.len()).rev() {
        x[i] /= r[i * n + i];
        let (before, here) = x.split_at_mut(i);
        before.iter_mut().zip(&r[i * n..]).for_each(|(x, r)| *x -= r * here[0]);
    }
}

/// Rotates column k of J and the next one into each other.
fn rotate(j: &mut [f64], n: usize, k: usize, c: f64, s: f64) {
    let (a, b) = j[k * n..(k + 2) * n].split_at_mut(n);
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
    }
}
