//! Where in a line a problem stands.
use crate::Error;
use serde_json::error::Category;

/// What is wrong with a line, and where: at the first byte of the value that is at fault.
///
/// `is_cut_off`: this is the last line of the file, and has no line break.
pub(super) fn malformed(file: &str, line: usize, text: &[u8], error: &serde_json::Error, is_cut_off: bool) -> Error {
    // Bytes that were read when the problem was met.
    let read = error.column().min(text.len());
    let message = error.to_string();
    let message = message.rfind(" at line ").map_or(message.as_str(), |end| &message[..end]);
    // A word that is no literal is told at its first letter.
    let at_syntax = match message {
        "expected ident" => start_of_value(text, read, message),
        _ => read.saturating_sub(1),
    };
    let (offset, problem) = match error.classify() {
        Category::Eof if is_cut_off => (text.len(), "the last line is cut off".to_owned()),
        Category::Eof => (text.len(), format!("the line ends in the middle of a sample ({message})")),
        Category::Data => (start_of_value(text, read, message), message.to_owned()),
        _ if message == "number out of range" => {
            (start_of_value(text, read, message), "the number is too large".to_owned())
        }
        _ if is_not_a_number(&text[at_syntax..]) => {
            (at_syntax, "expected a finite number (what was not measured is left out)".to_owned())
        }
        _ => (at_syntax, format!("this is not JSON: {message}")),
    };
    let column = 1 + String::from_utf8_lossy(&text[..offset]).chars().count();
    Error::Malformed { file: file.to_owned(), line, column, problem }
}

/// The literals that other programs write for what is no number.
fn is_not_a_number(text: &[u8]) -> bool {
    [&b"NaN"[..], b"nan", b"Infinity", b"-Infinity", b"inf"].iter().any(|literal| text.starts_with(literal))
}

/// The beginning of the value or key that ends where reading stopped.
fn start_of_value(text: &[u8], read: usize, message: &str) -> usize {
    // An array or object in the place of something else is not read at all.
    if message.starts_with("invalid type: sequence") || message.starts_with("invalid type: map") {
        let blank = text[read..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        return read + blank;
    }
    let (mut open, mut last, mut at) = (Vec::new(), 0, 0);
    while at < read {
        let start = at;
        match text[at] {
            b'"' => {
                at += 1;
                while at < read && text[at] != b'"' {
                    at += if text[at] == b'\\' { 2 } else { 1 };
                }
                at += 1;
                last = start;
            }
            b'[' | b'{' => {
                open.push(at);
                at += 1;
            }
            b']' | b'}' => {
                last = open.pop().unwrap_or(start);
                at += 1;
            }
            byte if byte == b',' || byte == b':' || byte.is_ascii_whitespace() => at += 1,
            _ => {
                while at < read && !b",:]} \t\r\n".contains(&text[at]) {
                    at += 1;
                }
                last = start;
            }
        }
    }
    last
}
