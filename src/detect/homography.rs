//! The homography from the unit square to what a camera sees of it.
use super::quads::Quad;

/// The homography from the unit square to a quadrilateral (Heckbert 1989).
pub(super) struct Homography {
    /// Of u, v and what both are divided by: factors of x and y, and a constant.
    rows: [[f64; 3]; 3],
}

impl Homography {
    /// Corners (0, 0), (1, 0), (1, 1), (0, 1) go to those of the quadrilateral; `None` where three of them are on a line.
    pub(super) fn new(quad: &Quad) -> Option<Homography> {
        let [p0, p1, p2, p3] = *quad;
        let sum = [0, 1].map(|axis| p0[axis] - p1[axis] + p2[axis] - p3[axis]);
        let one = [0, 1].map(|axis| p1[axis] - p2[axis]);
        let other = [0, 1].map(|axis| p3[axis] - p2[axis]);
        let determinant = one[0] * other[1] - other[0] * one[1];
        let g = (sum[0] * other[1] - other[0] * sum[1]) / determinant;
        let h = (one[0] * sum[1] - sum[0] * one[1]) / determinant;
        let row = |axis: usize| [p1[axis] - p0[axis] + g * p1[axis], p3[axis] - p0[axis] + h * p3[axis], p0[axis]];
        (determinant != 0.0 && g.is_finite() && h.is_finite())
            .then(|| Homography { rows: [row(0), row(1), [g, h, 1.0]] })
    }

    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [u, v, w] = self.rows.map(|row| row[0] * x + row[1] * y + row[2]);
        [u / w, v / w]
    }
}
