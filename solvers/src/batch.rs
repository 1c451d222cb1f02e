//! Normal equations of consecutive factors, accumulated together where they are on the same nodes.
use crate::accumulate::{Arguments, Run, Want};
use crate::pool::{MOST, grown};
use crate::product::{Strip, add_product};

/// A batch that has this many rows takes no further factor: what it holds stays in the fastest cache.
const LONGEST: usize = 64;

/// Consecutive factors of one pool whose Jacobians have the same columns.
///
/// Observations of one kind made at one moment tend to share all nodes but one: the blocks of H between what they share take
/// the rows of all of them in one product.
#[derive(Default)]
pub(crate) struct Batch {
    /// The nodes of each factor in turn.
    nodes: Vec<u32>,
    /// First column and number of free columns of each argument.
    columns: [(usize, usize); MOST],
    /// Whether all factors have the same node for an argument.
    shared: [bool; MOST],
    arguments: usize,
    width: usize,
    r: Vec<f64>,
    /// Of this, the first `r.len() * width` numbers are in use: a row per entry of r.
    jacobian: Vec<f64>,
}

impl Batch {
    /// Room for the Jacobian of the factor that is added next, once the batch has made way for it if the two do not fit.
    #[inline]
    pub fn room(&mut self, run: &mut Run<'_>, nodes: &[u32], arguments: &Arguments<'_>, rows: usize) -> &mut [f64] {
        if !self.takes(nodes, arguments) {
            self.flush(run);
        }
        let used = self.r.len() * self.width;
        grown(&mut self.jacobian, used + rows * arguments.width);
        &mut self.jacobian[used..used + rows * arguments.width]
    }

    /// Whether a factor on these nodes has the batch's columns and the nodes that the batch's factors share.
    #[inline]
    fn takes(&self, nodes: &[u32], arguments: &Arguments<'_>) -> bool {
        let n = self.arguments;
        let is_second = self.nodes.len() == n;
        self.r.len() < LONGEST
            && self.width == arguments.width
            && self.columns[..n].iter().zip(&arguments.columns).all(|(own, c)| *own == (c.start, c.active))
            && nodes.iter().zip(&self.nodes).zip(self.shared).all(|((a, b), shared)| a == b || !shared || is_second)
    }

    /// Adds a factor, whose whitened Jacobian is in the room that was made for it.
    #[inline]
    pub fn push(&mut self, nodes: &[u32], arguments: &Arguments<'_>, r: &[f64]) {
        if self.nodes.is_empty() {
            self.arguments = nodes.len();
            self.columns = arguments.columns.map(|columns| (columns.start, columns.active));
            self.width = arguments.width;
            self.shared = [true; MOST];
        } else if self.nodes.len() == self.arguments {
            for ((shared, a), b) in self.shared.iter_mut().zip(nodes).zip(&self.nodes) {
                *shared = a == b;
            }
        }
        self.nodes.extend_from_slice(nodes);
        self.r.extend_from_slice(r);
    }

    /// Adds JᵀJ and Jᵀr of all factors in the batch, and empties it.
    ///
    /// The block of nodes (i, j), i <= j, is stored by columns, with i's coordinates as rows.
    pub fn flush(&mut self, run: &mut Run<'_>) {
        if self.nodes.is_empty() {
            return;
        }
        let (n, width) = (self.arguments, self.width);
        let factors = self.nodes.len() / n;
        let (rows, pairs) = (self.r.len() / factors, n * (n + 1) / 2);
        let places = run.places;
        let mut pair = 0;
        for a in 0..n {
            for b in a..n {
                pair += 1;
                if self.columns[a].1 == 0 || self.columns[b].1 == 0 {
                    continue;
                }
                // All factors at once, or one by one.
                let step = if self.shared[a] && self.shared[b] { factors } else { 1 };
                for factor in (0..factors).step_by(step) {
                    let matrix = &self.jacobian[factor * rows * width..][..step * rows * width];
                    let strip = |(start, len)| Strip { matrix, width, start, len };
                    let (strip_a, strip_b) = (strip(self.columns[a]), strip(self.columns[b]));
                    let (node_a, node_b) = (self.nodes[factor * n + a], self.nodes[factor * n + b]);
                    if a == b {
                        let r = Strip { matrix: &self.r[factor * rows..][..step * rows], width: 1, start: 0, len: 1 };
                        let gradient = run.block(places[node_a as usize].gradient, strip_a.len);
                        add_product(gradient, strip_a, r);
                    }
                    if run.want < Want::Equations {
                        continue;
                    }
                    let block = run.block(run.offsets[factor * pairs + pair - 1], strip_a.len * strip_b.len);
                    if node_a <= node_b {
                        add_product(block, strip_a, strip_b);
                    }
                    if node_a > node_b || (node_a == node_b && a != b) {
                        add_product(block, strip_b, strip_a);
                    }
                }
            }
        }
        run.offsets = &run.offsets[factors * pairs..];
        self.nodes.clear();
        self.r.clear();
    }
}
