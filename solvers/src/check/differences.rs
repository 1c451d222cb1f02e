//! Derivatives by differences, to judge others by.

/// Steps of the differences: the longest, and how many there are, each a quarter of the one before.
const LONGEST: f64 = 1e-2;
const STEPS: usize = 6;

/// df/dh of a vector function at h = 0, with an estimate of the error of every entry.
///
/// Central differences over shrinking steps, extrapolated to step 0 (Ridders 1982): of every entry the extrapolation
/// that agrees best with its neighbours is taken, so that neither rounding nor curvature spoils it.
pub(super) fn derivative(mut f: impl FnMut(f64) -> Vec<f64>) -> Vec<(f64, f64)> {
    let mut table: Vec<Vec<f64>> = Vec::with_capacity(STEPS);
    let mut best: Vec<(f64, f64)> = Vec::new();
    let mut h = LONGEST;
    for step in 0..STEPS {
        let (above, below) = (f(h), f(-h));
        let central: Vec<f64> = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        // table[k] is the k-fold extrapolation of the last step; `row` becomes that of this one.
        let mut row = vec![central];
        let mut power = 1.0;
        for k in 0..step {
            power *= 16.0;
            let extrapolate = |(new, old): (&f64, &f64)| (new * power - old) / (power - 1.0);
            row.push(row[k].iter().zip(&table[k]).map(extrapolate).collect());
        }
        if step == 0 {
            best = row[0].iter().map(|&d| (d, f64::INFINITY)).collect();
        }
        for k in 1..row.len() {
            for (i, best) in best.iter_mut().enumerate() {
                let d = row[k][i];
                let error = (d - row[k - 1][i]).abs().max((d - table[k - 1][i]).abs());
                if error < best.1 {
                    *best = (d, error);
                }
            }
        }
        table = row;
        h *= 0.25;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::derivative;

    #[test]
    fn differences_find_derivatives_of_the_textbook_to_nine_digits() {
        let found = derivative(|h| vec![(0.3 + h).exp(), (100.0 * h).sin() / 100.0, 1.0 / (2.0 + h)]);
        for ((found, error), expected) in found.into_iter().zip([0.3f64.exp(), 1.0, -0.25]) {
            assert!((found - expected).abs() < 1e-9 && error < 1e-7, "{found} {expected} {error}");
        }
    }
}
