//! Owns a page: actions of a reader, and queries.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::chromium::Browser;
use crate::devtools::{BrowserError, Event};

/// Size of a window.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// Width, CSS px.
    pub width: u32,
    /// Height, CSS px.
    pub height: u32,
}

impl Size {
    /// A laptop window.
    pub const LAPTOP: Self = Self {
        width: 1440,
        height: 900,
    };
    /// An upright phone.
    pub const PHONE: Self = Self {
        width: 390,
        height: 844,
    };
}

/// A page of the browser.
#[derive(Debug)]
pub struct Page<'a> {
    browser: &'a mut Browser,
    session: String,
}

impl<'a> Page<'a> {
    pub(crate) fn new(browser: &'a mut Browser) -> Result<Self, BrowserError> {
        let blank = json!({ "url": "about:blank" });
        let target = browser.devtools.call(None, "Target.createTarget", blank)?;
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let attached = browser
            .devtools
            .call(None, "Target.attachToTarget", attach)?;
        let session = attached["sessionId"]
            .as_str()
            .unwrap_or_default()
            .to_owned();
        let mut page = Self { browser, session };
        for domain in ["Page", "Runtime", "Log", "Network", "DOM", "Accessibility"] {
            page.call(&format!("{domain}.enable"), json!({}))?;
        }
        page.resize(Size::LAPTOP)?;
        Ok(page)
    }

