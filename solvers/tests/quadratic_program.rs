//! Small quadratic programs: against an independent active-set enumeration, at every size that a control loop has.
use handeye_solvers::{Constraint, Qp, QpEnd, QuadraticProgram};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

struct Problem {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    rows: Vec<f64>,
    bounds: Vec<f64>,
}

impl Problem {
    /// With 0 in the box; rows that the box can satisfy where `feasible`.
    fn random(n: usize, m: usize, random: &mut ChaCha8Rng, feasible: bool) -> Problem {
        let mut uniform = || random.random_range(-1.0..1.0);
        let square = DMatrix::from_fn(n + 2, n, |_, _| uniform());
        let hessian = square.transpose() * &square + DMatrix::identity(n, n) * 1e-3;
        let gradient = DVector::from_fn(n, |_, _| 3.0 * uniform());
        let lower = (0..n).map(|_| -0.5 - 0.4 * uniform()).collect();
        let upper = (0..n).map(|_| 0.5 + 0.4 * uniform()).collect();
        let rows = (0..m * n).map(|_| uniform()).collect();
        let bounds = (0..m).map(|_| if feasible { 0.3 + 0.29 * uniform() } else { -20.0 }).collect();
        Problem { hessian, gradient, lower, upper, rows, bounds }
    }

    fn qp<'a>(&'a self, strengths: &'a [f64]) -> Qp<'a> {
        Qp {
            hessian: self.hessian.as_slice(),
            gradient: self.gradient.as_slice(),
            lower: &self.lower,
            upper: &self.upper,
            rows: &self.rows,
            bounds: &self.bounds,
            strengths,
        }
    }

    /// Every constraint as (a, b): a·x ≤ b.
    fn constraints(&self) -> Vec<(DVector<f64>, f64)> {
        let n = self.lower.len();
        let unit = |i: usize, sign: f64| DVector::from_fn(n, |k, _| if k == i { sign } else { 0.0 });
        let mut all: Vec<_> =
            (0..n).flat_map(|i| [(unit(i, 1.0), self.upper[i]), (unit(i, -1.0), -self.lower[i])]).collect();
        let row = |i: usize| DVector::from_column_slice(&self.rows[i * n..(i + 1) * n]);
        all.extend(self.bounds.iter().enumerate().map(|(i, &bound)| (row(i), bound)));
        all
    }

    /// The minimum, by trying every set of active constraints.
    fn enumerate(&self) -> DVector<f64> {
        let (n, constraints) = (self.lower.len(), self.constraints());
        for set in 0..1_u32 << constraints.len() {
            let active: Vec<_> = (0..constraints.len()).filter(|i| set >> i & 1 == 1).collect();
            if active.len() > n {
                continue;
            }
            let k = active.len();
            let mut kkt = DMatrix::zeros(n + k, n + k);
            kkt.view_mut((0, 0), (n, n)).copy_from(&self.hessian);
            let mut right = DVector::zeros(n + k);
            right.rows_mut(0, n).copy_from(&-&self.gradient);
            for (place, &i) in active.iter().enumerate() {
                kkt.view_mut((n + place, 0), (1, n)).copy_from(&constraints[i].0.transpose());
                kkt.view_mut((0, n + place), (n, 1)).copy_from(&constraints[i].0);
                right[n + place] = constraints[i].1;
            }
            let Some(found) = kkt.lu().solve(&right) else { continue };
            let x = found.rows(0, n).into_owned();
            let feasible = constraints.iter().all(|(a, b)| a.dot(&x) <= b + 1e-9);
            if feasible && found.rows(n, k).iter().all(|multiplier| *multiplier >= -1e-9) {
                return x;
            }
        }
        unreachable!("a strictly convex problem whose constraints leave 0 has one minimum")
    }
}

