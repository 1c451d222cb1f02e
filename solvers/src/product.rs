//! The one product that the normal equations are made of: block += Aᵀ B.

/// Neighbouring columns of a matrix that is stored by rows.
#[derive(Clone, Copy)]
pub(crate) struct Strip<'a> {
    pub matrix: &'a [f64],
    /// Length of a row of the matrix.
    pub width: usize,
    /// The first column, and how many there are.
    pub start: usize,
    pub len: usize,
}

impl<'a> Strip<'a> {
    /// The strip's part of a row, from its column `i` on.
    #[inline(always)]
    fn row(&self, row: usize, i: usize) -> &'a [f64] {
        let start = row * self.width + self.start;
        &self.matrix[start + i..start + self.len]
    }
}

/// block += Aᵀ B for A and B of equally many rows; the block is stored by columns, with A's columns as its rows.
///
/// Goes through the block in bands of up to 6 rows: steps of poses have 6 coordinates.
#[inline]
pub(crate) fn add_product(block: &mut [f64], a: Strip<'_>, b: Strip<'_>) {
    let mut i = 0;
    while i < a.len {
        i += match a.len - i {
            1 => add_band::<1>(block, a, b, i),
            2 => add_band::<2>(block, a, b, i),
            3 | 5 => add_band::<3>(block, a, b, i),
            4 | 7 | 8 => add_band::<4>(block, a, b, i),
            _ => add_band::<6>(block, a, b, i),
        };
    }
}

/// Rows `i` to `i + R` of the block. Returns `R`.
#[inline]
fn add_band<const R: usize>(block: &mut [f64], a: Strip<'_>, b: Strip<'_>, i: usize) -> usize {
    if a.matrix.len() == 2 * a.width {
        add_two_rows(block, a, b, i, [first::<R>(a.row(0, i)), first::<R>(a.row(1, i))]);
        return R;
    }
    let mut j = 0;
    while j < b.len {
        j += match b.len - j {
            1 => add_tile::<R, 1>(block, a, b, (i, j)),
            2 | 4 => add_tile::<R, 2>(block, a, b, (i, j)),
            _ => add_tile::<R, 3>(block, a, b, (i, j)),
        };
    }
    R
}

/// A band of a product of two rows, which is what one pixel makes.
#[inline(always)]
fn add_two_rows<const R: usize>(block: &mut [f64], a: Strip<'_>, b: Strip<'_>, i: usize, [x, y]: [&[f64; R]; 2]) {
    for ((column, s), t) in block.chunks_exact_mut(a.len).zip(b.row(0, 0)).zip(b.row(1, 0)) {
        for ((h, x), y) in column[i..i + R].iter_mut().zip(x).zip(y) {
            *h += s * x + t * y;
        }
    }
}

/// `R` rows and `C` columns of the block, from (i, j) on: their sums stay in registers while the rows of A and B pass by,
/// so that the block is read and written once however many there are. Returns `C`.
#[inline(always)]
fn add_tile<const R: usize, const C: usize>(
    block: &mut [f64],
    a: Strip<'_>,
    b: Strip<'_>,
    (i, j): (usize, usize),
) -> usize {
    let mut sums = [[0.0; R]; C];
    let (mut at_a, mut at_b) = (a.start + i, b.start + j);
    while at_a < a.matrix.len() {
        let (x, y) = (first::<R>(&a.matrix[at_a..]), first::<C>(&b.matrix[at_b..]));
        for (sums, y) in sums.iter_mut().zip(y) {
            for (sum, x) in sums.iter_mut().zip(x) {
                *sum += x * y;
            }
        }
        (at_a, at_b) = (at_a + a.width, at_b + b.width);
    }
    for (c, sums) in sums.iter().enumerate() {
        let start = (j + c) * a.len + i;
        for (h, sum) in block[start..start + R].iter_mut().zip(sums) {
            *h += sum;
        }
    }
    C
}

#[inline(always)]
fn first<const N: usize>(row: &[f64]) -> &[f64; N] {
    row.first_chunk().expect("a strip lies within its matrix")
}

/// y += s x.
#[inline]
pub(crate) fn add_scaled(y: &mut [f64], s: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += s * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn the_product_of_strips_of_any_size_is_that_of_the_matrices() {
        for (rows, m, n) in (1..5).flat_map(|rows| (0..14).flat_map(move |m| (0..5).map(move |n| (rows, m, n)))) {
            let a = DMatrix::from_fn(rows, m + 3, |i, j| (1.0 + i as f64 + 0.3 * j as f64).sin());
            let b = DMatrix::from_fn(rows, n + 2, |i, j| (2.0 + 1.7 * i as f64 - 0.4 * j as f64).cos());
            let (by_rows_a, by_rows_b) = (a.transpose(), b.transpose());
            let mut block = vec![0.5; m * n];
            add_product(
                &mut block,
                Strip { matrix: by_rows_a.as_slice(), width: m + 3, start: 2, len: m },
                Strip { matrix: by_rows_b.as_slice(), width: n + 2, start: 1, len: n },
            );
            let expected = a.columns(2, m).transpose() * b.columns(1, n);
            for (found, expected) in block.iter().zip(&expected) {
                assert!((found - 0.5 - expected).abs() < 1e-14, "{rows} {m} {n}");
            }
        }
    }
}
