//! A headless Chromium, driven over its pipe by the DevTools protocol.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use tempfile::TempDir;

/// An answer that takes longer will not come.
const PATIENCE: Duration = Duration::from_secs(120);

/// Names under which the browser is installed.
const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// The browser's program; where there is none, says on stderr that the test is skipped.
pub(crate) fn find_browser() -> Option<PathBuf> {
    if let Some(program) = std::env::var_os("GRASPD_BROWSER") {
        return Some(program.into());
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let found = (NAMES.iter())
        .flat_map(|name| folders.iter().map(move |folder| folder.join(name)))
        .find(|program| program.is_file());
    if found.is_none() {
        eprintln!(
            "SKIPPED: no browser is installed (apt-get install chromium, or set GRASPD_BROWSER): the page is not tried"
        );
    }
    found
}

/// One page in a browser of its own.
pub(crate) struct Page {
    browser: Child,
    to_browser: ChildStdin,
    from_browser: Receiver<Value>,
    session: String,
    next_id: u64,
    /// What the browser told on its own account.
    events: Vec<Value>,
    _profile: TempDir,
}

impl Page {
    /// Opens a file in a window of `size` = (width, height), and waits until it is loaded.
    pub(crate) fn open(program: &Path, file: &Path, size: (u32, u32), is_phone: bool) -> Self {
        let profile = tempfile::tempdir().unwrap();
        // The browser reads its third descriptor and writes to its fourth.
        let script = r#"exec "$0" "$@" 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null"#;
        let mut browser = Command::new("sh")
            .args(["-c", script])
            .arg(program)
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-dev-shm-usage",
                "--disable-extensions",
                "--no-first-run",
                "--hide-scrollbars",
                // Drawn in software: no GPU is needed.
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--remote-debugging-pipe",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let to_browser = browser.stdin.take().unwrap();
        let answers = browser.stdout.take().unwrap();
        let (sender, from_browser) = channel();
        std::thread::spawn(move || {
            for message in BufReader::new(answers).split(0) {
                let Ok(message) = message else { break };
                let Ok(value) = serde_json::from_slice(&message) else {
                    break;
                };
                if sender.send(value).is_err() {
                    break;
                }
            }
        });
        let mut page = Self {
            browser,
            to_browser,
            from_browser,
            session: String::new(),
            next_id: 0,
            events: Vec::new(),
            _profile: profile,
        };
        let target = page.call("Target.createTarget", json!({"url": "about:blank"}));
        let attached = page.call(
            "Target.attachToTarget",
            json!({"targetId": target["targetId"], "flatten": true}),
        );
        page.session = attached["sessionId"].as_str().unwrap().to_owned();
        for domain in ["Page", "Runtime", "Log", "Network"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        page.call(
            "Emulation.setDeviceMetricsOverride",
            json!({
                "width": size.0, "height": size.1, "mobile": is_phone,
                "deviceScaleFactor": if is_phone { 2 } else { 1 },
            }),
        );
        if is_phone {
            page.call(
                "Emulation.setTouchEmulationEnabled",
                json!({"enabled": true}),
            );
        }
        let url = format!("file://{}", file.canonicalize().unwrap().display());
        page.call("Page.navigate", json!({"url": url}));
        page.wait_for("document.documentElement?.dataset.state !== undefined");
        page
    }

    /// Calls a method of the protocol and gives its result.
    pub(crate) fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.next_id += 1;
        let mut message = json!({"id": self.next_id, "method": method, "params": parameters});
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.to_browser
            .write_all(format!("{message}\0").as_bytes())
            .unwrap();
        self.to_browser.flush().unwrap();
        loop {
            let answer = (self.from_browser.recv_timeout(PATIENCE))
                .unwrap_or_else(|error| panic!("{method}: no answer: {error}"));
            if answer["id"] == self.next_id {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
            if answer.get("id").is_none() {
                self.events.push(answer);
            }
        }
    }

    /// The value of a JavaScript expression.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let result = self.call(
            "Runtime.evaluate",
            json!({"expression": expression, "returnByValue": true, "awaitPromise": true}),
        );
        assert!(
            result.get("exceptionDetails").is_none(),
            "{expression}: {result}"
        );
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait_for(&mut self, expression: &str) {
        let start = Instant::now();
        while self.value(expression) != json!(true) {
            assert!(start.elapsed() < PATIENCE, "never true: {expression}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// What the page says of itself.
    pub(crate) fn state(&mut self) -> Value {
        self.value("window.graspd.state()")
    }

    /// Presses and releases a key, as `KeyboardEvent.key` calls it.
    pub(crate) fn press(&mut self, key: &str) {
        let code = match key {
            "ArrowDown" => 40,
            "ArrowUp" => 38,
            "ArrowLeft" => 37,
            "ArrowRight" => 39,
            "Home" => 36,
            "End" => 35,
            " " => 32,
            _ => 0,
        };
        let mut down = json!({"type": "keyDown", "key": key, "windowsVirtualKeyCode": code});
        if key.len() == 1 {
            down["text"] = json!(key);
        }
        self.call("Input.dispatchKeyEvent", down);
        self.call(
            "Input.dispatchKeyEvent",
            json!({"type": "keyUp", "key": key}),
        );
    }

    /// The middle of the first element of a selector, in the window.
    fn place_of(&mut self, selector: &str) -> [f64; 2] {
        let selector = json!(selector);
        let place = self.value(&format!(
            "(() => {{ const e = document.querySelector({selector}); e.scrollIntoView({{block: 'nearest'}}); \
             const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }})()"
        ));
        [0, 1].map(|axis| place[axis].as_f64().unwrap())
    }

    /// Clicks the middle of the first element of a selector.
    pub(crate) fn click(&mut self, selector: &str) {
        let at = self.place_of(selector);
        self.mouse("mousePressed", at, 1);
        self.mouse("mouseReleased", at, 0);
    }

    /// Drags by the mouse, from the middle of an element.
    pub(crate) fn drag(&mut self, selector: &str, by: [f64; 2]) {
        let [x, y] = self.place_of(selector);
        let inside = |x: f64, y: f64| [x.max(1.0), y.max(1.0)];
        self.mouse("mousePressed", [x, y], 1);
        for part in 1..=4 {
            let share = f64::from(part) / 4.0;
            self.mouse(
                "mouseMoved",
                inside(x + share * by[0], y + share * by[1]),
                1,
            );
        }
        self.mouse("mouseReleased", inside(x + by[0], y + by[1]), 0);
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], buttons: u32) {
        let is_move = kind == "mouseMoved";
        self.call(
            "Input.dispatchMouseEvent",
            json!({
                "type": kind, "x": x, "y": y, "buttons": buttons, "clickCount": u32::from(!is_move),
                "button": "left",
            }),
        );
    }

    /// Drags one finger from the middle of an element.
    pub(crate) fn swipe(&mut self, selector: &str, by: [f64; 2]) {
        let [x, y] = self.place_of(selector);
        let touch = |x: f64, y: f64| json!([{"x": x, "y": y}]);
        let mut send = |kind: &str, points: Value| {
            self.call(
                "Input.dispatchTouchEvent",
                json!({"type": kind, "touchPoints": points}),
            );
        };
        send("touchStart", touch(x, y));
        for part in 1..=4 {
            let share = f64::from(part) / 4.0;
            send("touchMove", touch(x + share * by[0], y + share * by[1]));
        }
        send("touchEnd", json!([]));
    }

    /// What the window shows, after all that was asked for has been drawn.
    pub(crate) fn screenshot(&mut self) -> Screenshot {
        self.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))");
        let answer = self.call("Page.captureScreenshot", json!({"format": "png"}));
        let bytes = STANDARD.decode(answer["data"].as_str().unwrap()).unwrap();
        Screenshot::decode(bytes)
    }

    /// Asserts that the page has raised no exception, logged no error, and asked for nothing but its own file.
    pub(crate) fn assert_sound(&mut self) {
        for event in &self.events {
            let parameters = &event["params"];
            match event["method"].as_str().unwrap_or_default() {
                "Runtime.exceptionThrown" => panic!("{parameters}"),
                "Log.entryAdded" => {
                    assert_ne!(parameters["entry"]["level"], "error", "{parameters}");
                }
                "Runtime.consoleAPICalled" => {
                    assert_ne!(parameters["type"], "error", "{parameters}");
                }
                "Network.requestWillBeSent" => {
                    let url = parameters["request"]["url"].as_str().unwrap();
                    let is_own = url.ends_with(".html") || url.contains(".html#");
                    assert!(
                        url.starts_with("file://") && is_own || url.starts_with("data:"),
                        "asks for {url}"
                    );
                }
                _ => {}
            }
        }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // A browser that is gone already needs no ending.
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}

/// What a window shows.
pub(crate) struct Screenshot {
    pub(crate) png: Vec<u8>,
    pub(crate) width: usize,
    pub(crate) height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Screenshot {
    fn decode(png: Vec<u8>) -> Self {
        let mut reader = png::Decoder::new(std::io::Cursor::new(&png))
            .read_info()
            .unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        let channels = info.line_size / info.width as usize;
        let pixels = bytes.chunks_exact(channels).map(|p| [p[0], p[1], p[2]]);
        Self {
            width: info.width as usize,
            height: info.height as usize,
            pixels: pixels.collect(),
            png,
        }
    }

    /// The pixels of a part given in shares of the window: left, top, right, bottom.
    pub(crate) fn part(&self, [left, top, right, bottom]: [f64; 4]) -> Vec<[u8; 3]> {
        let range = |low: f64, high: f64, size: usize| {
            (low * size as f64) as usize..(high * size as f64) as usize
        };
        range(top, bottom, self.height)
            .flat_map(|row| {
                range(left, right, self.width).map(move |column| row * self.width + column)
            })
            .map(|pixel| self.pixels[pixel])
            .collect()
    }
}
