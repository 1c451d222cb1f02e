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
    /// Columns of the full Jacobian, and how many of them are free.
    pub width: usize,
    pub active: usize,
    /// What was looked up last.
    ids: [u32; MOST],
}

impl<'a> Arguments<'a> {
    /// To be filled, and then filled again for the next factor: it is too large to make anew for each.
    pub fn none() -> Self {
        const NOTHING: Columns<'static> = Columns { start: 0, len: 0, active: 0, free: Coordinates::None };
        Arguments { x: [&[]; MOST], columns: [NOTHING; MOST], width: 0, active: 0, ids: [u32::MAX; MOST] }
    }

    /// Looks up where the arguments are stored and which of their coordinates are free.
    #[inline]
    pub fn look_up(&mut self, ids: &[u32], nodes: &'a [Node], places: &[Place], values: &'a [f64], derived: &'a [f64]) {
        (self.width, self.active) = (0, 0);
        for (((&id, last), x), columns) in ids.iter().zip(&mut self.ids).zip(&mut self.x).zip(&mut self.columns) {
            // Most arguments of a factor are also those of the one before.
            if *last == id && columns.start == self.width {
                self.width += columns.len;
                self.active += columns.active;
                continue;
            }
            *last = id;
            let place = &places[id as usize];
            let store = if place.derived { derived } else { values };
            let start = place.start as usize;
            *x = &store[start..start + usize::from(place.ambient)];
            let free = match &nodes[id as usize].free {
                _ if place.active == 0 => Coordinates::None,
                Some(free) if !place.derived => Coordinates::Some(free),
                _ => Coordinates::All,
            };
            let (len, active) = (usize::from(place.tangent), usize::from(place.active));
            *columns = Columns { start: self.width, len, active, free };
            self.width += len;
            self.active += active;
        }
    }
}

impl<'a> Run<'a> {
    #[inline]
    pub fn look_up(&self, ids: &[u32], arguments: &mut Arguments<'a>) {
        arguments.look_up(ids, self.nodes, self.places, self.values, self.derived);
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
