//! Pieces of a page that needs nothing from elsewhere.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

const STYLE: &str = "\
body{font:15px/1.45 system-ui,sans-serif;margin:0 auto;max-width:1080px;padding:1.5rem;color:#222}\
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}\
table{border-collapse:collapse;width:100%}th,td{padding:.25rem .6rem;text-align:right;border-bottom:1px solid #ddd}\
th:first-child,td:first-child{text-align:left}th{font-weight:600}\
.tiles{display:flex;flex-wrap:wrap;gap:.8rem}\
.tile{background:#f3f5f7;border-radius:8px;padding:.6rem 1rem;min-width:7rem}\
.tile b{display:block;font-size:1.4rem}\
.plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(300px,1fr));gap:1.2rem}figure{margin:0}\
figcaption{font-size:.9rem;margin-bottom:.2rem}svg{width:100%;height:auto}svg rect{fill:#4a7fb0}\
svg line{stroke:#c0392b;stroke-width:1.5}\
svg text{font-size:11px;fill:#444}.cases figure{margin:0 0 1.2rem}.cases img{max-width:100%;border-radius:6px}\
.wide{overflow-x:auto}";

/// The whole page.
pub(super) fn page(title: &str, body: &str) -> String {
    let title = escaped(title);
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
<title>{title}</title><style>{STYLE}</style></head>\n<body><h1>{title}</h1>\n{body}</body></html>\n"
    )
}

/// Text that may hold anything, as a file's name may.
pub(super) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c if c.is_control() => safe.push(' '),
            c => safe.push(c),
        }
    }
    safe
}

/// Numbers with what they are.
pub(super) fn tiles(tiles: &[(String, &str)]) -> String {
    let mut html = String::from("<div class=\"tiles\">");
    for (number, what) in tiles {
        let _ = write!(html, "<div class=\"tile\"><b>{number}</b>{what}</div>");
    }
    html + "</div>\n"
}

/// A table; cells are escaped here.
pub(super) fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let mut html = String::from("<div class=\"wide\"><table><tr>");
    for cell in header {
        let _ = write!(html, "<th>{}</th>", escaped(cell));
    }
    html += "</tr>\n";
    for row in rows {
        html += "<tr>";
        for cell in row {
            let _ = write!(html, "<td>{}</td>", escaped(cell));
        }
        html += "</tr>\n";
    }
    html + "</table></div>\n"
}

/// A picture with a line below it.
pub(super) fn picture(png: &[u8], caption: &str) -> String {
    let caption = escaped(caption);
    let data = STANDARD.encode(png);
    format!(
        "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">\
         <figcaption>{caption}</figcaption></figure>\n"
    )
}
