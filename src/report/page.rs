//! The page: its frame, its style, and the pieces that it is built from.
use crate::svg::escaped;
use std::fmt::Write;

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("view.js");
const PLAYER: &str = include_str!("player.js");

/// A page that is being written.
pub(super) struct Page {
    body: String,
    is_open: bool,
}

impl Page {
    pub fn new(title: &str) -> Self {
        let title = escaped(title);
        let head = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n\
             <body>\n<main>\n<h1>{title}</h1>\n"
        );
        Page { body: head, is_open: false }
    }

    /// Begins a section.
    pub fn section(&mut self, id: &str, title: &str) {
        self.close();
        let _ = writeln!(self.body, "<section id=\"{id}\">\n<h2>{}</h2>", escaped(title));
        self.is_open = true;
    }

    fn close(&mut self) {
        if std::mem::take(&mut self.is_open) {
            self.body += "</section>\n";
        }
    }

    /// A paragraph of words.
    pub fn paragraph(&mut self, words: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(words));
    }

    /// A list of words; nothing where there are none.
    pub fn list(&mut self, items: &[String]) {
        if items.is_empty() {
            return;
        }
        self.body += "<ul>\n";
        for item in items {
            let _ = writeln!(self.body, "<li>{}</li>", escaped(item));
        }
        self.body += "</ul>\n";
    }

    /// Figures with what they are, large.
    pub fn figures(&mut self, figures: &[(String, &str)]) {
        self.body += "<dl class=\"figures\">\n";
        for (figure, what) in figures {
            let _ = writeln!(self.body, "<div><dt>{}</dt><dd>{}</dd></div>", escaped(what), escaped(figure));
        }
        self.body += "</dl>\n";
    }

    /// A table; the first column is words, the others are numbers.
    pub fn table<'a>(&mut self, header: &[&str], rows: impl IntoIterator<Item = &'a [String]>) {
        self.body += "<div class=\"wide\"><table>\n<thead><tr>";
        for cell in header {
            let _ = write!(self.body, "<th>{}</th>", escaped(cell));
        }
        self.body += "</tr></thead>\n<tbody>\n";
        for row in rows {
            self.body += "<tr>";
            for cell in row {
                let _ = write!(self.body, "<td>{}</td>", escaped(cell));
            }
            self.body += "</tr>\n";
        }
        self.body += "</tbody></table></div>\n";
    }

    /// A drawing with what it shows.
    pub fn drawing(&mut self, svg: &str, caption: &str) {
        let _ = writeln!(self.body, "<figure>{svg}<figcaption>{}</figcaption></figure>", escaped(caption));
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
