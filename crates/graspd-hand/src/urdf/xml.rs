//! What is done to a URDF's text before it is parsed: leaving out what a hand does not need, and the faults in it.

use crate::HandError;

/// Elements deeper than this are no URDF; unbounded nesting would overflow the parser's stack.
const MAX_DEPTH: usize = 64;

/// Elements without influence on kinematics and shape. Many files leave out attributes of theirs that the URDF
/// specification, and so the parser, requires.
const LEFT_OUT: [&str; 8] = [
    "inertial",
    "material",
    "dynamics",
    "calibration",
    "safety_controller",
    "transmission",
    "gazebo",
    "sensor",
];

/// The text without comments, processing instructions and the elements of [`LEFT_OUT`], and with the attributes
/// `velocity` and `effort` that every `<limit>` must have.
///
/// # Errors
/// [`HandError::NotUrdf`] for text that is not well-formed or has no `<robot>`, [`HandError::Xacro`] for macros.
pub(crate) fn prepared(text: &str, file: &std::path::Path) -> Result<String, HandError> {
    let mut prepared = String::with_capacity(text.len());
    let mut open: Vec<&str> = Vec::new();
    let mut left_out_depth = None;
    let mut rest = text.trim_start_matches('\u{feff}');
    let mut has_robot = false;
    while let Some(start) = rest.find('<') {
        let (before, tag) = rest.split_at(start);
        if left_out_depth.is_none() {
            prepared.push_str(before);
        }
        if let Some(skipped) = past_markup(tag)? {
            rest = skipped;
            continue;
        }
        let end = tag_end(tag)?;
        let (tag, after) = tag.split_at(end);
        rest = after;
        let name = element_name(tag);
        if name.contains("xacro:") {
            return Err(HandError::Xacro { file: file.into() });
        }
        has_robot |= name == "robot" && open.is_empty();
        if tag.starts_with("</") {
            let expected = open.pop();
            if expected != Some(name) {
                return Err(broken(match expected {
                    Some(expected) => format!(
                        "</{}> where </{}> is due",
                        shortened(name),
                        shortened(expected)
                    ),
                    None => format!("</{}> closes nothing", shortened(name)),
                }));
            }
            if left_out_depth.is_some() {
                if left_out_depth == Some(open.len()) {
                    left_out_depth = None;
                }
                continue;
            }
            prepared.push_str(tag);
            continue;
        }
        let is_empty = tag.ends_with("/>");
        if left_out_depth.is_none() && LEFT_OUT.contains(&name) {
            if !is_empty {
                left_out_depth = Some(open.len());
            }
        } else if left_out_depth.is_none() {
            push_tag(&mut prepared, tag, name);
        }
        if !is_empty {
            open.push(name);
        }
        if open.len() > MAX_DEPTH {
            return Err(broken(format!(
                "elements are nested more than {MAX_DEPTH} deep"
            )));
        }
    }
    if let Some(unclosed) = open.last() {
        return Err(broken(format!(
            "<{}> is never closed: the file seems cut off",
            shortened(unclosed)
        )));
    }
    if !has_robot {
        return Err(broken("it has no <robot> element".into()));
    }
    Ok(prepared)
}

fn push_tag(prepared: &mut String, tag: &str, name: &str) {
    if name != "limit" {
        prepared.push_str(tag);
        return;
    }
    let content_end = tag.len() - if tag.ends_with("/>") { 2 } else { 1 };
    let (content, close) = tag.split_at(content_end);
    prepared.push_str(content);
    for attribute in ["velocity", "effort"] {
        let is_there = content
            .split(|c: char| c.is_whitespace() || c == '"' || c == '\'')
            .any(|word| word.trim_end_matches('=').trim_end() == attribute && !word.is_empty());
        if !is_there {
            prepared.push_str(&format!(" {attribute}=\"0\""));
        }
    }
    prepared.push_str(close);
}

