//! What pictures must show, checked by counting pixels.

use graspd_geom::TriangleMesh;
use graspd_hand::{HandPose, builtin_hand};
use graspd_view::{
    Background, Camera, Color, Dot, Image, Scene, Segment, Surface, ViewError, render,
    render_hand_pose,
};
use nalgebra::{Point3, Vector3};

const BLACK: Background = Background {
    top: Color::new(0, 0, 0),
    bottom: Color::new(0, 0, 0),
};

/// A sphere of `2 * rings^2`-odd faces about `center`.
fn sphere(center: Point3<f64>, radius: f64, rings: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let columns = 2 * rings;
    for ring in 0..=rings {
        let polar = f64::from(ring) / f64::from(rings) * std::f64::consts::PI;
        for column in 0..columns {
            let azimuth = f64::from(column) / f64::from(columns) * std::f64::consts::TAU;
            let direction = Vector3::new(
                polar.sin() * azimuth.cos(),
                polar.sin() * azimuth.sin(),
                polar.cos(),
            );
            mesh.vertices.push(center + direction * radius);
        }
    }
    for ring in 0..rings {
        for column in 0..columns {
            let next = (column + 1) % columns;
            let [a, b] = [ring * columns + column, ring * columns + next];
            let [c, d] = [a + columns, b + columns];
            mesh.faces.extend([[a, c, b], [b, c, d]]);
        }
    }
    mesh
}

/// A square of side 2 in the plane z = `height`.
fn square(height: f64) -> TriangleMesh {
    TriangleMesh {
        vertices: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| Point3::new(x, y, height))
            .to_vec(),
        faces: vec![[0, 1, 2], [0, 2, 3]],
    }
}

fn from_above(vertical_angle: f64) -> Camera {
    Camera {
        eye: Point3::new(0.0, 0.0, 10.0),
        target: Point3::origin(),
        up: Vector3::y(),
        vertical_angle,
    }
}

fn shown_pixels(image: &Image) -> usize {
    image.pixels().iter().filter(|p| **p != [0; 3]).count()
}

/// The picture's light where the surface is plainly visible tells coverage: count pixels that are more than half
/// covered, which is unbiased along a curved border.
fn area_of(scene: &Scene<'_>, camera: &Camera, size: usize) -> f64 {
    let image = render(scene, camera, size, size).unwrap();
    // Every covered pixel of these scenes is far brighter than half of black and surface.
    let darkest = 40;
    image.pixels().iter().filter(|p| p[1] > darkest).count() as f64
}

#[test]
fn a_sphere_covers_the_area_of_its_silhouette() {
    let ball = sphere(Point3::origin(), 1.0, 96);
    let mut scene = Scene {
        background: BLACK,
        ..Scene::default()
    };
    scene.surfaces.push(Surface::new(&ball, Color::WHITE));
    let size = 400;
    // Seen from a distance d, a sphere fills a cone of half angle asin(1/d).
    let vertical_angle = 17f64.to_radians();
    let perspective = area_of(&scene, &from_above(vertical_angle), size);
    let tangent = 1.0 / (10f64 * 10.0 - 1.0).sqrt();
    let radius = tangent / (0.5 * vertical_angle).tan() * 0.5 * size as f64;
    let exact = std::f64::consts::PI * radius * radius;
    assert!(
        (perspective / exact - 1.0).abs() < 0.01,
        "{perspective} {exact}"
    );
}

#[test]
fn the_nearer_surface_hides_the_farther_whatever_their_order() {
    let (near, far) = (square(0.5), square(-0.5));
    for angle in [Camera::VERTICAL_ANGLE, 0.5] {
        for is_near_first in [true, false] {
            let mut scene = Scene::default();
            scene
                .surfaces
                .push(Surface::new(&near, Color::new(200, 0, 0)));
            scene
                .surfaces
                .push(Surface::new(&far, Color::new(0, 200, 0)));
            if !is_near_first {
                scene.surfaces.reverse();
            }
            let image = render(&scene, &from_above(angle), 60, 60).unwrap();
            let [red, green, _] = image.pixel(30, 30);
            assert!(red > 100 && green < 60, "{angle} {red} {green}");
        }
    }
}

#[test]
fn the_picture_does_not_depend_on_the_number_of_threads() {
    let (ball, floor) = (sphere(Point3::new(0.0, 0.0, 0.6), 0.5, 40), square(0.0));
    let mut scene = Scene::default();
    scene.surfaces.push(Surface::new(&ball, Color::SAND));
    scene.surfaces.push(Surface::new(&floor, Color::SLATE));
    scene.push_axes(&nalgebra::Isometry3::identity(), 1.0);
    let camera = Camera::three_quarter(&scene, 1.5);
    let on_threads = |count| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build()
            .unwrap();
        pool.install(|| render(&scene, &camera, 150, 100).unwrap())
    };
    let one = on_threads(1);
    assert_eq!(one, on_threads(2));
    assert_eq!(one, on_threads(5));
}

