//! A damped Gauss-Newton step inside a box: a small quadratic program, solved by an active set.

/// Minimises ½ sᵀ (H + Λ) s - gᵀ s over lower <= s <= upper. Kept between calls, so that none but the first allocates.
#[derive(Clone, Debug, Default)]
pub(super) struct BoxStep {
    /// The minimiser.
    pub step: Vec<f64>,
    /// Coordinates that are not held at a bound.
    free: Vec<usize>,
    /// Lower triangle of the factor of the free part, by rows.
    factor: Vec<f64>,
    solution: Vec<f64>,
}

/// Times that the set of coordinates at their bounds may change per coordinate: each change lowers the cost but for rounding.
const CHANGES: usize = 4;

impl BoxStep {
    /// `hessian`: H by rows, n x n, of which the lower triangle is read. `damping`: the diagonal of Λ, positive, so that H may be
    /// singular. The box contains 0: lower <= 0 <= upper. False where the matrix is not positive definite or not finite.
    pub fn solve(&mut self, hessian: &[f64], gradient: &[f64], damping: f64, lower: &[f64], upper: &[f64]) -> bool {
        let n = gradient.len();
        self.step.clear();
        self.step.resize(n, 0.0);
        self.free.clear();
        // At 0, a coordinate at its bound is held there where the gradient points outward.
        let leads_out = |i: usize| (upper[i] <= 0.0 && gradient[i] > 0.0) || (lower[i] >= 0.0 && gradient[i] < 0.0);
        self.free.extend((0..n).filter(|&i| !leads_out(i)));
        for _ in 0..CHANGES * n.max(1) {
            if !self.solve_free(hessian, gradient, damping) {
                return false;
            }
            // The whole step, or as far as the first bound in its way.
            let (mut share, mut blocking) = (1.0, None);
            for (place, &i) in self.free.iter().enumerate() {
                let (from, to) = (self.step[i], self.solution[place]);
                let bound = if to > upper[i] {
                    upper[i]
                } else if to < lower[i] {
                    lower[i]
                } else {
                    continue;
                };
                let reached = ((bound - from) / (to - from)).clamp(0.0, 1.0);
                if blocking.is_none() || reached < share {
                    (share, blocking) = (reached, Some((place, bound)));
                }
            }
            for (place, &i) in self.free.iter().enumerate() {
                self.step[i] += share * (self.solution[place] - self.step[i]);
            }
            if let Some((place, bound)) = blocking {
                let i = self.free.remove(place);
                self.step[i] = bound;
                continue;
            }
            let Some(released) = self.release(hessian, gradient, damping, lower, upper) else { return true };
            self.free.push(released);
            self.free.sort_unstable();
        }
        true
    }

