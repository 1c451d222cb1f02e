//! The essential matrices of five correspondences (Nistér 2004, An efficient solution to the five-point relative pose
//! problem).
//!
//! E = x X + y Y + z Z + W over the four matrices that fulfil bᵀ E a = 0 for all five. Ten cubics in x, y, z have to
//! vanish,
//!
//!   det E = 0 and 2 E Eᵀ E - tr(E Eᵀ) E = 0,
//!
//! and eliminating the ten monomials of highest order in x and y from them leaves a 3 x 3 matrix over z whose
//! determinant, of degree ten, is 0 at the solutions.
use super::polynomial::{multiply, real_roots};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Coefficients of x, y, z, 1.
type Linear = [f64; 4];
/// Coefficients of x², xy, y², xz, yz, z², x, y, z, 1.
type Quadratic = [f64; 10];
/// Coefficients of x³, y³, x²y, xy², x²z, x², y²z, y², xyz, xy, then xz², xz, x, yz², yz, y, z³, z², z, 1.
type Cubic = [f64; 20];

/// Where a product of two of x, y, z, 1 stands in a quadratic.
const QUADRATIC: [[usize; 4]; 4] = [[0, 1, 3, 6], [1, 2, 4, 7], [3, 4, 5, 8], [6, 7, 8, 9]];
/// Where a term of a quadratic times x, y, z, 1 stands in a cubic.
const CUBIC: [[usize; 4]; 10] = [
    [0, 2, 4, 5],
    [2, 3, 8, 9],
    [3, 1, 6, 7],
    [4, 8, 10, 11],
    [8, 6, 13, 14],
    [10, 13, 16, 17],
    [5, 9, 11, 12],
    [9, 7, 14, 15],
    [11, 14, 17, 18],
    [12, 15, 18, 19],
];

/// Newton steps on the ten cubics, which restore the digits that the polynomial of degree ten loses.
const POLISH: usize = 3;

/// The essential matrices E with bᵢᵀ E aᵢ = 0, at most 10, of Frobenius norm √2 and rank 2.
///
/// `a`, `b`: unit bearings of the same points in the frames of two cameras. E = [t] R for p_b = R p_a + t. Points may
/// lie in a plane. Empty where the five do not determine a finite number of solutions.
pub fn five_point(a: &[Vector3<f64>; 5], b: &[Vector3<f64>; 5]) -> Vec<Matrix3<f64>> {
    let Some(basis) = null_space(a, b) else { return Vec::new() };
    let Some(rows) = eliminate(constraints(&basis)) else { return Vec::new() };
    let [b1, b2, b3] = [hidden(&rows, 4), hidden(&rows, 6), hidden(&rows, 8)];
    // det of the 3 x 3 matrix with columns of degree 3, 3, 4.
    let minor = |p: &Hidden, q: &Hidden| -> [f64; 7] {
        let (plus, minus) = (multiply::<7>(&p.x, &q.y), multiply::<7>(&p.y, &q.x));
        std::array::from_fn(|k| plus[k] - minus[k])
    };
    let parts = [
        multiply::<11>(&b1.one, &minor(&b2, &b3)),
        multiply::<11>(&b2.one, &minor(&b3, &b1)),
        multiply::<11>(&b3.one, &minor(&b1, &b2)),
    ];
    let determinant: [f64; 11] = std::array::from_fn(|k| parts.iter().map(|part| part[k]).sum());
    let solution = |z: f64| {
        let at = [b1.at(z), b2.at(z), b3.at(z)];
        let crosses = [at[0].cross(&at[1]), at[0].cross(&at[2]), at[1].cross(&at[2])];
        let null = crosses.into_iter().max_by(|p, q| p.norm_squared().total_cmp(&q.norm_squared()))?;
        polish(&basis, Vector3::new(null.x / null.z, null.y / null.z, z))
    };
    real_roots(&determinant).into_iter().filter_map(solution).collect()
}

