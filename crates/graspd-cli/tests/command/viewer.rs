//! `graspd view`: its page in a real browser.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::browser::{Page, Screenshot, find_browser};
use crate::outcome::{graspd, text};
use crate::shared_run::{GRASPS, RUN};

/// The part of a wide window that shows the grasp, without the boxes at its corners.
const STAGE: [f64; 4] = [0.12, 0.15, 0.55, 0.6];
/// The same of a narrow one.
const NARROW_STAGE: [f64; 4] = [0.1, 0.16, 0.9, 0.5];

static PAGE: LazyLock<PathBuf> = LazyLock::new(|| {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graspd-run-view.html");
    graspd(["view", text(&RUN.0), "-o", text(&file)]).succeeds();
    file
});

/// Keeps a picture for whoever wants to look at it.
fn keep(name: &str, screenshot: &Screenshot) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("screenshots");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(name), &screenshot.png).unwrap();
}

/// The share of pixels that differ visibly.
fn difference(a: &Screenshot, b: &Screenshot, part: [f64; 4]) -> f64 {
    let (a, b) = (a.part(part), b.part(part));
    let differs = |(a, b): &(&[u8; 3], &[u8; 3])| (0..3).any(|c| a[c].abs_diff(b[c]) > 12);
    a.iter().zip(&b).filter(differs).count() as f64 / a.len() as f64
}

fn assert_shows_something(screenshot: &Screenshot, part: [f64; 4]) {
    let pixels = screenshot.part(part);
    let colors: BTreeSet<_> = pixels.iter().collect();
    assert!(colors.len() > 300, "{} colours", colors.len());
    // Object and hand have colours of their own.
    let count = |is: fn(&[u8; 3]) -> bool| pixels.iter().filter(|p| is(p)).count();
    let blue = count(|[r, _, b]| i32::from(*b) > i32::from(*r) + 15);
    let sand = count(|[r, _, b]| i32::from(*r) > i32::from(*b) + 25);
    let least = pixels.len() / 100;
    assert!(
        blue > least && sand > least,
        "{blue} {sand} of {}",
        pixels.len()
    );
}

#[test]
fn the_page_shows_grasps_and_obeys_mouse_and_keys() {
    let Some(browser) = find_browser() else {
        return;
    };
    let mut page = Page::open(&browser, &PAGE, (1280, 800), false);
    page.wait_for("document.documentElement.dataset.state === 'ready'");
    let first = page.screenshot();
    keep("wide.png", &first);
    assert_shows_something(&first, STAGE);
    let state = page.state();
    assert_eq!(state["grasps"], GRASPS);
    assert_eq!(
        (&state["rank"], &state["mode"]),
        (&1.into(), &"execution".into())
    );
    assert_eq!(state["time"], 1.0);
    let by_rank = state["order"].clone();

    // Another row.
    page.click("tbody tr:nth-child(3)");
    let third = page.state();
    assert_eq!(third["rank"], 3);
    assert_eq!(third["grasp"], by_rank[2]);
    let shown = page.screenshot();
    keep("third.png", &shown);
    assert!(difference(&first, &shown, STAGE) > 0.02);

    // The slider, by its value as a reader drags it: to the pre-grasp, and on by keys.
    page.drag("#slider", [-2000.0, 0.0]);
    assert_eq!(page.state()["time"], 0.0);
    let before = page.screenshot();
    keep("pre-grasp.png", &before);
    assert!(difference(&shown, &before, STAGE) > 0.02);
    page.click("#reset");
    page.press("ArrowRight");
    let time = page.state()["time"].as_f64().unwrap();
    assert!((0.02..0.1).contains(&time), "{time}");
    page.press("3");
    assert_eq!(page.state()["time"], 2.0);
    page.press("2");
    assert_eq!(page.state()["time"], 1.0);
    page.press("ArrowDown");
    assert_eq!(page.state()["rank"], 4);
    page.press("k");
    assert_eq!(page.state()["rank"], 3);
    page.press("End");
    assert_eq!(page.state()["rank"], GRASPS);
    page.press("Home");
    assert_eq!(page.state()["rank"], 1);

    // Sorted by contact area, largest first.
    let column = page.value(
        "[...document.querySelectorAll('th')].findIndex(cell => cell.textContent.startsWith('CA'))",
    );
    let column = column.as_u64().unwrap();
    let heading = format!("th:nth-child({}) button", column + 1);
    page.click(&heading);
    page.click(&heading);
    let cells = page.value(&format!(
        "[...document.querySelectorAll('tbody tr')].map(row => Number(row.cells[{column}].textContent))"
    ));
    let areas: Vec<f64> = cells
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect();
    assert_eq!(areas.len(), GRASPS);
    assert!(areas.windows(2).all(|pair| pair[0] >= pair[1]), "{areas:?}");

    // Turned by the mouse.
    let camera = page.state()["camera"].clone();
    let straight = page.screenshot();
    page.drag("#view > canvas", [220.0, 30.0]);
    let turned = page.screenshot();
    keep("turned.png", &turned);
    assert_ne!(page.state()["camera"], camera);
    assert!(difference(&straight, &turned, STAGE) > 0.05);
    page.press("r");

    // What is marked can be hidden.
    let with = page.screenshot();
    page.press("c");
    assert_eq!(page.state()["contacts"], false);
    let without = page.screenshot();
    if page.state()["contact_count"].as_u64().unwrap() > 0 {
        assert!(difference(&with, &without, STAGE) > 0.0);
    }
    page.press("c");
    page.press("x");
    assert_eq!(page.state()["see_through"], true);
    let seen_through = page.screenshot();
    keep("see-through.png", &seen_through);
    assert!(difference(&with, &seen_through, STAGE) > 0.02);
    page.press("x");

    // The optimisation, played to its end.
    page.press("o");
    assert_eq!(page.state()["mode"], "optimization");
    page.drag("#slider", [-2000.0, 0.0]);
    assert_eq!(page.state()["step"], 0);
    let start = page.screenshot();
    keep("first-step.png", &start);
    assert!(difference(&with, &start, STAGE) > 0.02);
    let plot = page.value(
        "(() => { const c = document.getElementById('losses'); \
         const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; \
         return d.reduce((n, v, i) => n + (i % 4 === 3 && v > 0 ? 1 : 0), 0); })()",
    );
    assert!(plot.as_u64().unwrap() > 300, "the curves are drawn: {plot}");
    page.press("r");
    page.value("document.activeElement.blur()");
    page.press(" ");
    page.wait_for("!window.graspd.state().playing && window.graspd.state().step > 0");
    assert_eq!(page.state()["step"], 60);
    page.assert_sound();
}

