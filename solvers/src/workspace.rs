//! Evaluates a graph: costs, and normal equations with the derived nodes substituted.
use crate::accumulate::{Arguments, Offset, Run, Scratch, Want};
use crate::graph::Graph;
use crate::jacobian::{Jacobian, compact};
use crate::layout::{Block, Chunk, FunctionPlan, Layout};
use crate::pool::grown;
use crate::product::add_scaled;
use crate::substitute::substitute;
use nalgebra::{DMatrix, DMatrixView, DVector};
use rayon::prelude::*;

/// Chunks that are worked on side by side, each with a copy of the shared arena of its own. Fixed, so that the order of
/// summation does not depend on the number of threads.
const WAVE: usize = 8;

/// Steps of partly held nodes up to this length are spread out on the stack.
const LONGEST: usize = 64;

/// What a minimiser needs beside the graph, laid out once and reused as long as the graph's structure stays.
pub struct Workspace {
    pub(crate) layout: Layout,
    revision: u64,
    shared: Vec<f64>,
    /// Where the nodes were at the last linearisation.
    chunks: Vec<ChunkData>,
    wave: Vec<Vec<f64>>,
}

#[derive(Default)]
struct ChunkData {
    private: Vec<f64>,
    derived: Vec<f64>,
    scratch: Scratch,
    cost: f64,
}

/// Which factors a pass takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Take {
    All,
    /// All but the priors.
    Data,
    /// The priors alone.
    Priors,
}

/// By pool and place: whether a factor is taken.
pub(crate) type Mask = Vec<Vec<bool>>;

impl Workspace {
    /// Lays out the normal equations of a graph.
    pub fn new(graph: &Graph) -> Self {
        let layout = Layout::new(graph);
        let chunks = layout
            .chunks
            .iter()
            .map(|chunk| ChunkData {
                private: vec![0.0; chunk.private],
                derived: vec![0.0; chunk.derived],
                ..ChunkData::default()
            })
            .collect();
        let copies = if layout.chunks.len() > 1 { WAVE.min(layout.chunks.len()) } else { 0 };
        Workspace {
            shared: vec![0.0; layout.shared],
            wave: vec![vec![0.0; layout.shared]; copies],
            chunks,
            layout,
            revision: graph.revision,
        }
    }

    /// True as long as the graph's structure and what is free in it have not changed.
    pub fn fits(&self, graph: &Graph) -> bool {
        self.revision == graph.revision
    }

    /// Makes H and b where the nodes are now, as every iteration of a minimiser does once, and returns the cost.
    ///
    /// Only for those who bring a minimiser of their own, or want to know how long it takes.
    pub fn linearize_at(&mut self, graph: &Graph) -> f64 {
        if !self.fits(graph) {
            *self = Workspace::new(graph);
        }
        self.linearize(graph, &graph.values, Take::All)
    }

    /// H = Σ ρ' JᵀJ and b = Σ ρ' Jᵀr of the last linearisation, over the free coordinates of the free nodes in order.
    pub fn normal_equations(&self) -> (DMatrix<f64>, DVector<f64>) {
        let layout = &self.layout;
        let n = layout.columns;
        let (mut h, mut b) = (DMatrix::zeros(n, n), DVector::zeros(n));
        self.gradient(b.as_mut_slice());
        for block in &layout.blocks {
            let active = |node: u32| usize::from(layout.places[node as usize].active);
            let (rows, row, column) = (active(block.row), layout.column(block.row), layout.column(block.column));
            let data = self.block(block);
            for j in 0..active(block.column) {
                for i in 0..rows {
                    h[(row + i, column + j)] = data[i + j * rows];
                    h[(column + j, row + i)] = data[i + j * rows];
                }
            }
        }
        (h, b)
    }

    /// Sum of ρ/2 over all factors.
    pub(crate) fn cost(&mut self, graph: &Graph, values: &[f64]) -> f64 {
        self.pass(graph, values, Want::Cost, Take::All, None)
    }

    /// The cost; H and b are in [`Workspace::block`] and [`Workspace::gradient`] then.
    pub(crate) fn linearize(&mut self, graph: &Graph, values: &[f64], take: Take) -> f64 {
        self.pass(graph, values, Want::Equations, take, None)
    }

    /// The cost of the factors that a mask takes, by pool and place, with what is wanted of them; H is spoilt where b alone is.
    pub(crate) fn masked(&mut self, graph: &Graph, values: &[f64], want: Want, mask: Option<&Mask>) -> f64 {
        self.pass(graph, values, want, Take::All, mask)
    }