#[test]
fn an_empty_scene_is_its_background() {
    let scene = Scene::default();
    let camera = Camera::three_quarter(&scene, 1.0);
    let image = render(&scene, &camera, 40, 40).unwrap();
    let Background { top, bottom } = scene.background;
    let close =
        |pixel: [u8; 3], color: Color| (0..3).all(|c| pixel[c].abs_diff(color.srgb[c]) <= 1);
    assert!(close(image.pixel(20, 0), top), "{:?}", image.pixel(20, 0));
    assert!(
        close(image.pixel(20, 39), bottom),
        "{:?}",
        image.pixel(20, 39)
    );
}

#[test]
fn faces_that_are_no_triangles_change_nothing() {
    let good = sphere(Point3::origin(), 1.0, 12);
    let mut bad = good.clone();
    let first = bad.vertices.len() as u32;
    bad.vertices.extend([
        Point3::new(f64::NAN, 0.0, 0.0),
        Point3::new(0.0, f64::INFINITY, 0.0),
        Point3::new(f64::NEG_INFINITY, f64::NAN, 0.0),
    ]);
    bad.faces.extend([
        [0, 1, first],
        [first, first + 1, first + 2],
        [0, 30, first + 1],
        [30, 30, 31],
        [30, 31, 30],
        [0, 1, 4_000_000_000],
    ]);
    let picture = |mesh| {
        let scene = Scene {
            surfaces: vec![Surface::new(mesh, Color::SAGE)],
            ..Scene::default()
        };
        render(&scene, &Camera::three_quarter(&scene, 1.0), 80, 80).unwrap()
    };
    assert_eq!(picture(&good), picture(&bad));
}

#[test]
fn enormous_and_tiny_scenes_are_drawn_and_alike() {
    let picture = |scale: f64, shift: f64| {
        let mesh = sphere(Point3::new(shift, 0.0, 0.0), scale, 24);
        let scene = Scene {
            surfaces: vec![Surface::new(&mesh, Color::SAND)],
            background: BLACK,
            ..Scene::default()
        };
        render(&scene, &Camera::three_quarter(&scene, 1.0), 60, 60).unwrap()
    };
    let expected = shown_pixels(&picture(1.0, 0.0)) as f64;
    assert!(expected > 60.0 * 60.0 * 0.5);
    for (scale, shift) in [(1e-2, 0.0), (1e6, 0.0), (0.1, 1e4), (1e30, 0.0)] {
        let shown = shown_pixels(&picture(scale, shift)) as f64;
        assert!(
            (shown / expected - 1.0).abs() < 0.02,
            "{scale} {shift}: {shown}"
        );
    }
    // Where squares of areas overflow nothing can be drawn, but no harm is done.
    picture(1e100, 0.0);
    picture(1e200, 0.0);
}

#[test]
fn a_plane_through_the_eye_is_cut_off_behind_it() {
    // A floor that passes below the eye and on behind it fills the lower half of the picture.
    let mut floor = square(0.0).scaled(1e4);
    floor.vertices.iter_mut().for_each(|p| p.z = -1.0);
    let scene = Scene {
        surfaces: vec![Surface::new(&floor, Color::WHITE)],
        background: BLACK,
        ..Scene::default()
    };
    let camera = Camera {
        eye: Point3::origin(),
        target: Point3::new(1.0, 0.0, 0.0),
        up: Vector3::z(),
        vertical_angle: Camera::VERTICAL_ANGLE,
    };
    let image = render(&scene, &camera, 50, 50).unwrap();
    for y in 0..50 {
        let is_floor = image.pixel(25, y) != [0; 3];
        assert_eq!(is_floor, y >= 25, "row {y}");
    }
}

#[test]
fn shadows_darken_what_is_under_an_object() {
    let floor = square(0.0);
    let ball = sphere(Point3::new(0.0, 0.0, 0.35), 0.3, 32);
    let camera = Camera::framing(
        floor.vertices.iter().copied(),
        Vector3::new(0.0, -0.3, 1.0),
        Vector3::z(),
        1.0,
    );
    let brightness = |surfaces: Vec<Surface<'_>>| -> u64 {
        let scene = Scene {
            surfaces,
            ..Scene::default()
        };
        let image = render(&scene, &camera, 80, 80).unwrap();
        // The corners of the floor, away from the ball: only its shadow reaches there.
        let rows = image.pixels().chunks(80).skip(46).take(20);
        rows.flat_map(|row| &row[42..66])
            .map(|p| u64::from(p[1]))
            .sum()
    };
    let floor = Surface::new(&floor, Color::GREY);
    let bare = brightness(vec![floor]);
    let shaded = brightness(vec![floor, Surface::new(&ball, Color::GREY)]);
    assert!(shaded < bare * 97 / 100, "{shaded} {bare}");
}