/// Four orthonormal matrices with bᵀ E a = 0 for the five correspondences.
fn null_space(a: &[Vector3<f64>; 5], b: &[Vector3<f64>; 5]) -> Option<[Matrix3<f64>; 4]> {
    let mut projector = SMatrix::<f64, 9, 9>::identity();
    for (a, b) in a.iter().zip(b) {
        let row = SVector::<f64, 9>::from_fn(|k, _| b[k % 3] * a[k / 3]);
        let rest = projector * row;
        let direction = rest.try_normalize(1e-9 * row.norm())?;
        // Twice, for orthogonality to rounding.
        let direction = (projector * direction).normalize();
        projector -= direction * direction.transpose();
    }
    let mut basis = [Matrix3::zeros(); 4];
    for matrix in &mut basis {
        let longest = (0..9).max_by(|&i, &j| projector[(i, i)].total_cmp(&projector[(j, j)]))?;
        let direction = projector.column(longest).into_owned().try_normalize(1e-9)?;
        projector -= direction * direction.transpose();
        *matrix = Matrix3::from_column_slice(direction.as_slice());
    }
    Some(basis)
}

/// The ten cubics: nine elements of (E Eᵀ - tr(E Eᵀ) / 2) E and det E.
fn constraints(basis: &[Matrix3<f64>; 4]) -> [Cubic; 10] {
    let e: [[Linear; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| std::array::from_fn(|k| basis[k][(i, j)])));
    let mut gram = [[[0.0; 10]; 3]; 3];
    for i in 0..3 {
        for j in 0..=i {
            (0..3).for_each(|k| add_quadratic(&mut gram[i][j], &e[i][k], &e[j][k], 1.0));
            gram[j][i] = gram[i][j];
        }
    }
    let half_trace: Quadratic = std::array::from_fn(|k| 0.5 * (gram[0][0][k] + gram[1][1][k] + gram[2][2][k]));
    for (i, row) in gram.iter_mut().enumerate() {
        (0..10).for_each(|k| row[i][k] -= half_trace[k]);
    }
    let mut cubics = [[0.0; 20]; 10];
    for i in 0..3 {
        for j in 0..3 {
            (0..3).for_each(|k| add_cubic(&mut cubics[3 * i + j], &gram[i][k], &e[k][j]));
        }
    }
    for k in 0..3 {
        let (l, m) = ((k + 1) % 3, (k + 2) % 3);
        let mut minor = [0.0; 10];
        add_quadratic(&mut minor, &e[1][l], &e[2][m], 1.0);
        add_quadratic(&mut minor, &e[1][m], &e[2][l], -1.0);
        add_cubic(&mut cubics[9], &minor, &e[0][k]);
    }
    cubics
}

fn add_quadratic(sum: &mut Quadratic, a: &Linear, b: &Linear, sign: f64) {
    for i in 0..4 {
        for j in 0..4 {
            sum[QUADRATIC[i][j]] += sign * a[i] * b[j];
        }
    }
}

fn add_cubic(sum: &mut Cubic, a: &Quadratic, b: &Linear) {
    for i in 0..10 {
        for j in 0..4 {
            sum[CUBIC[i][j]] += a[i] * b[j];
        }
    }
}

/// Gauss-Jordan elimination of the first ten monomials, with row pivots.
fn eliminate(mut rows: [Cubic; 10]) -> Option<[Cubic; 10]> {
    for column in 0..10 {
        let pivot = (column..10).max_by(|&i, &j| rows[i][column].abs().total_cmp(&rows[j][column].abs()))?;
        rows.swap(column, pivot);
        let inverse = rows[column][column].recip();
        if !inverse.is_finite() {
            return None;
        }
        rows[column].iter_mut().for_each(|value| *value *= inverse);
        let pivot = rows[column];
        for (i, row) in rows.iter_mut().enumerate() {
            if i != column {
                let factor = row[column];
                (column..20).for_each(|k| row[k] -= factor * pivot[k]);
            }
        }
    }
    Some(rows)
}

/// A row of the 3 x 3 matrix over z that multiplies (x, y, 1): polynomials, constant first.
struct Hidden {
    x: [f64; 4],
    y: [f64; 4],
    one: [f64; 5],
}

impl Hidden {
    fn at(&self, z: f64) -> Vector3<f64> {
        let value = |p: &[f64]| p.iter().rev().fold(0.0, |sum, c| sum * z + c);
        Vector3::new(value(&self.x), value(&self.y), value(&self.one))
    }
}