    fn pass(&mut self, graph: &Graph, values: &[f64], want: Want, take: Take, mask: Option<&Mask>) -> f64 {
        let layout = &self.layout;
        let pass = Pass { graph, layout, values, want, take, mask };
        let derivatives = want > Want::Cost;
        // A cost alone leaves H and b as they are: a rejected step solves with them again.
        if derivatives {
            self.shared.fill(0.0);
        }
        if let [data] = &mut self.chunks[..] {
            pass.run(&layout.chunks[0], data, &mut self.shared);
            return data.cost;
        }
        let run = |((chunk, data), shared): ((&Chunk, &mut ChunkData), &mut Vec<f64>)| {
            if derivatives {
                shared.fill(0.0);
            }
            pass.run(chunk, data, shared);
        };
        // Handing work to another thread and waiting for it is for nothing where there is only one.
        let alone = rayon::current_num_threads() == 1;
        for (chunks, data) in layout.chunks.chunks(WAVE).zip(self.chunks.chunks_mut(WAVE)) {
            let copies = &mut self.wave[..chunks.len()];
            if alone {
                chunks.iter().zip(data).zip(&mut *copies).for_each(run);
            } else {
                chunks.par_iter().zip(data).zip(&mut *copies).with_max_len(1).for_each(run);
            }
            if derivatives {
                for copy in copies {
                    add_scaled(&mut self.shared, 1.0, copy);
                }
            }
        }
        self.chunks.iter().map(|data| data.cost).sum()
    }

    /// A block of H between free nodes.
    pub(crate) fn block(&self, block: &Block) -> &[f64] {
        let active = |node: u32| usize::from(self.layout.places[node as usize].active);
        self.arena(block.chunk, block.offset, active(block.row) * active(block.column))
    }

    /// The diagonal block of the free node whose first column this is.
    pub(crate) fn diagonal_block(&self, column: usize) -> DMatrix<f64> {
        let layout = &self.layout;
        let place = layout.free.binary_search_by_key(&column, |&(_, first)| first).expect("a node begins here");
        let node = layout.free[place].0;
        let block = layout.blocks.binary_search_by_key(&(node, node), |block| (block.column, block.row));
        let n = usize::from(layout.places[node as usize].active);
        DMatrix::from_column_slice(n, n, self.block(&layout.blocks[block.expect("a free node has a block")]))
    }

    /// H x.
    pub(crate) fn multiply(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut y = DVector::zeros(x.len());
        for block in &self.layout.blocks {
            let span = |node: u32| (self.layout.column(node), usize::from(self.layout.places[node as usize].active));
            let ((row, rows), (column, columns)) = (span(block.row), span(block.column));
            let matrix = DMatrixView::from_slice(self.block(block), rows, columns);
            y.rows_mut(row, rows).gemv(1.0, &matrix, &x.rows(column, columns), 1.0);
            if block.row != block.column {
                y.rows_mut(column, columns).gemv_tr(1.0, &matrix, &x.rows(row, rows), 1.0);
            }
        }
        y
    }

    fn arena(&self, chunk: u32, offset: Offset, len: usize) -> &[f64] {
        let arena = if offset.is_shared() { &self.shared } else { &self.chunks[chunk as usize].private };
        &arena[offset.at()..offset.at() + len]
    }

    /// Moves every free node by its part of the step; the others keep their places in `moved`. Returns the largest change of
    /// a stored number, relative to its size (absolute below 1).
    pub(crate) fn retract(&self, graph: &Graph, step: &[f64], moved: &mut [f64]) -> f64 {
        let mut largest: f64 = 0.0;
        let mut full = [0.0; LONGEST];
        let mut long = Vec::new();
        for &(node, column) in &self.layout.free {
            let node = &graph.nodes[node as usize];
            let delta = match &node.free {
                None => &step[column..column + node.tangent],
                Some(free) => {
                    let full = if node.tangent <= LONGEST {
                        &mut full[..node.tangent]
                    } else {
                        long.resize(node.tangent, 0.0);
                        &mut long[..]
                    };
                    full.fill(0.0);
                    for (&coordinate, s) in free.iter().zip(&step[column..]) {
                        full[usize::from(coordinate)] = *s;
                    }
                    &*full
                }
            };
            let (x, y) = (&graph.values[node.start..], &mut moved[node.start..node.start + node.ambient]);
            (node.retract)(&x[..node.ambient], delta, y);
            for (x, y) in x.iter().zip(y) {
                largest = largest.max((*y - x).abs() / x.abs().max(1.0));
            }
        }
        largest
    }