#[test]
fn minima_are_those_of_an_enumeration_of_active_sets() {
    let random = &mut ChaCha8Rng::seed_from_u64(1);
    for (n, m) in [(1, 0), (2, 3), (3, 4), (4, 3)] {
        let (mut program, strengths) = (QuadraticProgram::new(n, m), vec![1.0; m]);
        let mut constrained = 0;
        for _ in 0..100 {
            let problem = Problem::random(n, m, random, true);
            let expected = problem.enumerate();
            let found = program.solve(&problem.qp(&strengths));
            assert_ne!(found.end, QpEnd::Failed);
            constrained += usize::from(found.end == QpEnd::Constrained);
            let error = (DVector::from_column_slice(&found.x) - &expected).norm();
            assert!(error < 1e-9, "{n} unknowns, {m} rows: {error:.1e} off, {:?}", found.end);
            // The multipliers balance the gradient: H x + g + z + Aᵀ y = 0.
            let x = DVector::from_column_slice(&found.x);
            let rows = DMatrix::from_row_slice(m, n, &problem.rows);
            let pull = DVector::from_column_slice(&found.of_box)
                + rows.transpose() * DVector::from_column_slice(&found.of_rows);
            let balance = (&problem.hessian * x + &problem.gradient + pull).norm();
            assert!(balance < 1e-9, "{n} unknowns, {m} rows: multipliers are {balance:.1e} off");
            assert!(found.slack.iter().all(|slack| *slack == 0.0), "{:?}", found.slack);
        }
        assert!(constrained > 50, "only {constrained} of 100 problems had anything active");
    }
}

#[test]
fn without_active_constraints_the_answer_is_the_exact_one() {
    let mut program = QuadraticProgram::new(2, 1);
    let (lower, upper) = ([f64::NEG_INFINITY; 2], [f64::INFINITY; 2]);
    let qp = Qp {
        hessian: &[4.0, 0.0, 0.0, 0.25],
        gradient: &[-2.0, 1.0],
        lower: &lower,
        upper: &upper,
        rows: &[1.0, 1.0],
        bounds: &[f64::INFINITY],
        strengths: &[1.0],
    };
    let found = program.solve(&qp);
    assert_eq!((found.end, found.x.as_slice(), found.iterations), (QpEnd::Free, &[0.5, -4.0][..], 0));
}

