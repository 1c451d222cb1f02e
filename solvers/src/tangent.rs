//! A graph's cost as a function on R^n: over steps from fixed values, scaled.
use crate::accumulate::Want;
use crate::graph::{Graph, Node};
use crate::workspace::{Mask, Workspace};

/// f(z) = cost(x0 ⊞ S z) with S = diag(H at x0)^(-1/2), and its gradient.
pub(crate) struct Tangent<'a> {
    graph: &'a Graph,
    workspace: &'a mut Workspace,
    mask: Option<&'a Mask>,
    /// Where z goes: (node, coordinate of its step, column of the workspace).
    variables: &'a [(u32, usize, usize)],
    scale: Vec<f64>,
    /// x0 ⊞ S z, and S z over the columns of the workspace.
    values: Vec<f64>,
    step: Vec<f64>,
    b: Vec<f64>,
    /// The last evaluation: argmin asks for the cost and for the gradient of one point apart.
    last: Option<(Vec<f64>, f64, Vec<f64>)>,
    /// The lowest cost so far, and where.
    pub best: Option<(f64, Vec<f64>)>,
    pub evaluations: usize,
}

/// Diagonal entries of H count for at least this share of the largest: a number that no factor sees now must not be thrown far.
const SMALLEST_DIAGONAL: f64 = 1e-12;

impl<'a> Tangent<'a> {
    /// At the graph's present values.
    pub fn new(
        graph: &'a Graph,
        workspace: &'a mut Workspace,
        mask: Option<&'a Mask>,
        variables: &'a [(u32, usize, usize)],
    ) -> Self {
        workspace.masked(graph, &graph.values, Want::Equations, mask);
        let columns = workspace.layout.columns;
        let mut diagonal = vec![0.0; columns];
        workspace.diagonal(&mut diagonal);
        let floor = SMALLEST_DIAGONAL * diagonal.iter().fold(1e-300, |most: f64, d| most.max(*d));
        let scale = variables.iter().map(|&(_, _, column)| 1.0 / diagonal[column].max(floor).sqrt()).collect();
        Tangent {
            workspace,
            mask,
            variables,
            scale,
            values: graph.values.clone(),
            step: vec![0.0; columns],
            b: vec![0.0; columns],
            last: None,
            best: None,
            evaluations: 0,
            graph,
        }
    }

    pub fn cost(&mut self, z: &[f64]) -> f64 {
        self.evaluate(z).0
    }

    pub fn gradient(&mut self, z: &[f64]) -> Vec<f64> {
        self.evaluate(z).1.to_vec()
    }

    fn evaluate(&mut self, z: &[f64]) -> (f64, &[f64]) {
        if self.last.as_ref().is_none_or(|(last, ..)| last != z) {
            self.evaluations += 1;
            for ((z, s), &(_, _, column)) in z.iter().zip(&self.scale).zip(self.variables) {
                self.step[column] = z * s;
            }
            self.workspace.retract(self.graph, &self.step, &mut self.values);
            let cost = self.workspace.masked(self.graph, &self.values, Want::Gradient, self.mask);
            self.workspace.gradient(&mut self.b);
            self.transport();
            let gradient = self.variables.iter().zip(&self.scale).map(|(&(_, _, column), s)| self.b[column] * s);
            let gradient = gradient.collect();
            if cost.is_finite() && self.best.as_ref().is_none_or(|(best, _)| cost < *best) {
                self.best = Some((cost, self.values.clone()));
            }
            self.last = Some((z.to_vec(), cost, gradient));
        }
        let (_, cost, gradient) = self.last.as_ref().expect("it was just evaluated");
        (*cost, gradient)
    }

    /// From a gradient over steps at the present values to one over steps at x0.
    fn transport(&mut self) {
        for &(node, column) in &self.workspace.layout.free {
            let Node { start, ambient, tangent, transport, .. } = self.graph.nodes[node as usize];
            let (x0, x) = (&self.graph.values[start..start + ambient], &self.values[start..start + ambient]);
            transport(x0, &self.step[column..column + tangent], x, &mut self.b[column..column + tangent]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Direction, Factor, Pose, Rotation, Scalar};
    use nalgebra::Vector3;

    struct Mix;
    impl Factor<3> for Mix {
        type On = (Pose, Rotation, Direction);
        fn residual<T: Scalar>(&self, (a, b, u): (Pose<T>, Rotation<T>, Direction<T>)) -> [T; 3] {
            let p = a.transform(&crate::manifold::so3::apply(&b.0, &u.0));
            [p.x * 2.0 - 1.0, p.y * p.z, p.z + p.x - 0.3]
        }
    }

    #[test]
    fn the_gradient_far_from_the_base_agrees_with_differences() {
        let mut graph = Graph::new();
        let a = graph.free(Pose::new(Vector3::new(0.3, 0.1, -0.4), Vector3::new(0.2, 0.5, -0.1)));
        let b = graph.free(Rotation(crate::manifold::so3::exp(&Vector3::new(-0.2, 0.6, 0.3))));
        let u = graph.free(Direction::new(Vector3::new(0.4, -0.5, 0.7)).unwrap());
        graph.factor(Mix, (a, b, u));
        let mut workspace = Workspace::new(&graph);
        // All but two coordinates, which stay where they are.
        let spans = [(0, 0..6), (1, 6..9), (2, 9..11)];
        let variables: Vec<(u32, usize, usize)> = spans
            .into_iter()
            .flat_map(|(node, columns)| columns.clone().map(move |column| (node, column - columns.start, column)))
            .filter(|&(_, _, column)| column != 1 && column != 7)
            .collect();
        let mut tangent = Tangent::new(&graph, &mut workspace, None, &variables);
        let z: Vec<f64> = (0..variables.len()).map(|i| 1.5 * (1.0 + i as f64).sin()).collect();
        let gradient = tangent.gradient(&z);
        for (i, g) in gradient.iter().enumerate() {
            let mut at = |h: f64| {
                let mut z = z.clone();
                z[i] += h;
                tangent.cost(&z)
            };
            let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!((g - difference).abs() < 1e-7 * difference.abs().max(1.0), "{i}: {g} {difference}");
        }
    }
}
