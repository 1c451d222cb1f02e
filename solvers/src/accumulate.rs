//! One pass over part of a graph: the cost and, if wanted, the normal equations H = Σ JᵀJ and b = Σ Jᵀr.
use crate::batch::Batch;
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
    pub batch: Batch,
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
    /// Columns of the full Jacobian.
    pub width: usize,
    /// First column and number of columns of each argument once held coordinates are gone, and how many there are of all.
    pub active_columns: [(usize, usize); MOST],
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
    let mut arguments =
        Arguments { x: [&[]; MOST], columns: [NOTHING; MOST], width: 0, active_columns: [(0, 0); MOST], active: 0 };
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
        arguments.active_columns[k] = (arguments.active, usize::from(place.active));
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
