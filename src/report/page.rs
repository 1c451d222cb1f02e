//! The page: its frame, its style, and the pieces that it is built from.
use crate::svg::escaped;
use std::fmt::Write;

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("view.js");
const PLAYER: &str = include_str!("player.js");

/// What a page is about.
#[derive(Clone, Copy, Debug, Default)]
pub struct About<'a> {
    /// What stands at its top, such as the names of a rig and of its recordings.
    pub title: &'a str,
    /// The command that made it; empty where none did.
    pub command: &'a str,
    /// What there is to say of how the recording was read.
    pub notes: &'a [String],
}

impl<'a> From<&'a str> for About<'a> {
    fn from(title: &'a str) -> Self {
        About { title, ..About::default() }
    }
}

/// A page that is being written. Of words, what stands between backticks is shown as code.
pub(super) struct Page {
    body: String,
    is_open: bool,
}

impl Page {
    pub fn new(about: &About<'_>) -> Self {
        let title = escaped(about.title);
        let command = match about.command {
            "" => String::new(),
            command => format!("<p class=\"command\"><code>{}</code></p>\n", escaped(command)),
        };
        let head = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n\
             <body>\n<main>\n<h1>{title}</h1>\n{command}"
        );
        Page { body: head, is_open: false }
    }

    /// Begins a section.
    pub fn section(&mut self, id: &str, title: &str) {
        self.close();
        let _ = writeln!(self.body, "<section id=\"{id}\">\n<h2>{}</h2>", coded(title));
        self.is_open = true;
    }

    fn close(&mut self) {
        if std::mem::take(&mut self.is_open) {
            self.body += "</section>\n";
        }
    }

    /// A paragraph of words.
    pub fn paragraph(&mut self, words: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", coded(words));
    }

    /// A list of words; nothing where there are none.
    pub fn list(&mut self, items: &[String]) {
        if items.is_empty() {
            return;
        }
        self.body += "<ul>\n";
        for item in items {
            let _ = writeln!(self.body, "<li>{}</li>", coded(item));
        }
        self.body += "</ul>\n";
    }

    /// A list of words, each with more that a reader may unfold and what that is called; nothing where there are none.
    pub fn folded_list(&mut self, items: &[Folded]) {
        if items.is_empty() {
            return;
        }
        self.body += "<ul>\n";
        for Folded { words, summary, more } in items {
            let (words, summary, more) = (coded(words), coded(summary), coded(more));
            let _ = writeln!(self.body, "<li>{words}<details><summary>{summary}</summary><p>{more}</p></details></li>");
        }
        self.body += "</ul>\n";
    }

    /// Figures with what they are, large.
    pub fn figures(&mut self, figures: &[(String, &str)]) {
        self.body += "<dl class=\"figures\">\n";
        for (figure, what) in figures {
            let _ = writeln!(self.body, "<div><dt>{}</dt><dd>{}</dd></div>", coded(what), coded(figure));
        }
        self.body += "</dl>\n";
    }

    /// A table; the first column is words, the others are numbers.
    pub fn table<'a>(&mut self, header: &[&str], rows: impl IntoIterator<Item = &'a [String]>) {
        self.table_of("wide", header, rows);
    }

    /// A table of parameters before, as learned, and their standard deviations, which on a phone has a block per row.
    pub fn values_table<'a>(&mut self, header: &[&str; 4], rows: impl IntoIterator<Item = &'a [String]>) {
        self.table_of("wide values", header, rows);
    }

    fn table_of<'a>(&mut self, class: &str, header: &[&str], rows: impl IntoIterator<Item = &'a [String]>) {
        let _ = write!(self.body, "<div class=\"{class}\"><table>\n<thead><tr>");
        for cell in header {
            let _ = write!(self.body, "<th>{}</th>", coded(cell));
        }
        self.body += "</tr></thead>\n<tbody>\n";
        for row in rows {
            self.body += "<tr>";
            for cell in row {
                let _ = write!(self.body, "<td>{}</td>", coded(cell));
            }
            self.body += "</tr>\n";
        }
        self.body += "</tbody></table></div>\n";
    }

    /// A drawing with what it shows.
    pub fn drawing(&mut self, svg: &str, caption: &str) {
        let _ = writeln!(self.body, "<figure>{svg}<figcaption>{}</figcaption></figure>", coded(caption));
    }

    /// Drawings side by side where there is room.
    pub fn begin_row(&mut self) {
        self.body += "<div class=\"row\">\n";
    }

    pub fn end_row(&mut self) {
        self.body += "</div>\n";
    }

    /// A drawing that can be turned, of data that the script knows.
    pub fn view(&mut self, data: &str, caption: &str) {
        // Within a script, only this would end it.
        let data = data.replace("</", "<\\/");
        let _ = writeln!(
            self.body,
            "<figure><canvas id=\"view\" width=\"1080\" height=\"756\" tabindex=\"0\" role=\"img\" aria-label=\"{caption}\"></canvas>\
             <figcaption>{caption}</figcaption></figure>\n<script id=\"view-data\" type=\"application/json\">{data}</script>\n\
             <script>\n{SCRIPT}</script>",
            caption = escaped(caption)
        );
    }

    /// Something that moves: a control to play it, drawings, and the data that the script moves them by.
    pub fn player(&mut self, moments: usize, drawings: &[(String, String)], data: &str) {
        let data = data.replace("</", "<\\/");
        let _ = writeln!(
            self.body,
            "<div class=\"player\"><button id=\"play\" type=\"button\">play</button>\
             <input id=\"moment\" type=\"range\" min=\"0\" max=\"{}\" value=\"0\" aria-label=\"moment\">\
             <output id=\"now\"></output></div>",
            moments.saturating_sub(1)
        );
        self.begin_row();
        drawings.iter().for_each(|(svg, caption)| self.drawing(svg, caption));
        self.end_row();
        let _ = writeln!(
            self.body,
            "<script id=\"moments\" type=\"application/json\">{data}</script>\n<script>\n{PLAYER}</script>"
        );
    }

    pub fn finish(mut self) -> String {
        self.close();
        self.body + "</main>\n</body>\n</html>\n"
    }
}

/// Words of which more is folded away.
pub(super) struct Folded {
    /// What is always shown.
    pub words: String,
    /// What the rest is called.
    pub summary: String,
    /// The rest.
    pub more: String,
}

/// Words as HTML: what stands between two backticks is code.
fn coded(words: &str) -> String {
    let mut html = String::new();
    let mut rest = words;
    while let Some((before, from)) = rest.split_once('`')
        && let Some((code, after)) = from.split_once('`')
    {
        let _ = write!(html, "{}<code>{}</code>", escaped(before), escaped(code));
        rest = after;
    }
    html + &escaped(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_between_backticks_is_code_and_text_all_the_same() {
        assert_eq!(coded("camera `a<b` and `c`: d"), "camera <code>a&lt;b</code> and <code>c</code>: d");
        assert_eq!(coded("one ` alone, `two` and <"), "one <code> alone, </code>two` and &lt;");
        assert_eq!(coded("none"), "none");
    }
}
