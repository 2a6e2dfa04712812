//! A URDF's elements as serde data, which the types of urdf-rs are read from.
//!
//! `urdf_rs::read_from_string` asks for what many published files leave out: the velocity of a `<limit>`, the mass of
//! an `<inertial>`, the name of a `<material>`. Here its types read the document itself; what a hand does not need is
//! not shown to them.

use std::borrow::Cow;
use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion};
use roxmltree::{Document, Error as XmlError, Node};
use serde::de::value::{Error, MapAccessDeserializer, MapDeserializer, SeqDeserializer};
use serde::de::{Deserialize, Deserializer, Error as _, IntoDeserializer, Visitor};
use urdf_rs::Robot;

use crate::HandError;

/// Optional elements without influence on kinematics and shape.
const NOT_READ: [&str; 5] = [
    "inertial",
    "material",
    "dynamics",
    "calibration",
    "safety_controller",
];

/// Reads the robot that the text of a URDF file describes.
///
/// # Errors
/// [`HandError::NotUrdf`] for text that is not well-formed, has no `<robot>` or lacks what a hand needs,
/// [`HandError::Xacro`] for macros.
pub(crate) fn read(text: &str, file: &Path) -> Result<Robot, HandError> {
    let xacro = || HandError::Xacro { file: file.into() };
    let document = Document::parse(text).map_err(|error| match error {
        XmlError::UnknownNamespace(prefix, _) if prefix == "xacro" => xacro(),
        XmlError::UnexpectedEndOfStream | XmlError::UnclosedRootNode => {
            HandError::NotUrdf("it ends within an element: the file seems cut off".into())
        }
        error => HandError::NotUrdf(one_line(&error.to_string())),
    })?;
    let is_macro = |node: Node<'_, '_>| {
        node.tag_name()
            .namespace()
            .is_some_and(|uri| uri.ends_with("xacro"))
    };
    if document.descendants().any(is_macro) {
        return Err(xacro());
    }
    let root = document.root_element();
    if !root.has_tag_name("robot") {
        return Err(HandError::NotUrdf("it has no <robot> element".into()));
    }
    Robot::deserialize(Value::Elements(vec![root]))
        .map_err(|error| HandError::NotUrdf(one_line(&error.to_string())))
}

/// Returns a parser's message without line breaks, and not too long.
fn one_line(message: &str) -> String {
    let words: Vec<&str> = message.split_whitespace().collect();
    words.join(" ").chars().take(200).collect()
}

/// An attribute, or the elements of one name within another.
enum Value<'a> {
    Text(Cow<'a, str>),
    Elements(Vec<Node<'a, 'a>>),
}

/// Lists an element's attributes and the elements within it, by name.
fn fields<'a>(element: Node<'a, 'a>) -> Vec<(&'a str, Value<'a>)> {
    let mut fields: Vec<(&str, Value<'_>)> = (element.attributes())
        .map(|attribute| (attribute.name(), Value::Text(attribute.value().into())))
        .collect();
    let has = |name: &str| element.has_attribute(name);
    let mut add =
        |name: &'static str, value: String| fields.push((name, Value::Text(value.into())));
    match element.tag_name().name() {
        "limit" => {
            if !has("velocity") {
                add("velocity", "0".into());
            }
            // From URDF 1.2 on, what is left out is unlimited; before, it is 0.
            let is_open = version(element) >= (1, 2);
            for (name, value) in [("lower", "-inf"), ("upper", "inf")] {
                if is_open && !has(name) {
                    add(name, value.into());
                }
            }
        }
        "origin" if version(element) >= (1, 1) && !has("rpy") => {
            if let Some(rpy) = element.attribute("quat_xyzw").and_then(rpy_of) {
                add("rpy", rpy);
            }
        }
        _ => {}
    }
    for child in element.children().filter(Node::is_element) {
        let name = child.tag_name().name();
        if NOT_READ.contains(&name) {
            continue;
        }
        match fields.iter_mut().find(|field| field.0 == name) {
            Some((_, Value::Elements(elements))) => elements.push(child),
            Some(_) => {}
            None => fields.push((name, Value::Elements(vec![child]))),
        }
    }
    fields
}

/// Returns the version of URDF that the document is written in; 1.0 if it tells none.
fn version(element: Node<'_, '_>) -> (u32, u32) {
    let text = element.document().root_element().attribute("version");
    text.and_then(|text| {
        let (major, minor) = text.trim().split_once('.')?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    })
    .unwrap_or((1, 0))
}

/// Turns a quaternion x, y, z, w into roll, pitch and yaw \[rad\].
fn rpy_of(text: &str) -> Option<String> {
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let [x, y, z, w] = numbers.ok()?[..] else {
        return None;
    };
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.0)?;
    let (roll, pitch, yaw) = rotation.euler_angles();
    Some(format!("{roll} {pitch} {yaw}"))
}

