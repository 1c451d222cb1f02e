//! What a command answers, and the one place where it is printed.
use handeye::Error;
use serde_json::{Value, json};
use std::io::{self, Write};

/// The answer of a command, for people and for programs.
pub struct Answer {
    /// What people read; ends with a line break.
    pub text: String,
    /// The one object that `--json` prints.
    pub json: Value,
    /// Why the work counts as not done although there is something to tell.
    pub failure: Option<String>,
}

impl Answer {
    pub fn new(text: String, json: Value) -> Self {
        Answer { text, json, failure: None }
    }
}

/// Prints what came of a command, and gives the exit status.
pub fn print(result: Result<Answer, Error>, is_json: bool) -> u8 {
    let (text, mut json, failure) = match result {
        Ok(Answer { text, json, failure }) => (text, json, failure.map(|reason| (reason, 1))),
        Err(error) => (String::new(), json!({}), Some((error.to_string(), if error.is_input() { 2 } else { 1 }))),
    };
    if let Some((reason, _)) = &failure {
        json["error"] = json!(reason);
    }
    let status = write(&if is_json { format!("{json}\n") } else { text });
    if let Some((reason, status)) = failure {
        complain(&reason);
        return status;
    }
    status
}

/// Arguments that were refused, or a call for help.
pub struct Refusal {
    pub error: clap::Error,
    pub is_json: bool,
}

impl Refusal {
    pub fn print(self) -> u8 {
        let is_help = !self.error.use_stderr();
        if self.is_json && !is_help {
            let message = self.error.to_string();
            let reason = message.split("\n\n").next().unwrap_or_default().trim_start_matches("error: ");
            write(&format!("{}\n", json!({ "error": reason })));
        }
        // Nobody is left to be told where not even this can be written.
        let _ = self.error.print();
        if is_help { 0 } else { 2 }
    }
}

/// Writes to standard output. A reader who has seen enough and closed the pipe is no failure.
fn write(text: &str) -> u8 {
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            complain(&format!("standard output: {error}"));
            1
        }
        _ => 0,
    }
}

/// Tells on standard error what has to be known beside the answer.
pub fn remark(what: &str) {
    let _ = writeln!(io::stderr(), "note: {what}");
}

fn complain(reason: &str) {
    // As above.
    let _ = writeln!(io::stderr(), "error: {reason}");
}
