//! A conic through tracked points, and how far a point is from it.
use handeye_solvers::Scalar;
use nalgebra::Vector3;

/// A x² + B x y + C y² + D x + E y = 1, with x and y from the mean of its points in units of their size; that mean is inside of it.
pub(super) struct Conic<T> {
    coefficients: [T; 5],
    mean: [T; 2],
    size: T,
}

impl<T: Scalar> Conic<T> {
    /// The conic nearest to five or more points, by least squares of the equation; NaN where they do not determine one.
    pub fn through(points: &[Vector3<T>]) -> Self {
        let n = points.len() as f64;
        let sum = |value: &dyn Fn(&Vector3<T>) -> T| points.iter().fold(T::from(0.0), |sum, point| sum + value(point));
        let mean = [sum(&|p| p.x) / n, sum(&|p| p.y) / n];
        let away = |p: &Vector3<T>| [p.x - mean[0], p.y - mean[1]];
        let size = (sum(&|p| {
            let [x, y] = away(p);
            x * x + y * y
        }) / n)
            .sqrt();
        let mut normal = [[T::from(0.0); 5]; 5];
        let mut right = [T::from(0.0); 5];
        for point in points {
            let [x, y] = away(point).map(|value| value / size);
            let row = [x * x, x * y, y * y, x, y];
            for i in 0..5 {
                right[i] += row[i];
                for j in 0..5 {
                    normal[i][j] += row[i] * row[j];
                }
            }
        }
        Conic { coefficients: solve(normal, right), mean, size }
    }

    /// Signed distance of a point along the gradient, by the equation's value and its first two derivatives there: Sampson's to first
    /// order, and exact for circles [px].
    ///
    ///   f + |g| t + h t² / 2 = 0 with h = gᵀ H g / |g|²; -t = 2 f / (|g| + √(|g|² - 2 f h))
    pub fn distance(&self, point: &Vector3<T>) -> T {
        let [a, b, c, d, e] = self.coefficients;
        let [x, y] = [(point.x - self.mean[0]) / self.size, (point.y - self.mean[1]) / self.size];
        let value = a * x * x + b * x * y + c * y * y + d * x + e * y - 1.0;
        let gradient = [a * x * 2.0 + b * y + d, b * x + c * y * 2.0 + e];
        let square = gradient[0] * gradient[0] + gradient[1] * gradient[1];
        let bend = (a * gradient[0] * gradient[0] + b * gradient[0] * gradient[1] + c * gradient[1] * gradient[1])
            * 2.0
            / square;
        let root = square - value * bend * 2.0;
        // Where the parabola along the gradient has no zero, the line along it has.
        let root = if root.value() > 0.0 { root } else { square };
        value * 2.0 / (square.sqrt() + root.sqrt()) * self.size
    }
}

/// Solves a symmetric positive definite system by LDLᵀ without pivots; NaN where it is singular.
fn solve<T: Scalar>(mut a: [[T; 5]; 5], mut b: [T; 5]) -> [T; 5] {
    let largest = (0..5).map(|i| a[i][i].value()).fold(0.0, f64::max);
    for k in 0..5 {
        if a[k][k].value().is_nan() || a[k][k].value() <= SINGULAR * largest {
            return [T::from(f64::NAN); 5];
        }
        for i in k + 1..5 {
            let factor = a[i][k] / a[k][k];
            let above = a[k];
            a[i].iter_mut().zip(above).skip(k).for_each(|(entry, above)| *entry -= factor * above);
            let above = b[k];
            b[i] -= factor * above;
        }
    }
    for k in (0..5).rev() {
        let later = (k + 1..5).fold(T::from(0.0), |sum, j| sum + a[k][j] * b[j]);
        b[k] = (b[k] - later) / a[k][k];
    }
    b
}

/// A pivot this small against the largest entry is nothing but rounding.
const SINGULAR: f64 = 1e-13;
