//! A minimiser allocates before its first iteration and after its last, and nowhere between.
use handeye_solvers::linear::{Dense, LinearSolver, Schur, Sparse};
use handeye_solvers::nalgebra::Vector3;
use handeye_solvers::{Factor, Function, Graph, LevenbergMarquardt, Pose, Scalar, Solver, Vector, Workspace};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ops::ControlFlow;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is passed on to the system's allocator as it is.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

struct Reach;
impl Function for Reach {
    type On = (Pose, Vector<2>);
    type Output = Pose;
    fn compute<T: Scalar>(&self, (base, q): (Pose<T>, Vector<2, T>)) -> Pose<T> {
        let zero = T::zero();
        base * Pose {
            rotation: handeye_solvers::manifold::so3::exp(&Vector3::new(q.x, q.y, zero)),
            translation: Vector3::new(T::one(), q.x, q.y),
        }
    }
}

struct Sees([f64; 2]);
impl Factor<2> for Sees {
    type On = (Pose, Vector<3>);
    fn residual<T: Scalar>(&self, (tip, point): (Pose<T>, Vector<3, T>)) -> [T; 2] {
        let p = tip.inverse_transform(&point);
        [p.x - self.0[0], p.y - self.0[1]]
    }
}

fn allocations_between_iterations(choose: impl FnOnce(&Workspace) -> Box<dyn LinearSolver>) -> Vec<usize> {
    let mut graph = Graph::new();
    let base = graph.free(Pose::new(Vector3::new(0.3, 0.1, -0.2), Vector3::zeros()));
    graph.prior(base, &Pose::identity(), &[0.1; 6]);
    let points = [0.0, 1.0, 2.0].map(|x| graph.free(Vector::<3>::new(x, 1.0 - x * x, 2.0)));
    for (i, &point) in points.iter().enumerate() {
        graph.prior(point, &Vector::<3>::new(i as f64, 0.0, 2.0), &[0.5; 3]);
    }
    for sample in 0..12 {
        let s = f64::from(sample);
        let joints = graph.free(Vector::<2>::new(0.1 * s, 0.5));
        graph.hold_coordinates(points[1], &[2]);
        let tip = graph.derive(Reach, (base, joints));
        for (i, &point) in points.iter().enumerate() {
            graph.factor(Sees([(s + i as f64).sin(), 0.4 * s.cos()]), (tip, point));
        }
    }
    let mut solver = Solver::with(&graph, choose);
    let mut counts = Vec::with_capacity(100);
    let settings = LevenbergMarquardt { max_iterations: 8, initial_damping: 1e-3, ..LevenbergMarquardt::default() };
    let mut observer = |_: &_| {
        counts.push(COUNT.with(Cell::get));
        ControlFlow::Continue(())
    };
    settings.minimize_with(&mut graph, &mut solver, &mut observer).unwrap();
    counts.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

#[test]
fn nothing_is_allocated_after_the_first_iteration() {
    type Choice = (&'static str, fn(&Workspace) -> Box<dyn LinearSolver>);
    let choices: [Choice; 3] = [
        ("dense", |workspace| Box::new(Dense::new(workspace))),
        ("Schur", |workspace| Box::new(Schur::new(workspace).expect("joints can be eliminated"))),
        ("sparse", |workspace| Box::new(Sparse::new(workspace))),
    ];
    for (name, choose) in choices {
        let counts = allocations_between_iterations(choose);
        assert!(counts.len() >= 4, "{name}: {counts:?}");
        assert!(counts.iter().all(|&count| count == 0), "{name}: {counts:?}");
    }
}