#[test]
fn the_page_works_on_a_phone() {
    let Some(browser) = find_browser() else {
        return;
    };
    let mut page = Page::open(&browser, &PAGE, (390, 844), true);
    page.wait_for("document.documentElement.dataset.state === 'ready'");
    let upright = page.screenshot();
    keep("phone.png", &upright);
    assert_shows_something(&upright, NARROW_STAGE);
    assert_eq!(
        page.value("document.documentElement.scrollWidth <= window.innerWidth"),
        true,
        "nothing sticks out sideways"
    );
    // Fingers need room.
    let smallest = page.value(
        "Math.min(...[...document.querySelectorAll('#controls button, #pager button')].map(b => \
         b.getBoundingClientRect().height))",
    );
    assert!(smallest.as_f64().unwrap() >= 36.0, "{smallest}");
    let camera = page.state()["camera"].clone();
    page.swipe("#view > canvas", [120.0, 20.0]);
    let turned = page.screenshot();
    assert_ne!(page.state()["camera"], camera);
    assert!(difference(&upright, &turned, NARROW_STAGE) > 0.05);
    page.click("#next");
    assert_eq!(page.state()["rank"], 2);
    page.assert_sound();
}

#[test]
fn names_are_text_whatever_they_are() {
    // Nothing in it can end the script, the title or a tag.
    let name = "a</script><img src=x onerror=alert(1)>{{script}} \u{2028}&amp;";
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("cup.obj");
    graspd_mesh::save_obj(&graspd_mesh::builtin_object("box").unwrap(), &mesh).unwrap();
    let records = fs::read_to_string(RUN.0.join("grasps.jsonl")).unwrap();
    let mut lines = String::new();
    for line in records.lines().take(2) {
        let mut record: serde_json::Value = serde_json::from_str(line).unwrap();
        record["object"] = name.into();
        record["optimizer"]["preset"] = name.into();
        lines += &format!("{record}\n");
    }
    let file = folder.path().join("grasps.jsonl");
    fs::write(&file, lines).unwrap();
    let evil = folder.path().join("a<svg onload=alert(1)>&{{block}}.obj");
    fs::rename(&mesh, &evil).unwrap();
    graspd(["view", text(&file), "--object", text(&evil)]).succeeds();
    let html = fs::read_to_string(file.with_extension("html")).unwrap();
    assert_eq!(html.matches("</script>").count(), 3);
    for tag in ["<img", "<svg"] {
        assert!(!html.contains(tag), "{tag}");
    }
    let Some(browser) = find_browser() else {
        return;
    };
    let mut page = Page::open(&browser, &file.with_extension("html"), (900, 700), false);
    page.wait_for("document.documentElement.dataset.state === 'ready'");
    let title = page.value("document.getElementById('title').textContent");
    assert_eq!(title, "a<svg onload=alert(1)>&{{block}} · allegro");
    let facts = page.value("document.getElementById('facts').textContent");
    assert!(facts.as_str().unwrap().contains(name), "{facts}");
    page.assert_sound();
}
