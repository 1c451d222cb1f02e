//! Real roots of a polynomial in one variable.

/// Enough to halve an interval down to rounding where Newton's method never helps.
const ITERATIONS: usize = 80;

/// All real roots where the polynomial changes sign, in no particular order. `coefficients`: constant first.
///
/// Between two neighbouring roots of the derivative there is at most one root, so roots are found from the last
/// derivative upwards, on [-1, 1]; those beyond are the inverse roots of the reversed polynomial.
pub(super) fn real_roots(coefficients: &[f64]) -> Vec<f64> {
    let scale = coefficients.iter().fold(0.0_f64, |max, c| max.max(c.abs()));
    if !(scale > 0.0 && scale.is_finite()) {
        return Vec::new();
    }
    let scaled: Vec<f64> = coefficients.iter().map(|c| c / scale).collect();
    let reversed: Vec<f64> = scaled.iter().rev().copied().collect();
    let mut roots = roots_inside(&scaled);
    roots.extend(roots_inside(&reversed).into_iter().filter(|r| r.abs() < 1.0 && *r != 0.0).map(f64::recip));
    roots
}

/// Roots in [-1, 1], ascending.
fn roots_inside(polynomial: &[f64]) -> Vec<f64> {
    if polynomial.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> = polynomial.iter().enumerate().skip(1).map(|(k, c)| k as f64 * c).collect();
    let mut breaks = vec![-1.0];
    breaks.extend(roots_inside(&derivative));
    breaks.push(1.0);
    breaks.windows(2).filter_map(|ends| root_between(polynomial, &derivative, ends[0], ends[1])).collect()
}

/// Newton's method, kept within an interval at whose ends the signs differ.
fn root_between(polynomial: &[f64], derivative: &[f64], mut low: f64, mut high: f64) -> Option<f64> {
    let rising = evaluate(polynomial, low) < 0.0;
    if rising == (evaluate(polynomial, high) < 0.0) {
        return None;
    }
    let mut x = 0.5 * (low + high);
    for _ in 0..ITERATIONS {
        let value = evaluate(polynomial, x);
        if (value < 0.0) == rising {
            low = x
        } else {
            high = x
        }
        let newton = x - value / evaluate(derivative, x);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - x).abs() <= 1e-16 {
            break;
        }
        x = next;
    }
    Some(x)
}

/// Horner's rule.
fn evaluate(polynomial: &[f64], x: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Coefficients of a product. `N` is the sum of the two degrees, plus one.
pub(super) fn multiply<const N: usize>(a: &[f64], b: &[f64]) -> [f64; N] {
    let mut product = [0.0; N];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            product[i + j] += x * y;
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_that_were_multiplied_together_are_found_again() {
        let expected = [-7.0, -1.5, -0.3, 0.01, 0.4, 0.9, 2.0, 11.0];
        let mut polynomial = vec![1.0, 0.0, 1.0]; // x² + 1 has none
        for root in expected {
            let mut next = vec![0.0; polynomial.len() + 1];
            for (k, c) in polynomial.iter().enumerate() {
                next[k + 1] += c;
                next[k] -= root * c;
            }
            polynomial = next;
        }
        let mut found = real_roots(&polynomial);
        found.sort_by(f64::total_cmp);
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-9 * e.abs()), "{found:?}");
    }

    #[test]
    fn a_polynomial_of_nothing_has_no_roots() {
        assert!(real_roots(&[0.0; 11]).is_empty());
        assert!(real_roots(&[f64::NAN; 3]).is_empty());
        assert!(real_roots(&[1.0]).is_empty());
        assert_eq!(multiply::<3>(&[1.0, 2.0], &[3.0, 4.0]), [3.0, 10.0, 8.0]);
    }
}
