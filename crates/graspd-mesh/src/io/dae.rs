//! COLLADA (`.dae`): the geometry of its scene, as one mesh.

use std::path::Path;

use nalgebra::{Matrix4, Point3, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node};

use super::assemble::{Assembly, parse_error};
use super::quoted;
use graspd_geom::{GeometryError, TriangleMesh};

/// Scenes nested deeper than this are taken for rings of nodes that instantiate each other.
const DEEPEST: usize = 64;
/// Nodes visited before a scene counts as one that multiplies itself without end.
const MAX_NODES: usize = 100_000;

/// Reads triangles, polygons, strips and fans of every geometry that the scene shows, under the transforms of their
/// nodes, in metres and with z up, as the file's `unit` and `up_axis` say. A file without a scene gives its geometries
/// as they are. Materials, normals, skins and animations are ignored.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<TriangleMesh, GeometryError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| parse_error(path, None, "it is not text in UTF-8"))?;
    let document = Document::parse(text.trim_start_matches('\u{feff}')).map_err(|error| {
        let line = error.pos().row as usize;
        let words: Vec<_> = error
            .to_string()
            .split_whitespace()
            .map(str::to_owned)
            .collect();
        parse_error(
            path,
            Some(line),
            format!("it is not well-formed XML ({})", words.join(" ")),
        )
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(parse_error(path, None, "its root element is not <COLLADA>"));
    }
    let mut scene = Scene {
        root,
        path,
        assembly: Assembly::new(path, 0),
        vertices: 0,
        nodes: 0,
    };
    let world = metres_with_z_up(root).map_err(|fault| parse_error(path, None, fault))?;
    let shown = child(root, "scene").and_then(|s| child(s, "instance_visual_scene"));
    let shown = match shown {
        Some(instance) => Some(scene.target(instance, "url")?),
        None => descendants(root, "visual_scene").next(),
    };
    match shown {
        Some(shown) => {
            for node in children(shown, "node") {
                scene.push_node(node, &world, 0)?;
            }
        }
        None => {
            for geometry in descendants(root, "geometry") {
                scene.push_geometry(geometry, &world)?;
            }
        }
    }
    scene.assembly.finish()
}

/// From the file's unit and axes to metres with z up.
fn metres_with_z_up(root: Node<'_, '_>) -> Result<Matrix4<f64>, String> {
    let asset = child(root, "asset");
    let metre = asset
        .and_then(|asset| child(asset, "unit"))
        .and_then(|unit| unit.attribute("meter"));
    let metre: f64 = match metre {
        Some(text) => (text.trim().parse().ok())
            .filter(|scale: &f64| scale.is_finite() && *scale > 0.0)
            .ok_or_else(|| format!("its unit of {} metres is no length", quoted(text)))?,
        None => 1.0,
    };
    let up = asset.and_then(|asset| child(asset, "up_axis"));
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    // Where the file's x, y and z axes go.
    let columns = match up.and_then(|up| up.text()).map_or("Y_UP", str::trim) {
        "X_UP" => [z, -x, -y],
        "Y_UP" => [x, z, -y],
        "Z_UP" => [x, y, z],
        other => {
            return Err(format!(
                "its up_axis {} is not X_UP, Y_UP or Z_UP",
                quoted(other)
            ));
        }
    };
    let columns = columns.map(|column| (metre * column).push(0.0));
    Ok(Matrix4::from_columns(&[
        columns[0],
        columns[1],
        columns[2],
        Vector3::zeros().push(1.0),
    ]))
}

struct Scene<'a, 'input, 'p> {
    root: Node<'a, 'input>,
    path: &'p Path,
    assembly: Assembly<'p>,
    /// How many vertices have been pushed.
    vertices: usize,
    nodes: usize,
}

