//! Where a factor or a function writes its derivatives, and forward mode, which writes them where nobody else does.
use crate::Variables;
use crate::scalar::{Dual, LANES, derivatives, seed};

/// Which coordinates of an argument's step are free.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Coordinates<'a> {
    None,
    All,
    Some(&'a [u16]),
}

/// One argument's columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Columns<'a> {
    pub start: usize,
    pub len: usize,
    /// How many of them are free.
    pub active: usize,
    pub free: Coordinates<'a>,
}

/// Derivatives of a residual, or of the step of a derived node, with respect to the steps of the arguments.
///
/// Row-major: one row per residual, one column per coordinate of each argument in turn.
pub struct Jacobian<'a> {
    pub(crate) data: &'a mut [f64],
    pub(crate) columns: &'a [Columns<'a>],
    pub(crate) width: usize,
}

impl Jacobian<'_> {
    /// False where all of the argument is held, so that its columns need not be written.
    #[inline]
    pub fn wanted(&self, argument: usize) -> bool {
        !matches!(self.columns[argument].free, Coordinates::None)
    }

    /// False where this coordinate of the argument is held.
    #[inline]
    pub fn wanted_coordinate(&self, argument: usize, coordinate: usize) -> bool {
        match self.columns[argument].free {
            Coordinates::None => false,
            Coordinates::All => true,
            Coordinates::Some(free) => free.binary_search(&(coordinate as u16)).is_ok(),
        }
    }

    /// Derivatives of one row with respect to one argument's step. Every column that is wanted must be written.
    #[inline]
    pub fn row(&mut self, row: usize, argument: usize) -> &mut [f64] {
        let columns = &self.columns[argument];
        let start = row * self.width + columns.start;
        &mut self.data[start..start + columns.len]
    }
}

/// Columns of a Jacobian on all arguments.
pub(crate) fn width(columns: &[Columns<'_>]) -> usize {
    columns.iter().map(|argument| argument.len).sum()
}

/// Forward mode in passes of [`LANES`] directions: `call` computes `output` from the arguments over dual numbers, and the
/// derivatives of its entries become the rows of the Jacobian.
#[inline]
pub(crate) fn forward<V: Variables>(
    x: &[&[f64]],
    jacobian: &mut Jacobian<'_>,
    output: &mut [Dual],
    mut call: impl FnMut(V::Over<Dual>, &mut [Dual]),
) {
    let columns = jacobian.columns;
    let directions: usize = columns.iter().map(|argument| argument.active).sum();
    for first in (0..directions.max(1)).step_by(LANES) {
        let arguments = V::seed(x, |k, i| match lane(columns, k, i, first) {
            Some(lane) => seed(0.0, lane),
            None => Dual::from(0.0),
        });
        call(arguments, output);
        for (row, value) in output.iter().enumerate() {
            let slopes = derivatives(value);
            for_each_free(columns, first, |lane, column| {
                jacobian.data[row * jacobian.width + column] = slopes[lane];
            });
        }
    }
}

/// The lane of the k-th argument's i-th coordinate in the pass that begins with direction `first`.
#[inline]
fn lane(columns: &[Columns<'_>], k: usize, i: usize, first: usize) -> Option<usize> {
    let before: usize = columns[..k].iter().map(|argument| argument.active).sum();
    let rank = match columns[k].free {
        Coordinates::None => return None,
        Coordinates::All => i,
        Coordinates::Some(free) => free.binary_search(&(i as u16)).ok()?,
    };
    (before + rank).checked_sub(first).filter(|&lane| lane < LANES)
}

/// Calls `each(lane, column)` for the directions of the pass that begins with `first`.
#[inline]
fn for_each_free(columns: &[Columns<'_>], first: usize, mut each: impl FnMut(usize, usize)) {
    let mut direction = 0;
    for argument in columns {
        for rank in 0..argument.active {
            if (first..first + LANES).contains(&direction) {
                let coordinate = match argument.free {
                    Coordinates::Some(free) => usize::from(free[rank]),
                    _ => rank,
                };
                each(direction - first, argument.start + coordinate);
            }
            direction += 1;
        }
    }
}

/// Moves the free columns of each argument to where its columns begin, in every row.
#[inline]
pub(crate) fn compact(data: &mut [f64], width: usize, columns: &[Columns<'_>]) {
    for argument in columns {
        let Coordinates::Some(free) = argument.free else { continue };
        for row in data.chunks_exact_mut(width) {
            let columns = &mut row[argument.start..argument.start + argument.len];
            for (to, &coordinate) in free.iter().enumerate() {
                columns[to] = columns[usize::from(coordinate)];
            }
        }
    }
}
