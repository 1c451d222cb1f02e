//! Derivatives of any node's step with respect to the columns of the system.
use crate::graph::{Graph, Role};
use crate::jacobian::{Columns, Coordinates, Jacobian};
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

    fn derived(&mut self, derived: u32) -> Vec<(u32, DMatrix<f64>)> {
        let derived = &self.graph.derived[derived as usize];
        let pool = &self.graph.functions[derived.pool as usize];
        let parents = pool.nodes(derived.place as usize);
        let inputs: Vec<Vec<f64>> = parents.iter().map(|&parent| self.graph.stored(parent)).collect();
        let x: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        let mut width = 0;
        let columns: Vec<Columns<'_>> = parents
            .iter()
            .map(|&parent| {
                let len = self.graph.nodes[parent as usize].tangent;
                width += len;
                Columns { start: width - len, len, active: len, free: Coordinates::All }
            })
            .collect();
        let place = &self.graph.nodes[derived.node as usize];
        let (mut y, mut g) = (vec![0.0; place.ambient], vec![0.0; place.tangent * width]);
        let jacobian = &mut Jacobian { data: &mut g, columns: &columns, width };
        pool.evaluate(derived.place as usize, &x, &mut y, Some(jacobian));
        let g = DMatrix::from_row_slice(place.tangent, width, &g);
        let mut total: BTreeMap<u32, DMatrix<f64>> = BTreeMap::new();
        for (&parent, columns) in parents.iter().zip(&columns) {
            let g = g.columns(columns.start, columns.len);
            for (node, inner) in self.of(parent) {
                let part = g * inner;
                total.entry(node).and_modify(|sum| *sum += &part).or_insert(part);
            }
        }
        total.into_iter().collect()
    }
}
