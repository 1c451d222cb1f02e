//! Corners between four squares to a fraction of a pixel.
use super::gray::Gray;

/// Most steps.
const STEPS: usize = 20;

/// Where the brightness around a corner changes only across lines through it: the least squares of the gradients' parts towards the corner
/// (Förstner), in a window of so many pixels to each side. `None` where there is no corner, or it is farther than half of that away.
pub(super) fn refine_subpixel(image: &Gray, rough: [f64; 2], half: f64) -> Option<[f64; 2]> {
    let mut corner = rough;
    let reach = half.ceil() as i32;
    for _ in 0..STEPS {
        let (mut a, mut b, mut c, mut d, mut e) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for down in -reach..=reach {
            for right in -reach..=reach {
                let (x, y) = (f64::from(right), f64::from(down));
                // Half as much at the window's side as in its middle.
                let weight = (-0.7 * (x * x + y * y) / (half * half)).exp();
                let at = |dx: f64, dy: f64| image.sample([corner[0] + x + dx, corner[1] + y + dy]);
                let gx = 0.5 * (at(1.0, 0.0)? - at(-1.0, 0.0)?);
                let gy = 0.5 * (at(0.0, 1.0)? - at(0.0, -1.0)?);
                a += weight * gx * gx;
                b += weight * gx * gy;
                c += weight * gy * gy;
                d += weight * (gx * gx * x + gx * gy * y);
                e += weight * (gx * gy * x + gy * gy * y);
            }
        }
        let determinant = a * c - b * b;
        // Edges in one direction alone make no corner.
        if determinant <= 1e-3 * (a + c) * (a + c) {
            return None;
        }
        let step = [(c * d - b * e) / determinant, (a * e - b * d) / determinant];
        corner = [corner[0] + step[0], corner[1] + step[1]];
        let moved = (corner[0] - rough[0]).hypot(corner[1] - rough[1]);
        if moved > (0.5 * half).max(1.0) {
            return None;
        }
        if step[0].hypot(step[1]) < 1e-4 {
            break;
        }
    }
    Some(corner)
}
