//! Pages of one file, which a browser opens without anything else: text, tables, and pictures as data.

use std::path::Path;

use base64::{Engine, prelude::BASE64_STANDARD};
pub use maud::{Markup, PreEscaped, html};

use crate::{data::files, error::Result, text};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1c1c1c;\
overflow-wrap:anywhere}h1{font-size:1.6rem}h2{font-size:1.25rem;margin-top:2.2rem;border-bottom:1px solid #ccc}\
.lead{font-size:1.15rem;background:#eef3f8;padding:.8rem 1rem;border-left:4px solid #0072b2}\
.wide{overflow-x:auto}table{border-collapse:collapse;margin:.6rem 0}td,th{padding:.2rem .8rem .2rem 0;text-align:left;\
vertical-align:top;overflow-wrap:normal}th{font-weight:600;border-bottom:1px solid #999}img{max-width:100%;height:auto}\
.bad{color:#b00020;font-weight:600}code{background:#f3f3f3;padding:0 .2rem}.small{color:#555;font-size:.9rem}";

/// A whole page. Text from outside goes through [`shown`], and `html!` escapes it.
pub fn page(title: &str, content: &Markup) -> String {
    let page = html! {
        (maud::DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                // A page of one file has no picture for its tab, and no server is to be asked for one.
                link rel="icon" href="data:,";
                title { (shown(title)) }
                style { (PreEscaped(STYLE)) }
            }
            body { (content) }
        }
    };
    page.into_string() + "\n"
}

/// Text from outside, such as a path, without what a reader's screen would obey.
pub fn shown(text: &str) -> String {
    text::shown(text).into_owned()
}

/// Scrolls by itself where the window is too narrow.
pub fn table(heads: &[&str], rows: &[Vec<Markup>]) -> Markup {
    html! {
        div.wide { table {
            tr { @for head in heads { th { (head) } } }
            @for row in rows { tr { @for cell in row { td { (cell) } } } }
        } }
    }
}

/// A picture of a PNG file, inside the page.
///
/// # Errors
/// A file that cannot be read.
pub fn picture(file: &Path, says: &str) -> Result<Markup> {
    let address = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(files::read(file)?));
    Ok(html! { img alt=(shown(says)) src=(address); })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_outside_is_text() {
        let page = page("<b>\u{1b}[31m", &html! { p { (shown("a & b\u{202e}")) } (table(&["x"], &[vec![html! { "1 < 2" }]])) });
        assert!(page.contains("<title>&lt;b&gt;\\u{1b}[31m</title>"), "{page}");
        assert!(page.contains("<p>a &amp; b\\u{202e}</p>") && page.contains("<td>1 &lt; 2</td>"), "{page}");
    }

    #[test]
    fn a_picture_is_in_the_page() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.png");
        std::fs::write(&file, [0, 1, 2]).unwrap();
        let picture = picture(&file, "dots").unwrap().into_string();
        assert_eq!(picture, "<img alt=\"dots\" src=\"data:image/png;base64,AAEC\">");
        assert!(super::picture(&folder.path().join("none.png"), "none").is_err());
    }
}