impl<'a, 'input> Scene<'a, 'input, '_> {
    fn fault(&self, at: Node<'_, '_>, fault: impl Into<String>) -> GeometryError {
        let line = at.document().text_pos_at(at.range().start).row as usize;
        parse_error(self.path, Some(line), fault)
    }

    /// The element that an attribute such as `url="#name"` refers to.
    fn target(
        &self,
        from: Node<'_, '_>,
        attribute: &str,
    ) -> Result<Node<'a, 'input>, GeometryError> {
        let reference = from.attribute(attribute).unwrap_or_default();
        let id = reference.strip_prefix('#');
        let found = id.and_then(|id| {
            self.root
                .descendants()
                .find(|n| n.attribute("id") == Some(id))
        });
        found.ok_or_else(|| {
            self.fault(
                from,
                format!("it refers to {}, which is not there", quoted(reference)),
            )
        })
    }

    fn push_node(
        &mut self,
        node: Node<'a, 'input>,
        outer: &Matrix4<f64>,
        depth: usize,
    ) -> Result<(), GeometryError> {
        self.nodes += 1;
        if depth > DEEPEST || self.nodes > MAX_NODES {
            return Err(self.fault(node, "its nodes contain themselves"));
        }
        let mut placement = *outer;
        for element in node.children().filter(Node::is_element) {
            // Transforms apply in the order of the file, the last one first.
            if let Some(transform) = self.transform(element)? {
                placement *= transform;
            }
        }
        for element in node.children().filter(Node::is_element) {
            match element.tag_name().name() {
                "node" => self.push_node(element, &placement, depth + 1)?,
                "instance_node" => {
                    let target = self.target(element, "url")?;
                    self.push_node(target, &placement, depth + 1)?;
                }
                "instance_geometry" => {
                    let geometry = self.target(element, "url")?;
                    self.push_geometry(geometry, &placement)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn transform(&self, element: Node<'_, '_>) -> Result<Option<Matrix4<f64>>, GeometryError> {
        let name = element.tag_name().name();
        let count = match name {
            "matrix" => 16,
            "rotate" => 4,
            "translate" | "scale" => 3,
            "lookat" | "skew" => {
                return Err(self.fault(element, format!("<{name}> transforms are not supported")));
            }
            _ => return Ok(None),
        };
        let v: Vec<f64> = self.numbers(element)?;
        if v.len() != count || v.iter().any(|value| !value.is_finite()) {
            return Err(self.fault(
                element,
                format!("a <{name}> must hold {count} finite numbers"),
            ));
        }
        Ok(Some(match name {
            "matrix" => Matrix4::from_row_slice(&v),
            "translate" => Matrix4::new_translation(&Vector3::new(v[0], v[1], v[2])),
            "scale" => Matrix4::new_nonuniform_scaling(&Vector3::new(v[0], v[1], v[2])),
            _ => Unit::try_new(Vector3::new(v[0], v[1], v[2]), 0.0)
                .map_or_else(Matrix4::identity, |axis| {
                    Rotation3::from_axis_angle(&axis, v[3].to_radians()).to_homogeneous()
                }),
        }))
    }

    fn push_geometry(
        &mut self,
        geometry: Node<'a, 'input>,
        placement: &Matrix4<f64>,
    ) -> Result<(), GeometryError> {
        let Some(mesh) = child(geometry, "mesh") else {
            return Ok(());
        };
        let Some(vertices) = child(mesh, "vertices") else {
            return Err(self.fault(mesh, "a mesh has no <vertices>"));
        };
        let position = children(vertices, "input")
            .find(|input| input.attribute("semantic") == Some("POSITION"));
        let Some(position) = position else {
            return Err(self.fault(vertices, "its <vertices> have no POSITION"));
        };
        let source = self.target(position, "source")?;
        let first = self.vertices as i64;
        let points = self.points(source)?;
        for p in &points {
            let placed = placement.transform_point(p);
            self.assembly.push_vertex(placed.coords.into(), None)?;
        }
        self.vertices += points.len();
        // A mirrored placement turns faces inside out.
        let is_mirrored = placement.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for primitive in mesh.children().filter(Node::is_element) {
            for mut polygon in self.polygons(primitive)? {
                if polygon
                    .iter()
                    .any(|&index| index < 0 || index >= points.len() as i64)
                {
                    return Err(self.fault(
                        primitive,
                        format!(
                            "a face refers to a vertex beyond the {} that there are",
                            points.len()
                        ),
                    ));
                }
                if is_mirrored {
                    polygon.reverse();
                }
                self.assembly
                    .push_polygon(polygon.into_iter().map(|index| first + index), None);
            }
        }
        Ok(())
    }

    /// The positions that a `<source>` holds.
    fn points(&self, source: Node<'_, '_>) -> Result<Vec<Point3<f64>>, GeometryError> {
        let Some(array) = child(source, "float_array") else {
            return Err(self.fault(source, "a POSITION source has no <float_array>"));
        };
        let accessor = descendants(source, "accessor").next();
        let whole = |name: &str, default: usize| {
            let text = accessor.and_then(|accessor| accessor.attribute(name));
            text.and_then(|text| text.trim().parse().ok())
                .unwrap_or(default)
        };
        let (stride, offset) = (whole("stride", 3).max(3), whole("offset", 0));
        let values: Vec<f64> = self.numbers(array)?;
        let whole_points = values
            .get(offset..)
            .unwrap_or_default()
            .chunks(stride)
            .filter(|c| c.len() >= 3);
        Ok(whole_points
            .map(|c| Point3::new(c[0], c[1], c[2]))
            .take(whole("count", usize::MAX))
            .collect())
    }

    /// The polygons of a primitive element, by vertex numbers of its own mesh.
    fn polygons(&self, primitive: Node<'_, '_>) -> Result<Vec<Vec<i64>>, GeometryError> {
        let kind = primitive.tag_name().name();
        if !["triangles", "polylist", "polygons", "tristrips", "trifans"].contains(&kind) {
            return Ok(Vec::new());
        }
        let offset_of = |input: Node<'_, '_>| -> usize {
            input
                .attribute("offset")
                .and_then(|text| text.trim().parse().ok())
                .unwrap_or(0)
        };
        let stride = children(primitive, "input")
            .map(offset_of)
            .max()
            .map_or(1, |largest| largest.saturating_add(1));
        let vertex = children(primitive, "input")
            .find(|input| input.attribute("semantic") == Some("VERTEX"));
        let Some(offset) = vertex.map(offset_of) else {
            return Err(self.fault(primitive, format!("<{kind}> has no VERTEX input")));
        };
        let mut lists = Vec::new();
        for list in descendants(primitive, "p") {
            let numbers: Vec<i64> = self.numbers(list)?;
            lists.push(
                numbers
                    .chunks(stride)
                    .filter_map(|c| c.get(offset).copied())
                    .collect::<Vec<_>>(),
            );
        }
        let mut polygons = Vec::new();
        for corners in lists {
            match kind {
                "triangles" => polygons.extend(corners.chunks_exact(3).map(<[i64]>::to_vec)),
                "polygons" => polygons.push(corners),
                "tristrips" => polygons.extend(corners.windows(3).enumerate().map(|(i, c)| {
                    // Every other triangle of a strip runs backwards.
                    if i % 2 == 0 {
                        c.to_vec()
                    } else {
                        vec![c[1], c[0], c[2]]
                    }
                })),
                "trifans" => polygons.extend(
                    corners
                        .windows(2)
                        .skip(1)
                        .map(|c| vec![corners[0], c[0], c[1]]),
                ),
                _ => {
                    let counts =
                        child(primitive, "vcount").map(|counts| self.numbers::<usize>(counts));
                    let mut rest = corners.as_slice();
                    for count in counts.transpose()?.unwrap_or_default() {
                        let Some((polygon, others)) = rest.split_at_checked(count) else {
                            return Err(self.fault(
                                primitive,
                                "its <vcount> promises more corners than <p> holds",
                            ));
                        };
                        polygons.push(polygon.to_vec());
                        rest = others;
                    }
                }
            }
        }
        Ok(polygons)
    }

    fn numbers<N: std::str::FromStr>(
        &self,
        element: Node<'_, '_>,
    ) -> Result<Vec<N>, GeometryError> {
        let texts = element.children().filter_map(|inside| inside.text());
        let tokens = texts.flat_map(str::split_whitespace);
        tokens
            .map(|token| {
                token.parse().map_err(|_| {
                    self.fault(
                        element,
                        format!(
                            "{} in <{}> is not a number",
                            quoted(token),
                            element.tag_name().name()
                        ),
                    )
                })
            })
            .collect()
    }
}

fn children<'a, 'input>(
    of: Node<'a, 'input>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    of.children().filter(move |n| n.tag_name().name() == name)
}

fn child<'a, 'input>(of: Node<'a, 'input>, name: &'static str) -> Option<Node<'a, 'input>> {
    children(of, name).next()
}

fn descendants<'a, 'input>(
    of: Node<'a, 'input>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    of.descendants()
        .filter(move |n| n.tag_name().name() == name)
}