/// What follows a comment, declaration or processing instruction that `text` starts with; `None` for a tag.
fn past_markup(text: &str) -> Result<Option<&str>, HandError> {
    for (start, end) in [("<!--", "-->"), ("<?", "?>")] {
        if let Some(inside) = text.strip_prefix(start) {
            let length = inside
                .find(end)
                .ok_or_else(|| broken(format!("a {start} without {end}")))?;
            return Ok(Some(&inside[length + end.len()..]));
        }
    }
    if text.starts_with("<!") {
        // Character data and document types have no place in a URDF; entities could grow without bound.
        return Err(broken("it has a <! declaration".into()));
    }
    Ok(None)
}

/// Length of the tag that `text` starts with, minding `>` within quotes.
fn tag_end(text: &str) -> Result<usize, HandError> {
    let mut quote = None;
    for (index, byte) in text.bytes().enumerate().skip(1) {
        match (quote, byte) {
            (None, b'"' | b'\'') => quote = Some(byte),
            (None, b'>') => return Ok(index + 1),
            (None, b'<') => break,
            (Some(open), byte) if open == byte => quote = None,
            _ => {}
        }
    }
    Err(broken(
        "a tag is never closed: the file seems cut off".into(),
    ))
}

fn element_name(tag: &str) -> &str {
    let inside = tag.trim_start_matches(['<', '/']);
    let end = inside.find(|c: char| c.is_whitespace() || c == '/' || c == '>');
    &inside[..end.unwrap_or(inside.len())]
}

fn broken(fault: String) -> HandError {
    HandError::NotUrdf(fault)
}

/// A name of bounded length for a message.
fn shortened(name: &str) -> String {
    name.chars().filter(|c| !c.is_control()).take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prepare(text: &str) -> Result<String, HandError> {
        prepared(text, std::path::Path::new("hand.urdf"))
    }

    #[test]
    fn what_a_hand_does_not_need_is_left_out() {
        let text = r#"<?xml version="1.0"?><!-- a > b --><robot name="r"><link name="a"><inertial><mass/></inertial>
            <visual><material/></visual></link><gazebo><a><b/></a></gazebo></robot>"#;
        let prepared = prepare(text).unwrap();
        assert!(prepared.contains(r#"<link name="a">"#) && prepared.contains("<visual></visual>"));
        for gone in ["mass", "material", "gazebo", "<b", "--", "?"] {
            assert!(!prepared.contains(gone), "{gone} in {prepared}");
        }
    }

    #[test]
    fn limits_get_what_they_lack() {
        let prepared = |limit: &str| prepare(&format!("<robot>{limit}</robot>")).unwrap();
        assert!(prepared(r#"<limit lower="0"/>"#).contains(r#"velocity="0" effort="0"/>"#));
        assert!(
            prepared(r#"<limit lower="0"></limit>"#)
                .contains(r#"velocity="0" effort="0"></limit>"#)
        );
        let whole = r#"<limit effort="1" velocity = '3'/>"#;
        assert!(prepared(whole).contains(whole));
    }

    #[test]
    fn faults_are_errors() {
        for text in [
            "",
            "plain text",
            "<robot>",
            "<robot><a></robot></a>",
            "</robot>",
            "<robot name=\"a>",
            "<robot><!-- </robot>",
            "<!DOCTYPE a [<!ENTITY b \"c\">]><robot/>",
            "<html></html>",
            "<robot><",
        ] {
            assert!(
                matches!(prepare(text), Err(HandError::NotUrdf(_))),
                "{text}"
            );
        }
        let deep = format!("<robot>{}", "<a>".repeat(100_000));
        assert!(matches!(prepare(&deep), Err(HandError::NotUrdf(_))));
        let macros = r#"<robot><xacro:include filename="a"/></robot>"#;
        assert!(matches!(prepare(macros), Err(HandError::Xacro { .. })));
    }
}