#[test]
fn dots_and_segments_show_fully_in_front_and_faintly_behind() {
    let wall = square(0.0);
    // Three units of height at the origin.
    let angle = 2.0 * 0.15_f64.atan();
    let marked = |height: f64| {
        let mut scene = Scene {
            surfaces: vec![Surface::new(&wall, Color::WHITE)],
            ..Scene::default()
        };
        let red = Color::new(230, 0, 0);
        scene.dots.push(Dot {
            position: Point3::new(0.5, 0.0, height),
            radius: 0.1,
            color: red,
        });
        scene.segments.push(Segment {
            from: Point3::new(-0.5, -0.5, height),
            to: Point3::new(-0.5, 0.5, height),
            width: 4.0,
            color: red,
        });
        let image = render(&scene, &from_above(angle), 90, 90).unwrap();
        [image.pixel(60, 45), image.pixel(30, 45)].map(|p| i32::from(p[0]) - i32::from(p[1]))
    };
    for (front, behind) in marked(0.3).into_iter().zip(marked(-0.3)) {
        assert!(front > 150, "{front}");
        assert!((10..120).contains(&behind), "{behind}");
    }
    // Marks that are nowhere are left out.
    let scene = Scene {
        dots: vec![Dot {
            position: Point3::new(f64::NAN, 0.0, 0.0),
            radius: f64::INFINITY,
            color: Color::SAND,
        }],
        segments: vec![Segment {
            from: Point3::origin(),
            to: Point3::new(0.0, f64::INFINITY, 0.0),
            width: f64::NAN,
            color: Color::SAND,
        }],
        ..Scene::default()
    };
    render(&scene, &from_above(Camera::VERTICAL_ANGLE), 10, 10).unwrap();
}

#[test]
fn framing_holds_every_point_and_fills_the_picture() {
    let mesh = sphere(Point3::new(3.0, -2.0, 1.0), 0.2, 24);
    {
        for (width, height) in [(120, 60), (60, 120), (90, 90)] {
            let scene = Scene {
                surfaces: vec![Surface::new(&mesh, Color::WHITE)],
                background: BLACK,
                ..Scene::default()
            };
            let direction = Vector3::new(0.3, -0.8, 0.4);
            let aspect = width as f64 / height as f64;
            let camera = Camera::framing(scene.points(), direction, Vector3::z(), aspect);
            let image = render(&scene, &camera, width, height).unwrap();
            let is_shown = |x, y| image.pixel(x, y) != [0; 3];
            assert!((0..width).all(|x| !is_shown(x, 0) && !is_shown(x, height - 1)));
            assert!((0..height).all(|y| !is_shown(0, y) && !is_shown(width - 1, y)));
            let tall = (0..height).filter(|y| is_shown(width / 2, *y)).count();
            let short_side = width.min(height) as f64;
            assert!(tall as f64 > 0.85 * short_side, "{tall} of {short_side}");
        }
    }
}

#[test]
fn cameras_that_look_nowhere_are_refused() {
    let scene = Scene::default();
    let good = from_above(Camera::VERTICAL_ANGLE);
    let bad = [
        Camera {
            eye: good.target,
            ..good
        },
        Camera {
            eye: Point3::new(f64::NAN, 0.0, 0.0),
            ..good
        },
        Camera {
            vertical_angle: 0.0,
            ..good
        },
        Camera {
            vertical_angle: 4.0,
            ..good
        },
        Camera {
            vertical_angle: f64::NAN,
            ..good
        },
    ];
    for camera in bad {
        let result = render(&scene, &camera, 4, 4);
        assert!(matches!(result, Err(ViewError::Camera(_))), "{camera:?}");
    }
    // Looking along "up" is possible: another up is taken.
    render(
        &scene,
        &Camera {
            up: Vector3::z(),
            ..good
        },
        4,
        4,
    )
    .unwrap();
    assert!(matches!(
        render(&scene, &good, 0, 4),
        Err(ViewError::Size { .. })
    ));
}

#[test]
fn a_grasp_strip_shows_both_colours_in_each_of_three_panels() {
    let hand = builtin_hand("allegro").unwrap();
    let palm = hand.palm();
    let object = sphere(palm.center + 0.06 * palm.normal, 0.04, 24);
    let pose = HandPose::at_origin(hand.open_articulation());
    let strip = render_hand_pose(&object, &*hand, &pose, &[], (180, 140)).unwrap();
    assert_eq!((strip.width(), strip.height()), (3 * 180 + 2 * 4, 140));
    for panel in 0..3 {
        let pixels = (0..140 * 180).map(|i| strip.pixel(panel * 184 + i % 180, i / 180));
        let (mut bluish, mut reddish) = (0, 0);
        for [red, _, blue] in pixels {
            bluish += usize::from(blue > red.saturating_add(15));
            reddish += usize::from(red > blue.saturating_add(15));
        }
        assert!(bluish > 300 && reddish > 200, "{panel}: {bluish} {reddish}");
    }
}

#[test]
fn creases_tell_flat_from_smooth() {
    let ball = sphere(Point3::origin(), 1.0, 8);
    let colors = |crease_angle| {
        let scene = Scene {
            surfaces: vec![Surface {
                mesh: &ball,
                color: Color::GREY,
                crease_angle,
            }],
            background: BLACK,
            ..Scene::default()
        };
        let image = render(&scene, &Camera::three_quarter(&scene, 1.0), 100, 100).unwrap();
        image
            .pixels()
            .iter()
            .collect::<std::collections::HashSet<_>>()
            .len()
    };
    assert!(colors(0.7) > colors(0.0));
}
