//! Drawings as SVG text.
use std::fmt::Write;

/// A drawing that is being made.
pub(crate) struct Svg(String);

impl Svg {
    /// A white sheet [px].
    pub fn new(width: f64, height: f64) -> Self {
        Svg(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
             font-size=\"13\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
        ))
    }

    /// An element with its attributes, such as `circle cx="1"`.
    pub fn element(&mut self, element: std::fmt::Arguments<'_>) {
        let _ = writeln!(self.0, "<{element}/>");
    }

    /// Words at a place; `anchor` is SVG's `text-anchor`.
    pub fn text(&mut self, [x, y]: [f64; 2], anchor: &str, words: &str) {
        let _ = writeln!(self.0, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>", escaped(words));
    }

    /// Words that read upwards.
    pub fn upwards(&mut self, [x, y]: [f64; 2], words: &str) {
        let place = format!("transform=\"translate({x:.1} {y:.1}) rotate(-90)\"");
        let _ = writeln!(self.0, "<text {place} text-anchor=\"middle\">{}</text>", escaped(words));
    }

    /// A line through places.
    pub fn line(&mut self, places: impl IntoIterator<Item = [f64; 2]>, style: &str) {
        self.element(format_args!("polyline points=\"{}\" fill=\"none\" {style}", points(places)));
    }

    /// The whole text.
    pub fn finish(self) -> String {
        self.0 + "</svg>\n"
    }
}

/// Places as SVG's `points`.
pub(crate) fn points(places: impl IntoIterator<Item = [f64; 2]>) -> String {
    places.into_iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// Text that SVG and HTML take for text.
pub(crate) fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