/// Row `i`, of a monomial that has a factor z, less z times the next, of the same monomial without it.
fn hidden(rows: &[Cubic; 10], i: usize) -> Hidden {
    let (p, q) = (&rows[i], &rows[i + 1]);
    let three = |k: usize| [p[k + 2], p[k + 1] - q[k + 2], p[k] - q[k + 1], -q[k]];
    Hidden { x: three(10), y: three(13), one: [p[19], p[18] - q[19], p[17] - q[18], p[16] - q[17], -q[16]] }
}

/// Newton's method on the cubics from x, y, z, and the matrix there; `None` where it is no essential matrix.
fn polish(basis: &[Matrix3<f64>; 4], mut xyz: Vector3<f64>) -> Option<Matrix3<f64>> {
    let assemble = |v: &Vector3<f64>| basis[0] * v.x + basis[1] * v.y + basis[2] * v.z + basis[3];
    for _ in 0..POLISH {
        let e = assemble(&xyz);
        let (et, square) = (e.transpose(), e.norm_squared());
        let residual = stack(&(e * et * e - e * (0.5 * square)), e.determinant());
        let cofactors = Matrix3::from_columns(&[
            e.column(1).cross(&e.column(2)),
            e.column(2).cross(&e.column(0)),
            e.column(0).cross(&e.column(1)),
        ]);
        let derivative = |k: usize| {
            let d = &basis[k];
            let cubic = d * et * e + e * d.transpose() * e + e * et * d - e * e.dot(d) - d * (0.5 * square);
            stack(&cubic, cofactors.dot(d))
        };
        let jacobian = SMatrix::<f64, 10, 3>::from_columns(&[derivative(0), derivative(1), derivative(2)]);
        let step = (jacobian.transpose() * jacobian).cholesky()?.solve(&(jacobian.transpose() * residual));
        xyz -= step;
        if step.norm_squared() <= 1e-30 * (1.0 + xyz.norm_squared()) {
            break;
        }
    }
    let e = assemble(&xyz);
    let e = e * (std::f64::consts::SQRT_2 / e.norm());
    let defect = (e * e.transpose() * e - e).norm();
    (defect < 1e-6).then_some(e)
}

fn stack(cubic: &Matrix3<f64>, determinant: f64) -> SVector<f64, 10> {
    SVector::from_fn(|k, _| if k < 9 { cubic[k] } else { determinant })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::essential::essential;
    use crate::geometry::ransac::tests::Random;
    use handeye_solvers::Pose;

    fn solved(seed: u64, planar: bool) -> (bool, f64, usize) {
        let mut random = Random::new(seed);
        let pose = Pose::new(random.vector(0.5), random.vector(1.0));
        let points: [_; 5] = std::array::from_fn(|_| {
            let mut p = random.vector(1.0) + Vector3::z() * 4.0;
            if planar {
                p.z = 4.0 + 0.3 * p.x;
            }
            p
        });
        let (a, b) = (points.map(|p| p.normalize()), points.map(|p| pose.transform(&p).normalize()));
        let truth = essential(&pose);
        let found = five_point(&a, &b);
        let error = |e: &Matrix3<f64>| (e - truth).norm().min((e + truth).norm());
        let nearest = found.iter().map(error).fold(f64::INFINITY, f64::min);
        let residual = found.iter().flat_map(|e| (0..5).map(|i| b[i].dot(&(e * a[i])).abs()).collect::<Vec<_>>());
        (residual.fold(0.0, f64::max) < 1e-12, nearest, found.len())
    }

    #[test]
    fn the_true_matrix_is_among_the_solutions_for_points_in_space_and_in_a_plane() {
        for planar in [false, true] {
            let results: Vec<_> = (0..1000).map(|seed| solved(seed, planar)).collect();
            let exact = results.iter().filter(|(fits, nearest, _)| *fits && *nearest < 1e-9).count();
            assert!(results.iter().all(|&(fits, _, n)| fits && n <= 10));
            // The rest are nearly double roots, which rounding moves or removes.
            assert!(exact >= 985, "{exact} of 1000, planar: {planar}");
        }
    }

    #[test]
    fn repeated_points_determine_nothing() {
        let a = [Vector3::z(); 5];
        assert!(five_point(&a, &a).is_empty());
        assert!(five_point(&[Vector3::repeat(f64::NAN); 5], &a).is_empty());
    }
}
