//! Features in images: corners of tags and boards, to a fraction of a pixel; and where boards of known size are.
//!
//! Tags are dark quadrilaterals whose sides are fitted to the brightest change; boards' corners are where all gradients lead.
mod charuco;
mod checkerboard;
mod dark;
mod folders;
mod gray;
mod homography;
mod names;
mod quads;
mod saddle;
mod tags;
mod targets;

pub use charuco::Charuco;
pub use checkerboard::Checkerboard;
pub use folders::{Folder, detect_in_folders};
pub use gray::Gray;
pub use tags::Family;

use crate::error::suggestion;

/// A feature's name, and its pixel.
pub type Seen = (String, [f64; 2]);

/// What to look for in images.
#[derive(Clone, Debug)]
pub enum Pattern {
    /// Tags of a family.
    Tags(Family),
    /// A checkerboard.
    Checkerboard(Checkerboard),
    /// A ChArUco board.
    Charuco(Charuco),
}

impl Pattern {
    /// A pattern in words: a family of tags, `checkerboard=9x6` (inner corners, columns and rows), or `charuco=7x5:DICT_5X5_100:0.75` (squares,
    /// family, side of the tags over that of the squares).
    ///
    /// Errors: what would do, in words.
    pub fn parse(text: &str) -> Result<Pattern, String> {
        let family = |name: &str| {
            let known = Family::names().collect::<Vec<_>>();
            Family::of(name).ok_or_else(|| format!("unknown family of tags `{name}` {}", suggestion(name, known)))
        };
        let size = |text: &str| {
            let (columns, rows) = text.split_once('x')?;
            Some((columns.parse().ok()?, rows.parse().ok()?))
        };
        let Some((kind, of)) = text.split_once('=') else {
            let boards = "boards are checkerboard=COLUMNSxROWS or charuco=COLUMNSxROWS:FAMILY:RATIO";
            return family(text).map(Pattern::Tags).map_err(|unknown| format!("{unknown}; {boards}"));
        };
        match (kind, &of.split(':').collect::<Vec<_>>()[..]) {
            ("checkerboard", [board]) => {
                let size = size(board).ok_or("expected checkerboard=COLUMNSxROWS, of inner corners")?;
                let board = Checkerboard::new(size.0, size.1);
                board
                    .map(Pattern::Checkerboard)
                    .ok_or_else(|| "a checkerboard has three inner corners a side at least".to_owned())
            }
            ("charuco", [board, name, ratio]) => {
                let wrong =
                    "expected charuco=COLUMNSxROWS:FAMILY:RATIO, of squares, with the tags' side over the squares'";
                let size = size(board).ok_or(wrong)?;
                let ratio = ratio.parse().map_err(|_| wrong)?;
                Charuco::new(size.0, size.1, family(name)?, ratio).map(Pattern::Charuco)
            }
            _ => Err(format!(
                "`{text}` is no pattern: a family of tags (tag36h11, DICT_4X4_50), checkerboard=COLUMNSxROWS or \
                 charuco=COLUMNSxROWS:FAMILY:RATIO"
            )),
        }
    }

    /// True for a checkerboard that looks the same turned by half.
    pub fn is_ambiguous(&self) -> bool {
        matches!(self, Pattern::Checkerboard(board) if board.is_ambiguous())
    }

    /// What of it an image shows, in the order of the names' numbers.
    pub fn detect(&self, image: &Gray) -> Vec<Seen> {
        match self {
            Pattern::Tags(family) => family.detect(image),
            Pattern::Checkerboard(board) => board.detect(image),
            Pattern::Charuco(board) => board.detect(image),
        }
    }
}
