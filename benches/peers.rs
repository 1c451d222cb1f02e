//! The peers' calibration problems, timed: CPU time to the optimum, and of one linearisation against one derived by hand.
//!
//! `cargo bench --bench peers`; `benches/peers.sh` runs Ceres beside it. One thread, default settings.
use cpu_time::ProcessTime;
use hand_derived::HandDerived;
use handeye::solvers::{LevenbergMarquardt, Report, Solver, Workspace};
use peer_problem::PeerProblem;
use std::hint::black_box;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

#[path = "common/hand_derived.rs"]
mod hand_derived;
#[path = "common/peer_problem.rs"]
mod peer_problem;

/// How often each time is taken, and linearisations in one of them.
const REPEATS: usize = 30;
const LINEARISATIONS: usize = 20;

/// Largest ratio of one linearisation through the graph to one by hand.
const REQUIRED: f64 = 1.6;

/// Problem, joints free, the optimum that every program must reach.
const PROBLEMS: [(&str, bool, f64); 4] = [
    ("noisy_T50", false, 1.180886e3),
    ("noisy_T50", true, 1.259009e2),
    ("noisy_T200", false, 8.071684e3),
    ("noisy_T200", true, 5.024369e2),
];

fn main() {
    // One thread; the time of the whole process is taken, so that none could hide work on another.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nothing has asked for threads yet");
    let folder = std::env::var_os("HANDEYE_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let read = |name: &str| {
        let path = folder.join("peers/calibration").join(format!("{name}.txt"));
        let problem = PeerProblem::read(&path);
        if problem.is_none() {
            println!("{} is not there: nothing to run on (set HANDEYE_SHARED to its folder)", path.display());
        }
        problem
    };
    println!("problem     joints   CPU min  median [ms]  iterations          cost       optimum  linear solver");
    for (name, joints_free, optimum) in PROBLEMS {
        let Some(problem) = read(name) else { return };
        let mut report = None;
        let (least, median) = times(|| {
            let mut graph = problem.graph(joints_free);
            let start = ProcessTime::now();
            report = Some(minimize(&mut graph));
            start.elapsed()
        });
        let report = report.expect("it ran");
        println!(
            "{name:<11} {}  {least:>8.2} {median:>7.2}       {:>10}  {:>12.6e}  {optimum:>12.6e}  {}",
            if joints_free { "free  " } else { "held  " },
            report.iterations,
            report.final_cost,
            report.linear_solver
        );
        assert!((report.final_cost / optimum - 1.0).abs() < 5e-7, "{name} ends at another cost");
    }
    if let Some(problem) = read("noisy_T50") {
        one_linearisation(&problem);
    }
}

/// What `LevenbergMarquardt::default().minimize(graph)` does, layout and choice of the linear solver included.
fn minimize(graph: &mut handeye::solvers::Graph) -> Report {
    let mut solver = Solver::new(graph);
    let report = LevenbergMarquardt::default().minimize_with(graph, &mut solver, &mut |_| ControlFlow::Continue(()));
    report.expect("the problem is well posed")
}

fn one_linearisation(problem: &PeerProblem) {
    let graph = problem.graph(false);
    let mut workspace = Workspace::new(&graph);
    let mut by_hand = HandDerived::new(problem).expect("6 links, 12 features, 2 cameras");
    compare(workspace.linearize_at(&graph), &workspace, &mut by_hand);
    let timed = |linearize: &mut dyn FnMut() -> f64| {
        let start = ProcessTime::now();
        for _ in 0..LINEARISATIONS {
            black_box(linearize());
        }
        start.elapsed() / LINEARISATIONS as u32
    };
    // Side by side, so that both meet the same disturbances.
    let mut ours = Vec::new();
    let theirs = times(|| {
        ours.push(timed(&mut || workspace.linearize_at(black_box(&graph))));
        timed(&mut || black_box(&mut by_hand).linearize())
    });
    let mut ours = ours.into_iter();
    let ours = times(|| ours.next().expect("one for each"));
    println!("\none linearisation, noisy_T50, joints held   CPU min  median [µs]");
    println!("  through the graph                        {:>8.0} {:>7.0}", 1e3 * ours.0, 1e3 * ours.1);
    println!("  derived by hand                          {:>8.0} {:>7.0}", 1e3 * theirs.0, 1e3 * theirs.1);
    println!("  ratio                                    {:>8.2} {:>7.2}", ours.0 / theirs.0, ours.1 / theirs.1);
    println!("  required: at most {REQUIRED}: {}", if ours.0 / theirs.0 <= REQUIRED { "met" } else { "NOT MET" });
}

/// Both must give the same cost, b and upper triangle of H.
fn compare(cost: f64, workspace: &Workspace, by_hand: &mut HandDerived<'_>) {
    assert!((by_hand.linearize() / cost - 1.0).abs() < 1e-12, "the costs differ");
    let (h, b) = workspace.normal_equations();
    let size: Vec<f64> = (0..b.len()).map(|i| h[(i, i)].sqrt()).collect();
    for j in 0..b.len() {
        assert!((b[j] - by_hand.b[j]).abs() <= 1e-9 * size[j] * (2.0 * cost).sqrt(), "b differs at {j}");
        for i in 0..=j {
            assert!((h[(i, j)] - by_hand.h[(i, j)]).abs() <= 1e-9 * size[i] * size[j], "H differs at ({i}, {j})");
        }
    }
}

/// Least and median of [`REPEATS`] times [ms].
fn times(mut run: impl FnMut() -> Duration) -> (f64, f64) {
    let mut all: Vec<f64> = (0..REPEATS).map(|_| 1e3 * run().as_secs_f64()).collect();
    all.sort_by(f64::total_cmp);
    (all[0], all[REPEATS / 2])
}
