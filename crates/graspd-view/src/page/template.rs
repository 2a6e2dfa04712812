//! Text put into the places of a page that are meant for it.

/// Fills `template`: each `{{name}}` is replaced by the value of that name, in one pass that does not look at values.
///
/// # Panics
/// If the template names a place that has no value.
pub(super) fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let length: usize = values.iter().map(|(_, value)| value.len()).sum();
    let mut text = String::with_capacity(template.len() + length);
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").expect("a place has an end");
        let value = values.iter().find(|(known, _)| *known == name);
        let (_, value) = value.unwrap_or_else(|| panic!("no value for `{name}`"));
        text.push_str(before);
        text.push_str(value);
        rest = after;
    }
    text + rest
}

/// Escapes text as the content of an element.
pub(super) fn escape_html(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Escapes JSON as the content of a script element: what could end it, or begin a comment, stands as an escape of
/// JSON, which is possible as these characters occur in strings only.
pub(super) fn escape_json(json: &str) -> String {
    json.replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_not_looked_at() {
        let text = fill("a {{b}} c {{d}}{{b}}", &[("b", "{{d}}"), ("d", "}}$1\\")]);
        assert_eq!(text, "a {{d}} c }}$1\\{{d}}");
    }

    #[test]
    fn nothing_ends_the_element_that_it_is_in() {
        let hostile = "</script><!-- <script> & \u{2028}";
        let json = escape_json(&serde_json::to_string(hostile).unwrap());
        assert!(!json.contains(['<', '>', '&', '\u{2028}']), "{json}");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), hostile);
        assert_eq!(escape_html("<b>&amp;"), "&lt;b&gt;&amp;amp;");
    }
}
