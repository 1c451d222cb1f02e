//! Derivatives of any node's step with respect to the columns of the system.
use crate::graph::{FactorKey, Graph, Role};
use crate::jacobian::{Columns, Coordinates, Jacobian, width};
use crate::layout::Layout;
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// Computes total derivatives, each derived node's once.
pub(crate) struct Derivative<'a> {
    graph: &'a Graph,
    layout: &'a Layout,
    known: BTreeMap<u32, Vec<(u32, DMatrix<f64>)>>,
}

impl<'a> Derivative<'a> {
    pub fn new(graph: &'a Graph, layout: &'a Layout) -> Self {
        Derivative { graph, layout, known: BTreeMap::new() }
    }

    /// One matrix per free node that the node depends on, ascending: rows are coordinates of the node's step, columns
    /// the free node's columns in the system.
    pub fn of(&mut self, node: u32) -> Vec<(u32, DMatrix<f64>)> {
        let place = &self.graph.nodes[node as usize];
        let active = usize::from(self.layout.places[node as usize].active);
        match place.role {
            _ if active == 0 => Vec::new(),
            Role::Held => Vec::new(),
            Role::Free => {
                let mut selection = DMatrix::zeros(place.tangent, active);
                for column in 0..active {
                    selection[(place.free.as_ref().map_or(column, |free| usize::from(free[column])), column)] = 1.0;
                }
                vec![(node, selection)]
            }
            Role::Derived(derived) => {
                if !self.known.contains_key(&node) {
                    let derivative = self.derived(derived);
                    self.known.insert(node, derivative);
                }
                self.known[&node].clone()
            }
        }
    }

    /// A factor's residual with its noise and loss (see [`FactorPool::linearize`]), and its derivatives as those of a node.
    pub fn of_factor(&mut self, factor: FactorKey) -> (Vec<f64>, Vec<(u32, DMatrix<f64>)>) {
        let (graph, place) = (self.graph, factor.place as usize);
        let pool = &graph.factors[factor.pool as usize];
        self.chained(pool.nodes(place), |x, columns| pool.linearize(place, graph, x, columns))
    }

    fn derived(&mut self, derived: u32) -> Vec<(u32, DMatrix<f64>)> {
        let graph = self.graph;
        let derived = &graph.derived[derived as usize];
        let pool = &graph.functions[derived.pool as usize];
        let place = &graph.nodes[derived.node as usize];
        let evaluate = |x: &[&[f64]], columns: &[Columns<'_>]| {
            let width = width(columns);
            let (mut y, mut g) = (vec![0.0; place.ambient], vec![0.0; place.tangent * width]);
            let jacobian = &mut Jacobian { data: &mut g, columns, width };
            pool.evaluate(derived.place as usize, x, &mut y, Some(jacobian));
            (y, g)
        };
        self.chained(pool.nodes(derived.place as usize), evaluate).1
    }

    /// The chain rule: what is evaluated on some nodes, and its derivatives through them.
    fn chained(
        &mut self,
        nodes: &[u32],
        evaluate: impl FnOnce(&[&[f64]], &[Columns<'_>]) -> (Vec<f64>, Vec<f64>),
    ) -> (Vec<f64>, Vec<(u32, DMatrix<f64>)>) {
        let inputs: Vec<Vec<f64>> = nodes.iter().map(|&node| self.graph.stored(node)).collect();
        let x: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        let mut start = 0;
        let columns: Vec<Columns<'_>> = nodes
            .iter()
            .map(|&node| {
                let len = self.graph.nodes[node as usize].tangent;
                start += len;
                let is_constant = self.layout.places[node as usize].active == 0;
                let (active, free) = if is_constant { (0, Coordinates::None) } else { (len, Coordinates::All) };
                Columns { start: start - len, len, active, free }
            })
            .collect();
        let (result, g) = evaluate(&x, &columns);
        let g = DMatrix::from_row_slice(g.len() / start, start, &g);
        let mut total: BTreeMap<u32, DMatrix<f64>> = BTreeMap::new();
        for (&node, columns) in nodes.iter().zip(&columns) {
            let g = g.columns(columns.start, columns.len);
            for (node, inner) in self.of(node) {
                let part = g * inner;
                total.entry(node).and_modify(|sum| *sum += &part).or_insert(part);
            }
        }
        (result, total.into_iter().collect())
    }
}
