//! One pass over part of a graph: the cost and, if wanted, the normal equations H = Σ JᵀJ and b = Σ Jᵀr.
use crate::graph::Node;
use crate::jacobian::{Columns, Coordinates};
use crate::pool::MOST;
use crate::scalar::Dual;

/// Where a block of the normal equations lives: in the arena that all chunks share, or in the chunk's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Offset(u32);

impl Offset {
    pub const NONE: Offset = Offset(u32::MAX);
    const SHARED: u32 = 1 << 31;

    pub fn shared(at: usize) -> Self {
        Offset(at as u32 | Self::SHARED)
    }

    pub fn private(at: usize) -> Self {
        Offset(at as u32)
    }

    pub fn is_shared(self) -> bool {
        self.0 & Self::SHARED != 0
    }

    pub fn at(self) -> usize {
        (self.0 & !Self::SHARED) as usize
    }
}

/// A node as one pass sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub derived: bool,
    /// Where it is stored: in the values, or among the derived values of its chunk.
    pub start: u32,
    pub ambient: u16,
    pub tangent: u16,
    /// Coordinates of its step that are in the normal equations.
    pub active: u16,
    /// Its part of b.
    pub gradient: Offset,
}

/// What a pass computes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Debug)]
pub(crate) enum Want {
    Cost,
    /// The cost and b.
    Gradient,
    /// The cost, b and H.
    Equations,
}

/// Buffers that a pass borrows, so that it allocates nothing once they have grown.
#[derive(Default)]
pub(crate) struct Scratch {
    pub jacobian: Vec<f64>,
    pub residual: Vec<f64>,
    pub steps: Vec<Dual>,
    pub product: Vec<f64>,
}

/// One pass over one chunk.
pub(crate) struct Run<'a> {
    pub nodes: &'a [Node],
    pub places: &'a [Place],
    pub values: &'a [f64],
    pub derived: &'a [f64],
    pub private: &'a mut [f64],
    pub shared: &'a mut [f64],
    /// Blocks of the coming factors: of each, one per pair of arguments (a, b) with a <= b.
    pub offsets: &'a [Offset],
    pub want: Want,
    pub graduation: f64,
    pub cost: f64,
    pub scratch: &'a mut Scratch,
}

/// The arguments of one factor or function.
pub(crate) struct Arguments<'a> {
    pub x: [&'a [f64]; MOST],
    pub columns: [Columns<'a>; MOST],
    /// Columns of the full Jacobian, and how many of them are free.
    pub width: usize,
    pub active: usize,
}

/// Looks up where the arguments are stored and which of their coordinates are free.
#[inline]
pub(crate) fn arguments<'a>(
    ids: &[u32],
    nodes: &'a [Node],
    places: &[Place],
    values: &'a [f64],
    derived: &'a [f64],
) -> Arguments<'a> {
    const NOTHING: Columns<'static> = Columns { start: 0, len: 0, free: Coordinates::None };
    let mut arguments = Arguments { x: [&[]; MOST], columns: [NOTHING; MOST], width: 0, active: 0 };
    for (k, &id) in ids.iter().enumerate() {
        let place = &places[id as usize];
        let store = if place.derived { derived } else { values };
        let start = place.start as usize;
        arguments.x[k] = &store[start..start + usize::from(place.ambient)];
        let free = match &nodes[id as usize].free {
            _ if place.active == 0 => Coordinates::None,
            Some(free) if !place.derived => Coordinates::Some(free),
            _ => Coordinates::All,
        };
        arguments.columns[k] = Columns { start: arguments.width, len: usize::from(place.tangent), free };
        arguments.width += usize::from(place.tangent);
        arguments.active += usize::from(place.active);
    }
    arguments
}

impl<'a> Run<'a> {
    #[inline]
    pub fn arguments(&self, ids: &[u32]) -> Arguments<'a> {
        arguments(ids, self.nodes, self.places, self.values, self.derived)
    }

    /// Passes over the blocks of a factor that adds none.
    #[inline]
    pub fn skip(&mut self, arguments: usize) {
        if self.want > Want::Cost {
            self.offsets = &self.offsets[arguments * (arguments + 1) / 2..];
        }
    }

    #[inline]
    pub fn block(&mut self, offset: Offset, len: usize) -> &mut [f64] {
        let arena = if offset.is_shared() { &mut *self.shared } else { &mut *self.private };
        &mut arena[offset.at()..offset.at() + len]
    }
}

/// Adds JᵀJ and Jᵀr of one factor. `jacobian` has a row per entry of `r`; argument k's columns begin at `starts[k]`.
///
/// The block of nodes (i, j), i <= j, is stored by columns, with i's coordinates as rows.
#[inline]
pub(crate) fn accumulate(run: &mut Run<'_>, ids: &[u32], starts: &[usize], r: &[f64], jacobian: &[f64]) {
    let width = jacobian.len() / r.len();
    let places = run.places;
    let dim = |k: usize| usize::from(places[ids[k] as usize].active);
    let gradient_only = run.want == Want::Gradient;
    let mut pair = 0;
    for a in 0..ids.len() {
        let (ca, da) = (starts[a], dim(a));
        if da > 0 {
            let b = run.block(places[ids[a] as usize].gradient, da);
            for (m, &r) in r.iter().enumerate() {
                add_scaled(b, r, &jacobian[m * width + ca..m * width + ca + da]);
            }
        }
        if gradient_only {
            pair += ids.len() - a;
            continue;
        }
        for b in a..ids.len() {
            let (cb, db) = (starts[b], dim(b));
            let offset = run.offsets[pair];
            pair += 1;
            if da == 0 || db == 0 {
                continue;
            }
            let block = run.block(offset, da * db);
            // The node with the smaller index has the rows.
            let (rows, columns) = if ids[a] <= ids[b] { ((ca, da), (cb, db)) } else { ((cb, db), (ca, da)) };
            add_product(block, rows, columns, r.len(), width, jacobian);
            if a != b && ids[a] == ids[b] {
                add_product(block, columns, rows, r.len(), width, jacobian);
            }
        }
    }
    run.offsets = &run.offsets[pair..];
}

/// block += Jᵢᵀ Jⱼ, where (start, width) name the columns of J.
#[inline]
fn add_product(
    block: &mut [f64],
    (ci, di): (usize, usize),
    (cj, dj): (usize, usize),
    rows: usize,
    width: usize,
    jacobian: &[f64],
) {
    if rows == 2 {
        // Pixels: the case that calibration spends its time in.
        let (first, second) = jacobian.split_at(width);
        let (i0, i1) = (&first[ci..ci + di], &second[ci..ci + di]);
        let (j0, j1) = (&first[cj..cj + dj], &second[cj..cj + dj]);
        for ((column, &s0), &s1) in block.chunks_exact_mut(di).zip(j0).zip(j1) {
            for ((h, x), y) in column.iter_mut().zip(i0).zip(i1) {
                *h += s0 * x + s1 * y;
            }
        }
        return;
    }
    for row in jacobian.chunks_exact(width).take(rows) {
        for (column, &s) in block.chunks_exact_mut(di).zip(&row[cj..cj + dj]) {
            if s != 0.0 {
                add_scaled(column, s, &row[ci..ci + di]);
            }
        }
    }
}

/// y += s x.
#[inline]
pub(crate) fn add_scaled(y: &mut [f64], s: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += s * x;
    }
}