#[test]
fn the_box_holds_and_the_weaker_row_gives_way() {
    // x ≤ -1 and x ≥ 1 cannot both hold; nor can either inside |x| ≤ 0.5 alone.
    let mut program = QuadraticProgram::new(1, 2);
    for (strengths, expected) in [([1.0, 10.0], 0.5), ([10.0, 1.0], -0.5)] {
        let qp = Qp {
            hessian: &[1.0],
            gradient: &[0.0],
            lower: &[-0.5],
            upper: &[0.5],
            rows: &[1.0, -1.0],
            bounds: &[-1.0, -1.0],
            strengths: &strengths,
        };
        let found = program.solve(&qp);
        assert!((found.x[0] - expected).abs() < 1e-6 && found.x[0].abs() <= 0.5, "{found:?}");
        let slack = [1.0 + expected, 1.0 - expected];
        assert!(found.slack.iter().zip(slack).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
    }
}

/// True where constraints (a, b) have a point in common: a corner of what they and a wide box enclose.
fn can_hold(constraints: &[(DVector<f64>, f64)], n: usize) -> bool {
    let unit = |i: usize, sign: f64| DVector::from_fn(n, |k, _| if k == i { sign } else { 0.0 });
    let wide = (0..n).flat_map(|i| [(unit(i, 1.0), 1e6), (unit(i, -1.0), 1e6)]);
    let all: Vec<_> = constraints.iter().cloned().chain(wide).collect();
    (0..1_u32 << all.len()).filter(|set| set.count_ones() as usize == n).any(|set| {
        let faces: Vec<_> = (0..all.len()).filter(|i| set >> i & 1 == 1).collect();
        let square = DMatrix::from_fn(n, n, |row, column| all[faces[row]].0[column]);
        let right = DVector::from_fn(n, |row, _| all[faces[row]].1);
        let corner = square.lu().solve(&right);
        corner.is_some_and(|corner| all.iter().all(|(a, b)| a.dot(&corner) <= b + 1e-8 * (1.0 + a.norm())))
    })
}

#[test]
fn constraints_that_cannot_all_hold_are_named_as_a_minimal_set() {
    let random = &mut ChaCha8Rng::seed_from_u64(3);
    let (mut conflicts, mut sizes) = (0, [0; 5]);
    for trial in 0..4000 {
        let (n, m) = (1 + trial % 3, 1 + trial / 3 % 5);
        let mut problem = Problem::random(n, m, random, true);
        problem.bounds.iter_mut().for_each(|bound| *bound = random.random_range(-0.6..0.3));
        if trial % 7 == 0 {
            problem.upper[0] = problem.lower[0];
        }
        if trial % 2 == 0 {
            // Rows that some unknowns are no part of, and hence constraints that are active beside a conflict.
            problem.rows.iter_mut().for_each(|slope| *slope *= f64::from(u8::from(random.random_bool(0.5))));
        }
        let strengths = vec![1.0; m];
        let mut program = QuadraticProgram::new(n, m);
        let found = program.solve(&problem.qp(&strengths));
        assert_ne!(found.end, QpEnd::Failed, "trial {trial}");
        let constraints = problem.constraints();
        let possible = can_hold(&constraints, n);
        assert_eq!(found.conflict.is_empty(), possible, "trial {trial}: {found:?}");
        assert_eq!(found.slack.iter().all(|slack| *slack == 0.0), possible, "trial {trial}: {found:?}");
        if possible {
            continue;
        }
        conflicts += 1;
        sizes[found.conflict.len()] += 1;
        let named = |constraint: &Constraint| match *constraint {
            Constraint::Upper(i) => constraints[2 * i].clone(),
            Constraint::Lower(i) => constraints[2 * i + 1].clone(),
            Constraint::Row(i) => constraints[2 * n + i].clone(),
        };
        let set: Vec<_> = found.conflict.iter().map(named).collect();
        assert!(!can_hold(&set, n), "trial {trial}: {:?} can all hold", found.conflict);
        for left_out in 0..set.len() {
            let mut rest = set.clone();
            rest.remove(left_out);
            assert!(can_hold(&rest, n), "trial {trial}: {:?} without one cannot hold either", found.conflict);
        }
    }
    assert!(conflicts > 1000 && sizes[2..].iter().all(|size| *size > 20), "{conflicts} conflicts of sizes {sizes:?}");
}

#[test]
fn whatever_comes_in_the_answer_is_finite_and_inside_the_box() {
    let random = &mut ChaCha8Rng::seed_from_u64(2);
    let (n, m) = (6, 24);
    let (mut program, strengths) = (QuadraticProgram::new(n, m), vec![1.0; m]);
    for trial in 0..500 {
        let mut problem = Problem::random(n, m, random, trial % 2 == 0);
        let scale = 10.0_f64.powf(random.random_range(-4.0..4.0));
        problem.gradient *= scale;
        match trial % 10 {
            3 => problem.gradient[2] = f64::NAN,
            5 => problem.hessian[(0, 0)] = -1.0,
            7 => problem.rows[5] = f64::INFINITY,
            8 => (problem.lower[1], problem.upper[1]) = (0.2, 0.2),
            _ => {}
        }
        let found = program.solve(&problem.qp(&strengths));
        let broken = matches!(trial % 10, 3 | 5 | 7);
        assert_eq!(found.end == QpEnd::Failed, broken, "trial {trial}, gradient times {scale:.1e}: {found:?}");
        for i in 0..n {
            assert!(problem.lower[i] <= found.x[i] && found.x[i] <= problem.upper[i], "trial {trial}: {found:?}");
        }
    }
}

#[test]
fn programs_can_be_sent_to_other_threads() {
    fn is_send<T: Send>() {}
    is_send::<QuadraticProgram>();
}