/// Says in which element an error is.
fn within(element: Node<'_, '_>, error: &Error) -> Error {
    let name = element
        .attribute("name")
        .map_or_else(String::new, |name| format!(" `{name}`"));
    Error::custom(format!("<{}>{name}: {error}", element.tag_name().name()))
}

impl<'de> Deserializer<'de> for Value<'de> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self {
            Self::Text(text) => visitor.visit_str(&text),
            Self::Elements(elements) => match elements[..] {
                [element] => visitor
                    .visit_map(MapDeserializer::new(fields(element).into_iter()))
                    .map_err(|error| within(element, &error)),
                _ => Err(Error::custom(format!(
                    "there are {} <{}>, where one is expected",
                    elements.len(),
                    elements[0].tag_name().name()
                ))),
            },
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let elements = match self {
            Self::Text(_) => Vec::new(),
            Self::Elements(elements) => elements,
        };
        let one_by_one = elements
            .into_iter()
            .map(|element| Self::Elements(vec![element]));
        visitor.visit_seq(SeqDeserializer::new(one_by_one))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_some(self)
    }

    /// Returns a word, or the first element within, such as the shape in a `<geometry>`.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        let elements = match self {
            Self::Text(text) => return visitor.visit_enum(text.as_ref().into_deserializer()),
            Self::Elements(elements) => elements,
        };
        let inner = elements[0].children().filter(Node::is_element).take(1);
        let inner = inner.map(|child| (child.tag_name().name(), Self::Elements(vec![child])));
        MapAccessDeserializer::new(MapDeserializer::new(inner))
            .deserialize_enum(name, variants, visitor)
    }

    /// Unknown elements are not even looked into: they may be nested without bound.
    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_unit()
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct
        newtype_struct tuple tuple_struct map struct identifier
    }
}

impl<'de> IntoDeserializer<'de, Error> for Value<'de> {
    type Deserializer = Self;
    fn into_deserializer(self) -> Self {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Robot, HandError> {
        read(text, Path::new("hand.urdf"))
    }

    #[test]
    fn what_a_hand_does_not_need_may_be_incomplete() {
        let text = r#"<?xml version="1.0"?><!-- a > b --><robot name="r"><link name="a"><inertial><mass/></inertial>
            <visual><geometry><sphere radius="1"/></geometry><material/></visual></link><gazebo><a><b/></a></gazebo>
            <joint name="j" type="revolute"><dynamics damping="?"/><parent link="a"/><child link="b"/>
            <safety_controller/><limit lower="-1"/></joint><link name="b"/></robot>"#;
        let robot = read_text(text).unwrap();
        let limit = &robot.joints[0].limit;
        assert_eq!([limit.lower, limit.upper, limit.velocity], [-1.0, 0.0, 0.0]);
        assert_eq!([robot.links.len(), robot.links[0].visual.len()], [2, 1]);
    }

    #[test]
    fn versions_are_read_as_urdf_rs_does() {
        let text = |version: &str, limit: &str| {
            format!(
                r#"<robot name="r" version="{version}"><link name="a"/><link name="b"/>
                <joint name="j" type="revolute"><origin xyz="1 2 3" quat_xyzw="0.1 0.2 0.3 0.9"/>
                <parent link="a"/><child link="b"/><limit {limit}/></joint></robot>"#
            )
        };
        for version in ["1.0", "1.1", "1.2"] {
            let text = text(version, r#"velocity="1" lower="-2""#);
            let (ours, theirs) = (
                read_text(&text).unwrap(),
                urdf_rs::read_from_string(&text).unwrap(),
            );
            let (ours, theirs) = (&ours.joints[0], &theirs.joints[0]);
            assert_eq!(
                [ours.limit.lower, ours.limit.upper],
                [theirs.limit.lower, theirs.limit.upper]
            );
            for (a, b) in ours.origin.rpy.iter().zip(theirs.origin.rpy.iter()) {
                assert!((a - b).abs() < 1e-12, "{version}: {a} {b}");
            }
        }
    }

    #[test]
    fn errors_tell_the_element() {
        let text = r#"<robot name="r"><link name="a"><visual><geometry><ball/></geometry></visual></link></robot>"#;
        let message = read_text(text).unwrap_err().to_string();
        for word in ["<link> `a`", "<visual>", "ball"] {
            assert!(message.contains(word), "{message}");
        }
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
                matches!(read_text(text), Err(HandError::NotUrdf(_))),
                "{text}"
            );
        }
        let deep = format!("<robot>{}", "<a>".repeat(100_000));
        assert!(matches!(read_text(&deep), Err(HandError::NotUrdf(_))));
        let closed = format!(
            "<robot>{}{}</robot>",
            "<a>".repeat(100_000),
            "</a>".repeat(100_000)
        );
        assert!(read_text(&closed).is_ok_and(|robot| robot.links.is_empty()));
        for macros in [
            r#"<robot><xacro:include filename="a"/></robot>"#,
            r#"<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="a"/></robot>"#,
        ] {
            assert!(matches!(read_text(macros), Err(HandError::Xacro { .. })));
        }
    }
}
