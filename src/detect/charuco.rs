//! ChArUco boards: checkerboards whose bright squares bear tags, which say where on the board a corner is.
use super::Seen;
use super::gray::Gray;
use super::homography::Homography;
use super::quads::Quad;
use super::saddle::refine_subpixel;
use super::tags::Family;

/// A ChArUco board in OpenCV's layout (since 4.6): the square at the upper left is dark, and the bright ones bear tags 0, 1, 2 row by row.
#[derive(Clone, Debug)]
pub struct Charuco {
    family: Family,
    columns: usize,
    rows: usize,
    ratio: f64,
}

impl Charuco {
    /// A board of so many squares, with tags whose side is a part of the squares'.
    ///
    /// Errors: why there is no such board, in words.
    pub fn new(columns: usize, rows: usize, family: Family, ratio: f64) -> Result<Charuco, String> {
        let tags = family.len();
        let needed = columns.saturating_mul(rows) / 2;
        if columns < 2 || rows < 2 {
            return Err(format!("a board has two squares a side at least, found {columns} and {rows}"));
        }
        if needed > tags {
            return Err(format!(
                "a board of {columns} x {rows} squares needs {needed} tags, and {} has {tags}",
                family.name()
            ));
        }
        if !(ratio > 0.1 && ratio < 1.0) {
            return Err(format!("the side of the tags is a part of the squares', between 0.1 and 1, found {ratio}"));
        }
        Ok(Charuco { family, columns, rows, ratio })
    }

    /// The corners between squares beside which a tag is seen, called `corner:ROW/COLUMN`.
    pub(super) fn detect(&self, image: &Gray) -> Vec<Seen> {
        let tags = self.family.tags(image);
        let mut seen = Vec::new();
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                if let Some(pixel) = self.corner(image, &tags, row, column) {
                    seen.push((format!("corner:{row}/{column}"), pixel));
                }
            }
        }
        seen
    }

    /// The corner at the lower right of a square: where the tags beside it say, then where the image shows it.
    fn corner(&self, image: &Gray, tags: &[(u32, Quad)], row: usize, column: usize) -> Option<[f64; 2]> {
        let squares = [(row, column), (row, column + 1), (row + 1, column), (row + 1, column + 1)];
        let mut guesses: Vec<[f64; 2]> = Vec::new();
        // From the corner to the nearest of the tags [px].
        let mut gap = f64::INFINITY;
        for (at_row, at_column) in squares {
            let Some(id) = self.tag(at_row, at_column) else { continue };
            let Ok(index) = tags.binary_search_by_key(&id, |(known, _)| *known) else { continue };
            let quad = tags[index].1;
            // The square's corner as the tag counts: 0 at its upper left, 1 at its lower right corner.
            let margin = 0.5 * (1.0 / self.ratio - 1.0);
            let place = |is_after: bool| if is_after { 1.0 + margin } else { -margin };
            let [x, y] = [place(at_column == column), place(at_row == row)];
            let guess = Homography::new(&quad)?.at([x, y]);
            let distance = |corner: &[f64; 2]| (corner[0] - guess[0]).hypot(corner[1] - guess[1]);
            gap = gap.min(quad.iter().map(distance).fold(f64::INFINITY, f64::min));
            guesses.push(guess);
        }
        let count = guesses.len() as f64;
        let guess = [0, 1].map(|axis| guesses.iter().map(|guess| guess[axis]).sum::<f64>() / count);
        // Edges of tags stay out of the window, which is two pixels at least.
        refine_subpixel(image, guess, (0.6 * gap).clamp(2.0, 6.0)).filter(|_| !guesses.is_empty())
    }

    /// The tag on a square.
    fn tag(&self, row: usize, column: usize) -> Option<u32> {
        // Bright squares of all rows before: every other square, the first of which is dark.
        let before = row * self.columns / 2 + if row.is_multiple_of(2) { column / 2 } else { column.div_ceil(2) };
        ((row + column) % 2 == 1).then_some(before as u32)
    }
}
