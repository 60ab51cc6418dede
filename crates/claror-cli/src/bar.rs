//! A line at the bottom of the terminal that is drawn again and again.
//!
//! The cursor waits in the first column, so that the `^C` which the terminal shows for Ctrl-C is
//! overwritten by the next drawing instead of breaking the line.

use std::io::{self, Write};

use terminal_size::{Width, terminal_size_of};

/// Cells of the bar itself.
const CELLS: usize = 24;
/// Columns of the label.
const LABEL: usize = 7;
/// Narrower terminals get the text alone.
const NARROWEST: usize = 60;

/// See the module.
pub(crate) struct Bar {
    colour: bool,
    unicode: bool,
    drawn: bool,
    /// Drawings so far: turns the spinner.
    turn: usize,
}

impl Bar {
    /// Nothing is drawn yet.
    pub(crate) fn new(colour: bool) -> Self {
        Self { colour, unicode: is_unicode_terminal(), drawn: false, turn: 0 }
    }

    /// Draws label, bar (or spinner, when the share is not known) and text.
    pub(crate) fn draw(&mut self, label: &str, fraction: Option<f64>, text: &str) {
        let width = terminal_size_of(io::stderr()).map_or(80, |(Width(width), _)| width.into());
        let line = self.line(label, fraction, text, width);
        self.turn += 1;
        self.drawn = true;
        // A terminal that is gone needs no bar.
        let mut out = io::stderr().lock();
        let _ = write!(out, "\r{line}\x1b[K\r").and_then(|()| out.flush());
    }

    /// Removes the line.
    pub(crate) fn clear(&mut self) {
        if std::mem::take(&mut self.drawn) {
            let mut out = io::stderr().lock();
            let _ = write!(out, "\r\x1b[K").and_then(|()| out.flush());
        }
    }

    /// The line in less than `width` columns: a full one would wrap.
    fn line(&self, label: &str, fraction: Option<f64>, text: &str, width: usize) -> String {
        let mut left = width.saturating_sub(1);
        let mut line = String::new();
        let bold = |text: String| self.painted("1", text);
        line += &bold(take(&format!("{label:<LABEL$}"), &mut left));
        match fraction {
            Some(fraction) if width >= NARROWEST => {
                line += &self.cells(fraction);
                left = left.saturating_sub(CELLS);
            }
            Some(_) => {}
            None => line += &take(self.spinner(), &mut left),
        }
        line += &take(&format!(" {text}"), &mut left);
        line
    }

    fn cells(&self, fraction: f64) -> String {
        let (full, head, empty) =
            if self.unicode { ("━", "╸", "─") } else { ("=", ">", "-") };
        // Half cells, because the head is half a cell long.
        let halves = (fraction.clamp(0.0, 1.0) * (2 * CELLS) as f64) as usize;
        let mut done = full.repeat(halves / 2);
        if halves % 2 == 1 {
            done += head;
        }
        let rest = empty.repeat(CELLS - halves.div_ceil(2));
        self.painted("36", done) + &self.painted("2", rest)
    }

    fn spinner(&self) -> &'static str {
        const BRAILLE: [&str; 10] = ["⠋", "⠙", "⠹", "⠸", "⠼", "⠴", "⠦", "⠧", "⠇", "⠏"];
        const ASCII: [&str; 4] = ["|", "/", "-", "\\"];
        // Two drawings per step: ten steps a second.
        let step = self.turn / 2;
        if self.unicode { BRAILLE[step % BRAILLE.len()] } else { ASCII[step % ASCII.len()] }
    }

    fn painted(&self, code: &str, text: String) -> String {
        if self.colour && !text.is_empty() { format!("\x1b[{code}m{text}\x1b[0m") } else { text }
    }
}

/// As much of the text as fits into `left` columns; all of our characters are one column wide.
fn take(text: &str, left: &mut usize) -> String {
    let taken: String = text.chars().take(*left).collect();
    *left -= taken.chars().count();
    taken
}

/// As the locale says.
fn is_unicode_terminal() -> bool {
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"]
        .iter()
        .find_map(|name| std::env::var(name).ok().filter(|value| !value.is_empty()));
    let locale = locale.unwrap_or_default().to_ascii_lowercase();
    locale.contains("utf-8") || locale.contains("utf8")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(unicode: bool) -> Bar {
        Bar { colour: false, unicode, drawn: false, turn: 0 }
    }

    #[test]
    fn the_bar_fills_by_half_cells() {
        let cells = |fraction| bar(true).cells(fraction);
        assert_eq!(cells(0.0), "─".repeat(24));
        assert_eq!(cells(0.5), "━".repeat(12) + &"─".repeat(12));
        assert_eq!(cells(0.53), "━".repeat(12) + "╸" + &"─".repeat(11));
        assert_eq!(cells(1.0), "━".repeat(24));
        assert_eq!(bar(false).cells(0.5), "=".repeat(12) + &"-".repeat(12));
    }

    #[test]
    fn a_line_never_fills_the_terminal() {
        let text = "42 %, 12 s, 17 s left, 3.21 Mrays/s, error 0.0123, 64/256 spp";
        for width in 0..120 {
            for fraction in [None, Some(0.3)] {
                let line = bar(true).line("render", fraction, text, width);
                assert!(line.chars().count() < width.max(1), "{width}: {line}");
            }
        }
        let wide = bar(true).line("render", Some(0.3), text, 120);
        assert!(wide.starts_with("render ━") && wide.ends_with(text), "{wide}");
    }

    #[test]
    fn colours_are_switched_off() {
        let plain = bar(true).line("load", Some(0.5), "1 s", 80);
        let colour = Bar { colour: true, ..bar(true) }.line("load", Some(0.5), "1 s", 80);
        assert!(!plain.contains('\x1b') && colour.contains("\x1b[36m"));
    }
}
