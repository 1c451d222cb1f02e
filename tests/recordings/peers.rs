//! The calibration problems that other programs were measured on: the same optimum, whichever linear solver finds it.
use crate::shared;
use handeye::solvers::linear::{Dense, LinearSolver, Schur, Sparse};
use handeye::solvers::{LevenbergMarquardt, Solver, Workspace, check};
use peer_problem::PeerProblem;
use std::ops::ControlFlow;

#[path = "../../benches/common/peer_problem.rs"]
mod peer_problem;

/// Problem, joints free, half the sum of squares at the optimum that Ceres and PyTorch reach.
const OPTIMA: [(&str, bool, f64); 4] = [
    ("noisy_T50.txt", false, 1.180886e3),
    ("noisy_T50.txt", true, 1.259009e2),
    ("noisy_T200.txt", false, 8.071684e3),
    ("noisy_T200.txt", true, 5.024369e2),
];

type Choice = fn(&Workspace) -> Box<dyn LinearSolver>;

const LINEAR_SOLVERS: [Choice; 3] = [
    |workspace| Box::new(Dense::new(workspace)),
    |workspace| Box::new(Schur::new(workspace).expect("joints or features can be eliminated")),
    |workspace| Box::new(Sparse::new(workspace)),
];

#[test]
fn every_linear_solver_reaches_the_optimum_of_the_peers_to_six_digits() {
    for (name, joints_free, optimum) in OPTIMA {
        let Some(path) = shared(&format!("peers/calibration/{name}")) else { return };
        let problem = PeerProblem::read(&path).expect("the file is there");
        for choose in LINEAR_SOLVERS {
            let mut graph = problem.graph(joints_free);
            let mut solver = Solver::with(&graph, choose);
            let report = LevenbergMarquardt::default()
                .minimize_with(&mut graph, &mut solver, &mut |_| ControlFlow::Continue(()))
                .expect("the problem is well posed");
            assert!(report.termination.converged(), "{name}, {}: {report:?}", solver.linear_solver());
            // The optima are given to seven digits.
            let error = (report.final_cost / optimum - 1.0).abs();
            assert!(error < 5e-7, "{name}, joints free {joints_free}, {}: {report:?}", solver.linear_solver());
        }
    }
}

#[test]
fn the_normal_equations_of_the_peers_problem_agree_with_differences_at_the_optimum() {
    let Some(path) = shared("peers/calibration/noisy_T50.txt") else { return };
    let problem = PeerProblem::read(&path).expect("the file is there");
    for joints_free in [false, true] {
        let mut graph = problem.graph(joints_free);
        LevenbergMarquardt::default().minimize(&mut graph).expect("the problem is well posed");
        if let Err(mismatch) = check::graph(&graph) {
            panic!("joints free {joints_free}: {mismatch}");
        }
    }
}
