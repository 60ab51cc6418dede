//! Chromium without a window, driven over its DevTools protocol.

#![allow(clippy::unwrap_used, reason = "tests only")]

use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// Longest that a start or an answer may take.
const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) struct Browser {
    process: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    session: Option<String>,
    sent: u64,
    /// What the page said and asked for since the start.
    pub(crate) events: Vec<Value>,
    _profile: tempfile::TempDir,
}

/// The program, if there is one. With `CLAROR_REQUIRE_CHROMIUM` a missing one is a failure.
pub(crate) fn find() -> Option<PathBuf> {
    let named = std::env::var_os("CLAROR_CHROMIUM").map(PathBuf::from);
    let folders: Vec<PathBuf> =
        std::env::var_os("PATH").map(|p| std::env::split_paths(&p).collect()).unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let on_path = folders.iter().flat_map(|f| names.iter().map(move |n| f.join(n)));
    let found = named.into_iter().chain(on_path).find(|p| p.is_file());
    if found.is_none() {
        assert!(
            std::env::var_os("CLAROR_REQUIRE_CHROMIUM").is_none(),
            "CLAROR_REQUIRE_CHROMIUM is set, but there is no chromium on the path"
        );
        eprintln!("skipped: no chromium on the path and none named by CLAROR_CHROMIUM");
    }
    found
}

impl Browser {
    pub(crate) fn start(program: &Path) -> Self {
        let profile = tempfile::tempdir().unwrap();
        let process = Command::new(program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic"])
            .args(["--no-first-run", "--disable-background-networking", "--disable-sync"])
            .args(["--disable-component-update", "--remote-debugging-port=0", "--hide-scrollbars"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let begun = Instant::now();
        let port_file = profile.path().join("DevToolsActivePort");
        let text = loop {
            match std::fs::read_to_string(&port_file) {
                Ok(text) if text.lines().count() >= 2 => break text,
                _ if begun.elapsed() > PATIENCE => panic!("chromium does not start"),
                _ => std::thread::sleep(Duration::from_millis(50)),
            }
        };
        let mut lines = text.lines();
        let (port, path) = (lines.next().unwrap(), lines.next().unwrap());
        let (socket, _) = tungstenite::connect(format!("ws://127.0.0.1:{port}{path}")).unwrap();
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(PATIENCE)).unwrap();
        }
        let mut browser =
            Self { process, socket, session: None, sent: 0, events: Vec::new(), _profile: profile };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let attach = json!({"targetId": target["targetId"], "flatten": true});
        let session = browser.call("Target.attachToTarget", attach);
        browser.session = session["sessionId"].as_str().map(String::from);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser
    }

    /// The answer to a command; events that come before it are kept.
    pub(crate) fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.sent += 1;
        let mut message = json!({"id": self.sent, "method": method, "params": parameters});
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.socket.send(Message::text(message.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let mut answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == json!(self.sent) {
                assert!(answer.get("error").is_none(), "{method}: {}", answer["error"]);
                return answer["result"].take();
            }
            self.events.push(answer);
        }
    }

    /// The value of a JavaScript expression, awaited if it is a promise.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let parameters =
            json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        let mut answer = self.call("Runtime.evaluate", parameters);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].take()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait_for(&mut self, expression: &str) {
        let begun = Instant::now();
        while self.value(expression) != json!(true) {
            assert!(begun.elapsed() < PATIENCE, "never true: {expression}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Opens a file in a window of this size and waits until its charts are drawn.
    pub(crate) fn open(&mut self, path: &Path, width: u32, height: u32, dark: bool) {
        let window = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500});
        self.call("Emulation.setDeviceMetricsOverride", window);
        let scheme = if dark { "dark" } else { "light" };
        let features = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
        self.call("Emulation.setEmulatedMedia", features);
        self.call("Page.navigate", json!({"url": format!("file://{}", path.display())}));
        self.wait_for("document.documentElement?.dataset.charts === 'drawn'");
        self.wait_for("[...document.querySelectorAll('.comparer')].every(c => c.dataset.ready)");
    }

    /// Presses a key where the focus is.
    pub(crate) fn key(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({"type": kind, "key": key}));
        }
    }

    pub(crate) fn mouse(&mut self, kind: &str, x: f64, y: f64) {
        let pressed = u8::from(kind != "mouseReleased");
        let event = json!({"type": kind, "x": x, "y": y, "button": "left", "buttons": pressed, "clickCount": 1});
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Moves the pointer without a button.
    pub(crate) fn hover(&mut self, x: f64, y: f64) {
        let event = json!({"type": "mouseMoved", "x": x, "y": y});
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Saves what is seen, or the whole page, if `CLAROR_SCREENSHOTS` names a folder.
    pub(crate) fn screenshot(&mut self, name: &str, whole: bool) {
        let Some(folder) = std::env::var_os("CLAROR_SCREENSHOTS") else { return };
        let shot = self.call(
            "Page.captureScreenshot",
            json!({"format": "png", "captureBeyondViewport": whole}),
        );
        self.save(&Path::new(&folder).join(format!("{name}.png")), &shot);
    }

    /// Saves the printed page there.
    pub(crate) fn print(&mut self, name: &str) -> usize {
        let printed = self
            .call("Page.printToPDF", json!({"printBackground": false, "preferCSSPageSize": true}));
        if let Some(folder) = std::env::var_os("CLAROR_SCREENSHOTS") {
            self.save(&Path::new(&folder).join(format!("{name}.pdf")), &printed);
        }
        printed["data"].as_str().unwrap().len()
    }

    /// Neither did the page ask for anything that is not in it, nor was there an error or a warning.
    pub(crate) fn expect_nothing_asked_or_complained(&self) {
        for event in &self.events {
            let parameters = &event["params"];
            match event["method"].as_str().unwrap_or_default() {
                "Network.requestWillBeSent" => {
                    let url = parameters["request"]["url"].as_str().unwrap();
                    let local = ["file:", "data:", "blob:", "about:"];
                    assert!(local.iter().any(|p| url.starts_with(p)), "asked for {url}");
                }
                "Runtime.exceptionThrown" => panic!("{parameters}"),
                "Runtime.consoleAPICalled" => {
                    let kind = parameters["type"].as_str().unwrap();
                    assert!(!matches!(kind, "error" | "warning" | "assert"), "{parameters}");
                }
                "Log.entryAdded" => {
                    let level = parameters["entry"]["level"].as_str().unwrap();
                    assert!(!matches!(level, "error" | "warning"), "{parameters}");
                }
                _ => {}
            }
        }
    }

    fn save(&self, path: &Path, answer: &Value) {
        use base64::Engine;
        let data = answer["data"].as_str().unwrap();
        let bytes = base64::engine::general_purpose::STANDARD.decode(data).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
