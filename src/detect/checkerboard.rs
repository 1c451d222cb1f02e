//! Checkerboards, by the corners between four squares.
use super::Seen;
use super::gray::Gray;
use super::saddle::refine_subpixel;
use calib_targets_chessboard::{
    ChessboardDetector, ChessboardParams, DetectorConfig, GrayImageView, default_chess_config, detect_corners,
};
use std::collections::BTreeMap;

/// Shortest side of an image that can hold a board [px]; the search for corners takes no empty images.
const SMALLEST: usize = 32;

/// A checkerboard by its inner corners.
#[derive(Clone, Debug)]
pub struct Checkerboard {
    columns: usize,
    rows: usize,
}

impl Checkerboard {
    /// Fewest corners in a row or column.
    pub const LEAST: usize = 3;

    /// A board of so many inner corners; `None` where they are fewer than three a side.
    pub fn new(columns: usize, rows: usize) -> Option<Checkerboard> {
        let is_enough = columns >= Self::LEAST && rows >= Self::LEAST;
        is_enough.then_some(Checkerboard { columns, rows })
    }

    /// True where a board looks the same when it is turned by half: its colours do not tell which end is which.
    pub fn is_ambiguous(&self) -> bool {
        (self.columns + self.rows).is_multiple_of(2)
    }

    /// All inner corners, called `corner:ROW/COLUMN`; none where not the whole board is seen.
    ///
    /// The square beyond corner 0/0, at the board's outer corner, is dark where one corner of the board is and its opposite is not. A board
    /// that looks the same turned by half (a quarter) begins where it is highest (leftmost, where that is the same) in the image.
    pub(super) fn detect(&self, image: &Gray) -> Vec<Seen> {
        if image.width.min(image.height) < SMALLEST {
            return Vec::new();
        }
        let Some(grid) = self.grid(image) else { return Vec::new() };
        let name = |row: usize, column: usize| format!("corner:{row}/{column}");
        let grid = self.refine_subpixel(image, &grid);
        let corners = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (row, column)));
        corners.map(|(row, column)| (name(row, column), grid[row * self.columns + column])).collect()
    }

    /// The corners row by row.
    fn grid(&self, image: &Gray) -> Option<Vec<[f64; 2]>> {
        let view = GrayImageView { width: image.width, height: image.height, data: &image.pixels };
        let config: DetectorConfig = default_chess_config();
        let detector = ChessboardDetector::new(ChessboardParams::default()).ok()?;
        let found = detector.detect(&detect_corners(&view, &config))?;
        let corners: BTreeMap<(i32, i32), [f64; 2]> = found
            .corners
            .iter()
            .map(|corner| ((corner.grid.v, corner.grid.u), [corner.position.x, corner.position.y].map(f64::from)))
            .collect();
        let ends = |of: fn(&(i32, i32)) -> i32| Some((corners.keys().map(of).min()?, corners.keys().map(of).max()?));
        let ((top, bottom), (left, right)) = (ends(|at| at.0)?, ends(|at| at.1)?);
        let (height, width) = ((bottom - top + 1) as usize, (right - left + 1) as usize);
        let is_whole = corners.len() == height * width;
        let at = |row: usize, column: usize| corners.get(&(top + row as i32, left + column as i32)).copied();
        let all = |of: &dyn Fn(usize, usize) -> Option<[f64; 2]>| {
            let places = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (row, column)));
            places.map(|(row, column)| of(row, column)).collect::<Option<Vec<_>>>()
        };
        let (last_row, last_column) = (self.rows - 1, self.columns - 1);
        // Every way to lay the board onto the grid without a mirror.
        let mut ways = Vec::new();
        if is_whole && (height, width) == (self.rows, self.columns) {
            ways.push(all(&|row, column| at(row, column))?);
            ways.push(all(&|row, column| at(last_row - row, last_column - column))?);
        }
        if is_whole && (height, width) == (self.columns, self.rows) {
            ways.push(all(&|row, column| at(column, last_row - row))?);
            ways.push(all(&|row, column| at(last_column - column, row))?);
        }
        ways.retain(|way| self.is_right_handed(way));
        if !self.is_ambiguous() || self.rows == self.columns {
            ways.retain(|way| self.begins_dark(image, way));
        }
        ways.into_iter().min_by(|a, b| a[0][1].total_cmp(&b[0][1]).then(a[0][0].total_cmp(&b[0][0])))
    }

    /// The corners where the image shows them, in windows that stay within half a square.
    fn refine_subpixel(&self, image: &Gray, grid: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let corner = |index: usize| {
            let (row, column) = (index / self.columns, index % self.columns);
            let beside = [
                (row > 0).then(|| index - self.columns),
                (row + 1 < self.rows).then(|| index + self.columns),
                (column > 0).then(|| index - 1),
                (column + 1 < self.columns).then(|| index + 1),
            ];
            let distance = |other: usize| (grid[other][0] - grid[index][0]).hypot(grid[other][1] - grid[index][1]);
            let nearest = beside.into_iter().flatten().map(distance).fold(f64::INFINITY, f64::min);
            refine_subpixel(image, grid[index], (0.4 * nearest).clamp(2.0, 6.0)).unwrap_or(grid[index])
        };
        (0..grid.len()).map(corner).collect()
    }

    /// True where columns and rows turn as u and v do: a board that is seen from its front.
    fn is_right_handed(&self, grid: &[[f64; 2]]) -> bool {
        let [origin, right, down] = [grid[0], grid[self.columns - 1], grid[(self.rows - 1) * self.columns]];
        let [along, across] = [right, down].map(|end| [end[0] - origin[0], end[1] - origin[1]]);
        along[0] * across[1] - along[1] * across[0] > 0.0
    }

    /// True where the square between the first four corners is dark, so that the one beyond the first corner is too.
    fn begins_dark(&self, image: &Gray, grid: &[[f64; 2]]) -> bool {
        let middle = |row: usize, column: usize| {
            let corner = |down: usize, right: usize| grid[(row + down) * self.columns + column + right];
            let corners = [corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)];
            image.sample([0, 1].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0))
        };
        // Of all squares, so that no spot of light decides.
        let (mut first, mut second) = (0.0, 0.0);
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                let brightness = middle(row, column).unwrap_or(0.0);
                *(if (row + column).is_multiple_of(2) { &mut first } else { &mut second }) += brightness;
            }
        }
        let squares = (self.rows - 1) * (self.columns - 1);
        first / squares.div_ceil(2) as f64 * (squares / 2) as f64 <= second
    }
}
