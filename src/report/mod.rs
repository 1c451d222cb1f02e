//! Calibrations, evaluations and servo runs, each as one page to read: self-contained HTML, light and dark, for screen, phone and paper.
mod arm;
mod calibration;
mod change;
mod charts;
mod evaluation;
mod noise;
mod page;
mod residuals;
mod sections;
mod servo;
mod values;
mod verdict;

pub use calibration::{ExtraTable, Subject, html, suggestion};
pub use evaluation::{evaluation_html, evaluation_steps};
pub use page::About;
pub use residuals::{Residual, residuals};
pub use servo::servo_html;