    /// Calls any method of the protocol.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn call(&mut self, method: &str, params: Value) -> Result<Value, BrowserError> {
        self.browser
            .devtools
            .call(Some(&self.session), method, params)
    }

    /// Opens a file and waits until it is loaded; drops earlier events.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn open(&mut self, file: &Path) -> Result<(), BrowserError> {
        self.visit(&format!("file://{}", file.display()))
    }

    /// Opens an address and waits until its document is loaded; drops earlier events.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn visit(&mut self, url: &str) -> Result<(), BrowserError> {
        let _ = self.events();
        let answer = self.call("Page.navigate", json!({ "url": url }))?;
        if let Some(reason) = answer["errorText"].as_str() {
            return Err(BrowserError::Refused {
                method: url.to_owned(),
                reason: reason.to_owned(),
            });
        }
        let loaded = |e: &Event| e.method == "Page.loadEventFired";
        self.browser.devtools.wait("the page to load", loaded)?;
        Ok(())
    }

    /// Events since the last call.
    pub fn events(&mut self) -> Vec<Event> {
        self.browser.devtools.events()
    }

    /// Value of an expression; awaits promises.
    ///
    /// # Errors
    /// [`BrowserError::Refused`] with the text of a thrown exception.
    pub fn evaluate(&mut self, expression: &str) -> Result<Value, BrowserError> {
        let requested =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", requested)?;
        match answer.get("exceptionDetails") {
            None => Ok(answer["result"]["value"].clone()),
            Some(thrown) => Err(BrowserError::Refused {
                method: expression.to_owned(),
                reason: thrown["exception"]["description"].to_string(),
            }),
        }
    }

    /// Waits until an expression is true.
    ///
    /// # Errors
    /// [`BrowserError`]; also when it stays false.
    pub fn wait_for(&mut self, expression: &str) -> Result<(), BrowserError> {
        let looks = format!(
            "new Promise(done => {{ const look = () => {{ let is = false; try {{ is = {expression}; }} catch {{ }} \
             if (is) done(true); else setTimeout(look, 20); }}; look(); }})"
        );
        self.evaluate(&looks).map(|_| ())
    }

    /// Value of a text expression.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn text(&mut self, expression: &str) -> Result<String, BrowserError> {
        let answer = self.evaluate(expression)?;
        Ok(answer
            .as_str()
            .map_or_else(|| answer.to_string(), str::to_owned))
    }

    /// Moves the pointer to the middle of the selected element, scrolled into view.
    ///
    /// # Errors
    /// [`BrowserError`]; the element must exist.
    pub fn hover(&mut self, selector: &str) -> Result<(), BrowserError> {
        let (x, y) = self.middle(selector)?;
        self.mouse("mouseMoved", x, y)
    }

    /// Clicks the middle of the selected element; opens what hides it.
    ///
    /// # Errors
    /// [`BrowserError`]; the element must exist.
    pub fn click(&mut self, selector: &str) -> Result<(), BrowserError> {
        let (x, y) = self.middle(selector)?;
        for kind in ["mouseMoved", "mousePressed", "mouseReleased"] {
            self.mouse(kind, x, y)?;
        }
        Ok(())
    }

    fn middle(&mut self, selector: &str) -> Result<(f64, f64), BrowserError> {
        let found = self.evaluate(&format!(
            "(() => {{ const e = document.querySelector({}); \
             for (let d = e; d && !e.closest('summary'); d = d.parentElement) if (d.matches('details')) d.open = true; \
             e.scrollIntoView({{ block: 'center', behavior: 'instant' }}); \
             const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }})()",
            json!(selector)
        ))?;
        let at = |i: usize| found[i].as_f64().unwrap_or(f64::NAN);
        Ok((at(0), at(1)))
    }

    fn mouse(&mut self, kind: &str, x: f64, y: f64) -> Result<(), BrowserError> {
        let (button, clicks) = match kind {
            "mouseMoved" => ("none", 0),
            _ => ("left", 1),
        };
        let event = json!({ "type": kind, "x": x, "y": y, "button": button, "clickCount": clicks });
        self.call("Input.dispatchMouseEvent", event)?;
        Ok(())
    }

    /// Presses a key, by name (`ArrowRight`) or character (`+`).
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn key(&mut self, key: &str) -> Result<(), BrowserError> {
        let text = match key {
            "Enter" => "\r",
            _ if key.chars().count() == 1 => key,
            _ => "",
        };
        let code = match key {
            "Tab" => 9,
            "Enter" => 13,
            "Escape" => 27,
            "End" => 35,
            "Home" => 36,
            "ArrowLeft" => 37,
            "ArrowUp" => 38,
            "ArrowRight" => 39,
            "ArrowDown" => 40,
            _ => 0,
        };
        for kind in ["keyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": key, "code": key, "text": if kind == "keyDown" { text } else { "" }, "windowsVirtualKeyCode": code });
            self.call("Input.dispatchKeyEvent", event)?;
        }
        Ok(())
    }

    /// Clicks an element that downloads a file, and returns its name and bytes.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn download(&mut self, selector: &str) -> Result<(String, Vec<u8>), BrowserError> {
        let _ = self.events();
        self.click(selector)?;
        let devtools = &mut self.browser.devtools;
        let begins = |e: &Event| e.method == "Browser.downloadWillBegin";
        let begun = devtools.wait(&format!("a download from {selector}"), begins)?;
        let ended =
            |e: &Event| e.method == "Browser.downloadProgress" && e.params["state"] == "completed";
        devtools.wait("the end of the download", ended)?;
        let name = begun.params["suggestedFilename"]
            .as_str()
            .unwrap_or_default();
        let file = self.browser.downloads().join(name);
        let bytes = std::fs::read(&file)?;
        std::fs::remove_file(&file)?;
        Ok((name.to_owned(), bytes))
    }

    /// Resizes the window.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn resize(&mut self, size: Size) -> Result<(), BrowserError> {
        let metrics = json!({ "width": size.width, "height": size.height, "deviceScaleFactor": 1, "mobile": size.width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", metrics)?;
        Ok(())
    }

    /// Emulates dark mode or print media; empty strings for neither.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn media(&mut self, media: &str, scheme: &str) -> Result<(), BrowserError> {
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        let media = json!({ "media": media, "features": features });
        self.call("Emulation.setEmulatedMedia", media)?;
        Ok(())
    }

    /// A screenshot of the window, or of the whole page, as PNG.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn picture(&mut self, whole: bool) -> Result<Vec<u8>, BrowserError> {
        let mut how = json!({ "format": "png", "captureBeyondViewport": whole });
        if whole {
            let size = self.call("Page.getLayoutMetrics", json!({}))?["cssContentSize"].clone();
            how["clip"] = json!({ "x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1 });
        }
        let answer = self.call("Page.captureScreenshot", how)?;
        decoded(&answer)
    }

    /// The printed page, as PDF.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn pdf(&mut self) -> Result<Vec<u8>, BrowserError> {
        let how = json!({ "preferCSSPageSize": true, "printBackground": true });
        let answer = self.call("Page.printToPDF", how)?;
        decoded(&answer)
    }
}

fn decoded(answer: &Value) -> Result<Vec<u8>, BrowserError> {
    let text = answer["data"].as_str().unwrap_or_default();
    STANDARD.decode(text).map_err(|e| BrowserError::Refused {
        method: "base64".into(),
        reason: e.to_string(),
    })
}
