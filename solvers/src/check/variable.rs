//! Axioms of manifolds.
use super::differences::derivative;
use super::{Agreement, Comparison, Mismatch};
use crate::Variable;
use crate::scalar::{Dual, LANES, derivatives, seed};

/// Sizes of the steps that are tried.
const STEPS: [f64; 4] = [1e-6, 1e-3, 0.1, 0.7];

/// Tests a variable at x, with y somewhere near it:
///
///   load(store(x)) = x      x ⊞ 0 = x      (x ⊞ δ) ⊟ x = δ      x ⊞ (y ⊟ x) = y
///
/// and the derivatives of `retract`, `seed` and `local` at 0 and away from it.
pub fn variable<V: Variable<Over<f64> = V>>(x: &V, y: &V) -> Result<Agreement, Mismatch> {
    let (ambient, tangent) = (x.ambient(), x.tangent());
    let stored = |v: &V| {
        let mut numbers = vec![0.0; ambient];
        V::store(v, &mut numbers);
        numbers
    };
    let step = |from: &[f64], to: &V| {
        let mut delta = vec![0.0; tangent];
        V::local::<f64>(from, to, &mut delta);
        delta
    };
    let (x, y) = (stored(x), stored(y));
    let mut comparison = Comparison::default();
    let mut same = |what: &str, expected: &[f64], found: &[f64]| {
        for (i, (expected, found)) in expected.iter().zip(found).enumerate() {
            comparison.entry(what, (i, 0), *expected, *found, 1e-3 * expected.abs().max(1.0), 0.0);
        }
    };
    same("load(store(x)) = x", &x, &stored(&V::load(&x)));
    same("x ⊞ 0 = x", &x, &stored(&V::retract::<f64>(&x, |_| 0.0)));
    same("x ⊞ (y ⊟ x) = y", &y, &{
        let delta = step(&x, &V::load(&y));
        stored(&V::retract::<f64>(&x, |i| delta[i]))
    });
    for size in STEPS {
        let delta: Vec<f64> = (0..tangent).map(|i| size * (1.0 + 2.7 * i as f64).sin()).collect();
        same("(x ⊞ δ) ⊟ x = δ", &delta, &step(&x, &V::retract::<f64>(&x, |i| delta[i])));
    }
    // Derivatives of (z ⊞ δ) ⊟ x at δ = 0, with z = x, where they are those of the identity, and z = y.
    for (what, z) in [("derivative at 0", &x), ("derivative away from 0", &y)] {
        for column in 0..tangent {
            let expected = derivative(|h| {
                let moved = V::retract::<f64>(z, |i| if i == column { h } else { 0.0 });
                step(&x, &moved)
            });
            let by_duals = |seeded: bool| {
                let lane = |i: usize| if i == column { seed::<LANES>(0.0, 0) } else { Dual::from(0.0) };
                let moved = if seeded { V::seed(z, lane) } else { V::retract(z, lane) };
                let mut delta = vec![Dual::from(0.0); tangent];
                V::local(&x, &moved, &mut delta);
                delta.iter().map(|d| derivatives(d)[0]).collect::<Vec<f64>>()
            };
            for (name, found) in [("seed", by_duals(true)), ("retract", by_duals(false))] {
                for (row, (&(expected, error), found)) in expected.iter().zip(found).enumerate() {
                    comparison.entry(&format!("{name}: {what}"), (row, column), expected, found, 1.0, error);
                }
            }
        }
    }
    comparison.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Direction, DynamicVector, Pose, Rotation, Vector};
    use nalgebra::Vector3;

    #[test]
    fn every_variable_of_this_crate_keeps_the_axioms() {
        for angle in [0.0, 1e-6, 0.3, 2.0, 3.0] {
            let w = Vector3::new(0.6, -0.64, 0.48) * angle;
            let (a, b) = (Vector3::new(0.3, -0.8, 0.2), Vector3::new(1.5, 2.0, -3.0));
            variable(&Pose::new(a, b), &(Pose::new(w, b) * Pose::new(a, a))).unwrap();
            let rotation = |w: &Vector3<f64>| Rotation(crate::manifold::so3::exp(w));
            variable(&rotation(&a), &Rotation(rotation(&w).0 * rotation(&a).0)).unwrap();
            let u = Direction::new(b).unwrap();
            variable(&u, &Direction(rotation(&w).0 * u.0)).unwrap();
        }
        variable(&Vector::<3>::new(1.0, 2.0, 3.0), &Vector::<3>::new(-1.0, 2e3, 0.0)).unwrap();
        variable(&DynamicVector::from_vec(vec![1.0, 2.0]), &DynamicVector::from_vec(vec![-4.0, 0.5])).unwrap();
    }
}
