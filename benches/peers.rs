//! CPU time to the optimum of the peers' calibration problems, beside Ceres in the same run: see benches/peers.sh.
use cpu_time::ProcessTime;
use handeye::solvers::LevenbergMarquardt;
use peer_problem::PeerProblem;
use std::path::PathBuf;

#[path = "common/peer_problem.rs"]
mod peer_problem;

fn main() {
    let folder = std::env::var_os("HANDEYE_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    for (name, joints_free) in [("noisy_T50", false), ("noisy_T50", true), ("noisy_T200", false), ("noisy_T200", true)]
        .into_iter()
        .take(std::env::var("N").map_or(4, |r| r.parse().unwrap()))
    {
        let path = folder.join("peers/calibration").join(format!("{name}.txt"));
        let Some(problem) = PeerProblem::read(&path) else {
            println!("{} is not there: nothing to run on", path.display());
            return;
        };
        let mut best = f64::INFINITY;
        let mut last = None;
        for _ in 0..std::env::var("REPS").map_or(20, |r| r.parse().unwrap()) {
            let mut graph = problem.graph(joints_free);
            let start = ProcessTime::now();
            let mut solver = handeye::solvers::Solver::new(&graph);
            let verbose = last.is_none() && std::env::var_os("V").is_some();
            let report = LevenbergMarquardt::default()
                .minimize_with(&mut graph, &mut solver, &mut |i| {
                    if verbose {
                        println!("{} {:.9e}", i.number, i.cost);
                    }
                    std::ops::ControlFlow::Continue(())
                })
                .expect("the problem is well posed");
            best = best.min(start.elapsed().as_secs_f64());
            last = Some(report);
        }
        let report = last.expect("it ran");
        println!(
            "{name} joints {} {:8.3} ms  cost {:.6e}  {} iterations, {:?}, {}",
            if joints_free { "free" } else { "held" },
            best * 1e3,
            report.final_cost,
            report.iterations,
            report.termination,
            report.linear_solver,
        );
    }
}
