//! Text from outside (paths, labels, messages of other programs), made harmless where people read it.

use std::borrow::Cow;

/// The text with everything written out that a terminal would obey or that shows letters in another order than they stand:
/// control characters but line feed and tab, and Unicode's marks of direction (Unicode Standard Annex 9, explicit
/// formatting). Everything that is printed passes through here, and so do reports.
///
/// ```
/// assert_eq!(hybridsim::text::shown("a\u{1b}[31m"), "a\\u{1b}[31m");
/// assert_eq!(hybridsim::text::shown("±1 dB\n"), "±1 dB\n");
/// ```
pub fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return text.into();
    }
    let mut safe = String::with_capacity(text.len() + 8);
    for letter in text.chars() {
        match is_obeyed(letter) {
            true => safe.extend(letter.escape_unicode()),
            false => safe.push(letter),
        }
    }
    safe.into()
}

fn is_obeyed(letter: char) -> bool {
    (letter.is_control() && letter != '\n' && letter != '\t')
        || matches!(letter, '\u{200e}' | '\u{200f}' | '\u{061c}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_written_out_and_all_else_stays() {
        assert_eq!(shown("\u{1b}]0;title\u{7}\r\u{9b}2J"), "\\u{1b}]0;title\\u{7}\\u{d}\\u{9b}2J");
        assert_eq!(shown("abc\u{202e}txt.exe"), "abc\\u{202e}txt.exe");
        let plain = "d′ 3.2, ± 1 dB\tGrüße, 日本語\n";
        assert!(matches!(shown(plain), Cow::Borrowed(text) if text == plain));
    }
}
