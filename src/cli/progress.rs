//! Progress on standard error, where a person is watching.
use handeye::calibrate::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// A progress bar, or nothing: with `--json`, and where standard error is no terminal.
pub struct Bar(ProgressBar);

impl Bar {
    pub fn new(is_json: bool) -> Self {
        // `stderr` hides itself where it is no terminal.
        let target = if is_json { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(0), target);
        let style = ProgressStyle::with_template("{elapsed:>4} {msg:<44} {bar:32} {pos}/{len}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Bar(bar)
    }

    /// Shows what a calibration is doing, after words of the caller's own; never cancels it.
    pub fn show(&self, prefix: &str, progress: &Progress<'_>) -> ControlFlow<()> {
        let rms = progress.rms_px.map_or_else(String::new, |rms| format!(" ({rms:.2} px)"));
        self.0.set_length(progress.of as u64);
        self.0.set_position(progress.done as u64);
        self.0.set_message(format!("{prefix}{}{rms}", progress.stage));
        ControlFlow::Continue(())
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// A bar for several calibrations; where standard error is no terminal a line now and then, and nothing with `--json`.
pub struct Steps {
    bar: Bar,
    is_told: bool,
    began: Instant,
    last: Instant,
}

/// What takes longer says so once in this time.
const BETWEEN_LINES: Duration = Duration::from_secs(30);

impl Steps {
    pub fn new(is_json: bool) -> Self {
        let now = Instant::now();
        Steps { bar: Bar::new(is_json), is_told: !is_json && !io::stderr().is_terminal(), began: now, last: now }
    }

    /// Shows which calibration is at what.
    pub fn show(&mut self, which: &str, progress: &Progress<'_>) {
        let _ = self.bar.show(&format!("{which}: "), progress);
        if self.is_told && self.last.elapsed() > BETWEEN_LINES {
            self.last = Instant::now();
            eprintln!("after {:.0} s: {which}: {}", self.began.elapsed().as_secs_f64(), progress.stage);
        }
    }
}

/// A line that is rewritten as things go on, or nothing: as above.
pub struct Line(ProgressBar);

impl Line {
    pub fn new(is_json: bool) -> Self {
        let target = if is_json { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let line = ProgressBar::with_draw_target(None, target);
        line.set_style(ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_spinner()));
        Line(line)
    }

    pub fn show(&self, words: &str) {
        self.0.set_message(words.to_owned());
        self.0.tick();
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
