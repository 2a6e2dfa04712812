//! The paths that a Rust file names, read from its text.

/// A path such as `crate::mesh::Mesh`.
#[derive(Debug, PartialEq)]
pub(crate) struct NamedPath {
    pub(crate) parts: Vec<String>,
    /// Whether it stands in a `use`, which gives its last part to the module.
    pub(crate) is_use: bool,
    /// Whether that `use` hands it on to other modules.
    pub(crate) is_public: bool,
}

/// Returns a file's text without comments and without the test module at its end, and the names of test modules in
/// files of their own.
pub(crate) fn without_tests(text: &str) -> (String, Vec<String>) {
    let code: Vec<&str> = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect();
    let mut kept = String::new();
    let mut test_modules = Vec::new();
    let mut lines = code.iter();
    while let Some(line) = lines.next() {
        if line.trim() != "#[cfg(test)]" {
            kept += line;
            kept.push('\n');
            continue;
        }
        // What follows is for tests: an item of one line, or the module at the end of the file.
        let item = lines
            .by_ref()
            .find(|line| !line.trim_start().starts_with('#'))
            .copied()
            .unwrap_or_default();
        if let Some((_, name)) = item.split_once("mod ") {
            match name.trim().strip_suffix(';') {
                Some(name) => test_modules.push(name.to_owned()),
                None => break,
            }
        }
    }
    (kept, test_modules)
}

/// Returns all paths of two or more parts, and all that are used, groups taken apart.
pub(crate) fn paths(code: &str) -> Vec<NamedPath> {
    let words = words(code);
    let mut found = Vec::new();
    let mut at = 0;
    while at < words.len() {
        if words[at] == "use" {
            // `pub use`, `pub(crate) use`
            let is_public = at > 0 && matches!(words[at - 1], "pub" | ")");
            let end = (at..words.len())
                .find(|i| words[*i] == ";")
                .unwrap_or(words.len());
            let mut leaves = Vec::new();
            expand(&words[at + 1..end], &mut 0, &[], &mut leaves);
            found.extend(leaves.into_iter().map(|parts| NamedPath {
                parts,
                is_use: true,
                is_public,
            }));
            at = end;
        } else if is_name(words[at]) && words.get(at + 1) == Some(&"::") {
            let mut parts = vec![words[at].to_owned()];
            while words.get(at + 1) == Some(&"::")
                && words.get(at + 2).is_some_and(|word| is_name(word))
            {
                parts.push(words[at + 2].to_owned());
                at += 2;
            }
            found.push(NamedPath {
                parts,
                is_use: false,
                is_public: false,
            });
        }
        at += 1;
    }
    found
}

/// Adds the paths of one `use` tree; stops before the comma or brace that ends it.
fn expand(words: &[&str], at: &mut usize, prefix: &[String], leaves: &mut Vec<Vec<String>>) {
    let mut path = prefix.to_vec();
    while let Some(word) = words.get(*at) {
        match *word {
            "," | "}" => break,
            "{" => {
                *at += 1;
                while let Some(word) = words.get(*at) {
                    match *word {
                        "}" => break,
                        "," => *at += 1,
                        _ => expand(words, at, &path, leaves),
                    }
                }
                *at += 1;
                return;
            }
            // The new name is not needed: what it stands for is.
            "as" => *at += 1,
            "::" | "*" => {}
            "self" if !path.is_empty() => {}
            name => path.push(name.to_owned()),
        }
        *at += 1;
    }
    leaves.push(path);
}

pub(crate) fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Splits code into names, `::` and single signs.
pub(crate) fn words(code: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = if first.is_alphanumeric() || first == '_' {
            rest.find(|c: char| !c.is_alphanumeric() && c != '_')
                .unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        words.push(&rest[..length]);
        rest = rest[length..].trim_start();
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_taken_apart() {
        let code = "pub(crate) use a::{B, c::{self, D as E}};\nuse super::*;\nfn f() { crate::g::h::<u8>(1) }\n";
        let found: Vec<(String, bool)> = paths(code)
            .into_iter()
            .map(|path| (path.parts.join("::"), path.is_public))
            .collect();
        let expected = [
            ("a::B", true),
            ("a::c", true),
            ("a::c::D", true),
            ("super", false),
            ("crate::g::h", false),
        ];
        assert_eq!(
            found,
            expected.map(|(path, is_public)| (path.to_owned(), is_public))
        );
    }

    #[test]
    fn test_modules_are_left_out_or_named() {
        let (code, modules) = without_tests(
            "a\n#[cfg(test)]\nmod x_tests;\nb // c\n#[cfg(test)]\nmod tests {\nd\n}\n",
        );
        assert_eq!(
            (code.as_str(), modules),
            ("a\nb \n", vec!["x_tests".to_owned()])
        );
    }
}