    /// Copies the diagonal of H, over the columns of the system.
    pub(crate) fn diagonal(&self, diagonal: &mut [f64]) {
        for block in &self.layout.blocks {
            if block.row == block.column {
                let n = usize::from(self.layout.places[block.row as usize].active);
                let data = self.block(block);
                let column = self.layout.column(block.row);
                for i in 0..n {
                    diagonal[column + i] = data[i * (n + 1)];
                }
            }
        }
    }

    /// Copies b, over the columns of the system.
    pub(crate) fn gradient(&self, b: &mut [f64]) {
        let layout = &self.layout;
        for (&(node, column), &chunk) in layout.free.iter().zip(&layout.gradient_chunks) {
            let place = &layout.places[node as usize];
            let len = usize::from(place.active);
            b[column..column + len].copy_from_slice(self.arena(chunk, place.gradient, len));
        }
    }
}

/// One pass over all chunks.
#[derive(Clone, Copy)]
struct Pass<'a> {
    graph: &'a Graph,
    layout: &'a Layout,
    values: &'a [f64],
    want: Want,
    take: Take,
    mask: Option<&'a Mask>,
}

impl Pass<'_> {
    fn run(&self, chunk: &Chunk, data: &mut ChunkData, shared: &mut [f64]) {
        if self.want > Want::Cost {
            data.private.fill(0.0);
        }
        for plan in &chunk.functions {
            self.derive(plan, data);
        }
        let mut run = Run {
            nodes: &self.graph.nodes,
            places: &self.layout.places,
            values: self.values,
            derived: &data.derived,
            private: &mut data.private,
            shared,
            offsets: &chunk.offsets,
            want: self.want,
            graduation: self.graph.graduation,
            cost: 0.0,
            scratch: &mut data.scratch,
        };
        for (index, range) in &chunk.runs {
            let pool = &self.graph.factors[*index as usize];
            let taken = match self.take {
                Take::All => true,
                Take::Data => !pool.is_prior(),
                Take::Priors => pool.is_prior(),
            };
            if !taken {
                range.clone().for_each(|place| run.skip(pool.nodes(place).len()));
                continue;
            }
            match self.mask {
                None => pool.run(range.clone(), &mut run),
                Some(mask) => {
                    for place in range.clone() {
                        if mask[*index as usize][place] {
                            pool.run(place..place + 1, &mut run);
                        } else {
                            run.skip(pool.nodes(place).len());
                        }
                    }
                }
            }
        }
        if self.want > Want::Cost {
            for group in chunk.groups.iter().rev() {
                substitute(group, &mut run);
            }
        }
        data.cost = run.cost;
    }

    /// Evaluates a derived node and, if wanted, its Jacobian.
    fn derive(&self, plan: &FunctionPlan, data: &mut ChunkData) {
        let (nodes, places) = (&self.graph.nodes, &self.layout.places);
        let place = &places[plan.node as usize];
        let pool = &self.graph.functions[plan.pool as usize];
        let parents = pool.nodes(plan.place as usize);
        let (before, after) = data.derived.split_at_mut(place.start as usize);
        let y = &mut after[..usize::from(place.ambient)];
        let mut arguments = Arguments::none();
        arguments.look_up(parents, nodes, places, self.values, before);
        let (x, columns) = (&arguments.x[..parents.len()], &arguments.columns[..parents.len()]);
        if self.want == Want::Cost || place.active == 0 {
            pool.evaluate(plan.place as usize, x, y, None);
            return;
        }
        let rows = usize::from(place.active);
        let g = grown(&mut data.scratch.jacobian, rows * arguments.width);
        let jacobian = &mut Jacobian { data: &mut *g, columns, width: arguments.width };
        pool.evaluate(plan.place as usize, x, y, Some(jacobian));
        compact(g, arguments.width, columns);
        let mut to = plan.jacobian;
        for row in g.chunks_exact(arguments.width) {
            for argument in columns {
                let from = &row[argument.start..argument.start + argument.active];
                data.private[to..to + argument.active].copy_from_slice(from);
                to += argument.active;
            }
        }
    }
}
