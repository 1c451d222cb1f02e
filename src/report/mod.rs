//! A calibration as one page to read: self-contained HTML, light and dark, for screen, phone and paper.
mod arm;
mod charts;
mod page;
mod residuals;
mod sections;
mod values;

pub use residuals::{Residual, residuals};

use crate::Error;
use crate::calibrate::Calibration;
use crate::recording::Recording;
use crate::rig::Rig;
use page::Page;

/// What a report on a calibration is made of.
pub struct Subject<'a> {
    /// What stands at the top, such as the name of the file that was written.
    pub title: &'a str,
    /// What was known before.
    pub before: &'a Rig,
    /// What was learned, and how.
    pub calibration: &'a Calibration,
    /// What it was learned from.
    pub recording: &'a Recording,
    /// What further tables there are: a title, a header and rows of cells.
    pub tables: &'a [ExtraTable],
}

/// A table that somebody adds to a report.
pub struct ExtraTable {
    /// Above it.
    pub title: String,
    /// Names of its columns.
    pub header: Vec<String>,
    /// Its cells, row by row.
    pub rows: Vec<Vec<String>>,
}

/// The page of a calibration.
///
/// Errors: [`Error::Unusable`] where rig and recording do not fit.
pub fn html(subject: &Subject<'_>) -> Result<String, Error> {
    let residuals = residuals(&subject.calibration.rig, subject.recording)?;
    let mut page = Page::new(subject.title);
    sections::summary(&mut page, subject);
    sections::cameras(&mut page, subject, &residuals);
    sections::histogram_of(&mut page, subject, &residuals);
    sections::worst(&mut page, subject, &residuals);
    sections::coverage(&mut page, subject);
    arm::view(&mut page, subject)?;
    values::table(&mut page, subject);
    sections::open(&mut page, subject);
    sections::influence(&mut page, subject);
    sections::extra(&mut page, subject);
    sections::stages(&mut page, subject);
    sections::next(&mut page, subject);
    Ok(page.finish())
}