    /// The coordinate at a bound whose way back lowers the cost most.
    fn release(&self, hessian: &[f64], gradient: &[f64], damping: f64, lower: &[f64], upper: &[f64]) -> Option<usize> {
        let n = gradient.len();
        let held = (0..n).filter(|i| !self.free.contains(i) && lower[*i] < upper[*i]);
        let pull = |i: usize| {
            let slope: f64 = (0..n).map(|j| symmetric(hessian, n, i, j) * self.step[j]).sum();
            let down = gradient[i] - slope - damping * self.step[i];
            // Inward from the bound that it is at.
            let is_upper = self.step[i] >= upper[i];
            (i, if is_upper { -down } else { down }, gradient[i].abs() + slope.abs())
        };
        let inward = held.map(pull).filter(|(_, inward, size)| *inward > 1e-9 * size);
        inward.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, ..)| i)
    }

    /// Solves for the free coordinates, those at bounds being where `step` has them (Cholesky).
    fn solve_free(&mut self, hessian: &[f64], gradient: &[f64], damping: f64) -> bool {
        let (n, m) = (gradient.len(), self.free.len());
        let BoxStep { step, free, factor, solution } = self;
        factor.resize(n * n, 0.0);
        solution.clear();
        let all_free = m == n;
        for &i in free.iter() {
            let mut right = gradient[i];
            if !all_free {
                right -=
                    (0..n).filter(|j| !free.contains(j)).map(|j| symmetric(hessian, n, i, j) * step[j]).sum::<f64>();
            }
            solution.push(right);
        }
        for (row, &i) in free.iter().enumerate() {
            let (done, rest) = factor.split_at_mut(row * n);
            for (column, &j) in free[..=row].iter().enumerate() {
                let value = symmetric(hessian, n, i, j);
                if column < row {
                    let other = &done[column * n..];
                    let dot: f64 = (0..column).map(|k| rest[k] * other[k]).sum();
                    rest[column] = (value - dot) / other[column];
                } else {
                    let pivot = value + damping - rest[..row].iter().map(|x| x * x).sum::<f64>();
                    if !(pivot > 0.0 && pivot.is_finite()) {
                        return false;
                    }
                    rest[row] = pivot.sqrt();
                }
            }
        }
        for row in 0..m {
            let dot: f64 = (0..row).map(|k| factor[row * n + k] * solution[k]).sum();
            solution[row] = (solution[row] - dot) / factor[row * n + row];
        }
        for row in (0..m).rev() {
            let dot: f64 = (row + 1..m).map(|k| factor[k * n + row] * solution[k]).sum();
            solution[row] = (solution[row] - dot) / factor[row * n + row];
        }
        true
    }
}

#[inline]
fn symmetric(matrix: &[f64], n: usize, i: usize, j: usize) -> f64 {
    if i >= j { matrix[i * n + j] } else { matrix[j * n + i] }
}

#[cfg(test)]
mod tests {
    use super::*;

    // The optimality conditions, which are sufficient for a convex problem: the slope vanishes where a coordinate is free and
    // leads outward at a bound.
    #[test]
    fn steps_are_optimal_inside_their_box() {
        let mut solver = BoxStep::default();
        let mut bounds = 0;
        for trial in 0..2000 {
            let n = 1 + trial % 7;
            let number = |k: usize| ((trial * 131 + k * 17) as f64 * 0.7311).sin() * 2.0;
            // Of rank n - 1, and more often than not with a minimum outside the box.
            let rows: Vec<f64> = (0..n * n).map(|k| if k < n { 0.0 } else { number(k) }).collect();
            let hessian: Vec<f64> =
                (0..n * n).map(|at| (0..n).map(|k| rows[k * n + at / n] * rows[k * n + at % n]).sum()).collect();
            let gradient: Vec<f64> = (0..n).map(|k| number(100 + k)).collect();
            let lower: Vec<f64> = (0..n).map(|k| if k == trial % 5 { 0.0 } else { -number(200 + k).abs() }).collect();
            let upper: Vec<f64> =
                (0..n).map(|k| if k == trial % 3 { f64::INFINITY } else { number(300 + k).abs() }).collect();
            let damping = 1e-2;
            assert!(solver.solve(&hessian, &gradient, damping, &lower, &upper));
            for i in 0..n {
                let s = solver.step[i];
                assert!(s >= lower[i] && s <= upper[i]);
                let slope: f64 =
                    damping * s - gradient[i] + (0..n).map(|j| hessian[i * n + j] * solver.step[j]).sum::<f64>();
                let free = s > lower[i] && s < upper[i];
                bounds += usize::from(!free);
                let allowed = 1e-7;
                let optimal = (slope.abs() < allowed)
                    || (s >= upper[i] && slope < allowed)
                    || (s <= lower[i] && slope > -allowed);
                assert!(optimal, "trial {trial}: slope {slope} at {s} in {} to {}", lower[i], upper[i]);
            }
        }
        assert!(bounds > 1000, "{bounds}");
    }

    #[test]
    fn what_is_not_finite_is_refused() {
        let mut solver = BoxStep::default();
        assert!(!solver.solve(&[f64::NAN], &[1.0], 1e-3, &[-1.0], &[1.0]));
        assert!(!solver.solve(&[-1.0], &[1.0], 1e-3, &[-1.0], &[1.0]));
    }
}
