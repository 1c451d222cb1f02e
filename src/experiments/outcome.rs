//! What an experiment found: rows of figures, each beside the published one.

/// The figures of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// What was simulated, in words.
    pub setting: String,
    /// What the rows' figures are, with their unit.
    pub measure: &'static str,
    /// What the rows' abscissa is, with its unit, where they make a curve.
    pub abscissa: Option<&'static str>,
    /// The figures.
    pub rows: Vec<Row>,
    /// What has to be known to compare them with the published ones.
    pub notes: Vec<String>,
}

/// One figure: its published value, and ours in every trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Which drawing it belongs to, called by what its figures are; empty where there is only one.
    pub panel: &'static str,
    /// Which curve or part of the table it belongs to; empty where there is only one.
    pub series: &'static str,
    /// What it is.
    pub label: String,
    /// Its place along the abscissa.
    pub x: Option<f64>,
    /// What the publication gives.
    pub published: Option<Published>,
    /// What an independent reconstruction of the publication comes to, where there is one.
    pub reconstructed: Option<f64>,
    /// Ours, one per trial that came to a result.
    pub values: Vec<f64>,
    /// Trials in which nothing could be learned.
    pub failed: usize,
}

/// A published figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published {
    /// Mean.
    pub mean: f64,
    /// Standard deviation, where it is given.
    pub sd: Option<f64>,
}

impl Published {
    /// A figure without a standard deviation.
    pub const fn single(mean: f64) -> Option<Published> {
        Some(Published { mean, sd: None })
    }

    /// Mean and standard deviation.
    pub const fn spread(mean: f64, sd: f64) -> Option<Published> {
        Some(Published { mean, sd: Some(sd) })
    }
}

impl Row {
    /// From one result per trial, `None` where nothing was learned.
    pub(super) fn new(label: impl Into<String>, published: Option<Published>, results: &[Option<f64>]) -> Row {
        let values: Vec<f64> = results.iter().flatten().copied().collect();
        let failed = results.len() - values.len();
        Row { panel: "", series: "", label: label.into(), x: None, published, reconstructed: None, values, failed }
    }

    /// The same as a point of a curve.
    pub(super) fn at(self, series: &'static str, x: f64) -> Row {
        Row { series, x: Some(x), ..self }
    }

    /// The same in one of several drawings.
    pub(super) fn on(self, panel: &'static str) -> Row {
        Row { panel, ..self }
    }

    /// Mean over the trials; `None` without any.
    pub fn mean(&self) -> Option<f64> {
        let n = self.values.len();
        (n > 0).then(|| self.values.iter().sum::<f64>() / n as f64)
    }

    /// Standard deviation over the trials; `None` for fewer than two.
    pub fn sd(&self) -> Option<f64> {
        let (n, mean) = (self.values.len(), self.mean()?);
        let squares: f64 = self.values.iter().map(|value| (value - mean).powi(2)).sum();
        (n > 1).then(|| (squares / (n - 1) as f64).sqrt())
    }

    /// Median over the trials; `None` without any.
    pub fn median(&self) -> Option<f64> {
        let mut sorted = self.values.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        (n > 0).then(|| 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]))
    }
}
