//! Locates a receiver from its distances to known beacons, with a residual of one's own, a prior and a wrong reading.
//!
//!     cargo run --release --example 02_custom_residual
use handeye::solvers::{Error, Factor, Graph, LevenbergMarquardt, Loss, Scalar, Vector};

/// Distance to a beacon [m]. Written once over the scalar: its Jacobian follows by automatic differentiation.
struct Distance {
    beacon: Vector<3>,
    measured: f64,
}

impl Factor<1> for Distance {
    type On = (Vector<3>,);

    fn residual<T: Scalar>(&self, (position,): (Vector<3, T>,)) -> [T; 1] {
        [(position - self.beacon.map(T::from)).norm() - self.measured]
    }
}

fn main() -> Result<(), Error> {
    let truth = Vector::<3>::new(1.2, 0.7, 0.9);
    let beacons =
        [[0.0, 0.0, 2.0], [4.0, 0.0, 2.2], [4.0, 3.0, 2.1], [0.0, 3.0, 1.9], [2.0, 1.5, 2.5], [2.0, 0.0, 2.0]];
    let errors = [0.004, -0.006, 0.002, 0.007, -0.003, 1.5]; // the last one is an echo

    // A robust loss has minima of its own, so it starts where the squared one ended.
    let mut start = Vector::<3>::new(2.0, 2.0, 1.0);
    for (name, loss) in [("squared", Loss::Squared), ("Cauchy", Loss::Cauchy(2.0))] {
        let mut graph = Graph::new();
        let position = graph.free(start);
        for (beacon, error) in beacons.map(Vector::<3>::from).into_iter().zip(errors) {
            let measured = (truth - beacon).norm() + error;
            graph.factor(Distance { beacon, measured }, (position,)).sigma(0.005).loss(loss);
        }
        // All beacons are above the receiver, so distances alone say little of its height: it is about a metre, ±0.2 m.
        graph.prior(position, &Vector::<3>::new(0.0, 0.0, 1.0), &[f64::INFINITY, f64::INFINITY, 0.2]);
        let report = LevenbergMarquardt::default().minimize(&mut graph)?;
        let found = graph.value(position);
        start = found;
        let off = 1e3 * (found - truth).norm();
        println!("{name:8} loss: {off:7.1} mm off after {} iterations, {:?}", report.iterations, report.termination);
    }
    Ok(())
}
