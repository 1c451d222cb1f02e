//! `handeye experiment`: published experiments in simulation, beside their figures.
use super::answer::Answer;
use super::inputs::{check_output, write_output};
use super::table::Table;
use super::words::count;
use clap::Args;
use handeye::Error;
use handeye::experiments::{ALL, Experiment, Options, Outcome, Published, Row, find, svg};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Run a published experiment in simulation, and print it beside the published figures
///
/// `handeye experiment list` names them: those of Gothoskar et al., "Learning a generative model for robot control using
/// visual feedback", and of Ramirez, "Towards Practical Uncalibrated Visual Servoing".
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye experiment list
  handeye experiment table5 --trials 200
  handeye experiment figure4 --plot figure4.svg")]
pub struct ExperimentCommand {
    /// Which one, or `list`
    #[arg(value_name = "NAME")]
    name: String,
    /// How many trials, each with a recording of its own; some seconds' worth where it is not given
    #[arg(long, value_name = "N")]
    trials: Option<usize>,
    /// Seed of the first trial: the same seed gives the same figures
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Also draw the curves
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
}

impl ExperimentCommand {
    pub fn run(&self) -> Result<Answer, Error> {
        if self.name == "list" {
            return Ok(list());
        }
        let experiment = find(&self.name)?;
        if let Some(path) = &self.plot {
            check_output(path, &[])?;
        }
        let options = Options { trials: self.trials.unwrap_or(experiment.trials), seed: self.seed };
        let outcome = experiment.run(&options)?;
        if let Some(path) = &self.plot {
            let title = format!("{}: {}", experiment.name, experiment.about);
            let drawing = svg(&title, &outcome)
                .ok_or_else(|| Error::Unusable(format!("`{}` has no curve to draw with --plot", experiment.name)))?;
            write_output(path, &drawing)?;
        }
        Ok(Answer::new(text(experiment, &options, &outcome), to_json(experiment, &options, &outcome)))
    }
}

fn list() -> Answer {
    let mut table = Table::default();
    let width = ALL.iter().map(|experiment| experiment.name.len()).max().unwrap_or(0);
    for Experiment { name, about, .. } in ALL {
        table.row([format!("{name:<width$}  {about}")]);
    }
    let entry = |e: &Experiment| json!({ "name": e.name, "about": e.about, "source": e.source, "trials": e.trials });
    Answer::new(table.to_string(), json!({ "experiments": ALL.iter().map(entry).collect::<Vec<_>>() }))
}

fn text(experiment: &Experiment, options: &Options, outcome: &Outcome) -> String {
    let Experiment { name, about, source, .. } = experiment;
    let mut text = format!(
        "{name}: {about}\n{}; {} from seed {}\n{}; published: {source}\n\n",
        outcome.setting,
        count(options.trials, "trial"),
        options.seed,
        outcome.measure
    );
    let failed = outcome.rows.iter().any(|row| row.failed > 0);
    let reconstructed = outcome.rows.iter().any(|row| row.reconstructed.is_some());
    let mut head = vec!["", "published (sd)", "ours (sd)", "median", if failed { "failed" } else { "" }];
    if reconstructed {
        head.insert(2, "reconstructed");
    }
    let mut table = Table::new(&head);
    for row in &outcome.rows {
        // As the paper prints it.
        let published = row.published.map(|Published { mean, sd }| match sd {
            Some(sd) => format!("{mean} ({sd})"),
            None => mean.to_string(),
        });
        let failures = if row.failed > 0 { row.failed.to_string() } else { String::new() };
        let median = row.median().map_or_else(|| "-".to_owned(), figure);
        let mut cells = vec![row.label.clone(), published.unwrap_or_else(|| "-".to_owned())];
        if reconstructed {
            cells.push(row.reconstructed.map_or_else(|| "-".to_owned(), |figure| figure.to_string()));
        }
        cells.extend([spread(row.mean(), row.sd()), median, failures]);
        table.row(cells);
    }
    text += &table.to_string();
    if !outcome.notes.is_empty() {
        text += "\n";
    }
    for note in &outcome.notes {
        text += &format!("{note}\n");
    }
    text
}

fn spread(mean: Option<f64>, sd: Option<f64>) -> String {
    match (mean, sd) {
        (Some(mean), Some(sd)) => format!("{} ({sd:.*})", figure(mean), digits(mean)),
        (Some(mean), None) => figure(mean),
        _ => "-".to_owned(),
    }
}

/// Four digits that count.
fn figure(value: f64) -> String {
    format!("{value:.*}", digits(value))
}

fn digits(value: f64) -> usize {
    if value == 0.0 { 0 } else { (3.0 - value.abs().log10().floor()).clamp(0.0, 6.0) as usize }
}

fn to_json(experiment: &Experiment, options: &Options, outcome: &Outcome) -> Value {
    let row = |row: &Row| {
        json!({
            "label": row.label,
            "panel": row.panel,
            "series": row.series,
            "x": row.x,
            "published": row.published.map(|published| json!({ "mean": published.mean, "sd": published.sd })),
            "reconstructed": row.reconstructed,
            "mean": row.mean(),
            "sd": row.sd(),
            "median": row.median(),
            "values": row.values,
            "failed": row.failed,
        })
    };
    json!({
        "experiment": experiment.name,
        "about": experiment.about,
        "source": experiment.source,
        "trials": options.trials,
        "seed": options.seed,
        "setting": outcome.setting,
        "measure": outcome.measure,
        "abscissa": outcome.abscissa,
        "rows": outcome.rows.iter().map(row).collect::<Vec<_>>(),
        "notes": outcome.notes,
    })
}
