"""A headless Chromium, driven through its DevTools protocol: what a reader of a page would see."""

import json
import shutil
import subprocess
import time
import urllib.request
from pathlib import Path

import pytest
from websocket import create_connection

NAMES = ("chromium", "chromium-browser", "google-chrome")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
needs_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here to open pages in: apt-get install chromium"
)
SEEN = """(async () => {
    if (window.MathJax) await new Promise(drawn => MathJax.Hub.Queue(drawn));
    const all = selector => [...document.querySelectorAll(selector)];
    const targets = all("a[href^='#']").map(link => decodeURIComponent(link.hash.slice(1)));
    return {
        width: document.documentElement.scrollWidth,
        text: document.body.innerText,
        images: document.images.length,
        wordless: all("img:not([alt]), img[alt='']").map(image => image.src.slice(-80)),
        cut: all("pre").filter(code => code.scrollWidth > code.clientWidth + 1).map(
            code => code.innerText.slice(0, 80)),
        broken: all("img").filter(image => !image.naturalWidth).map(image => image.src.slice(-80)),
        formulas: all(".MathJax .math").length,
        unread: all(".MathJax .merror").map(formula => formula.innerText),
        dead: targets.filter(id => id && !document.getElementById(id)),
    };
})()"""


class Browser:
    """One window of a Chromium with a profile of its own, to be used in a ``with`` statement."""

    def __init__(self, profile: Path):
        command = [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run"]
        command += ["--disable-background-networking", "--remote-debugging-port=0"]
        # No page gets an answer from outside.
        command += ["--no-proxy-server", "--host-resolver-rules=MAP * ~NOTFOUND"]
        command += ["--remote-allow-origins=*", f"--user-data-dir={profile}", "about:blank"]
        self.process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        port_file = profile / "DevToolsActivePort"
        deadline = time.monotonic() + 60
        while not (port_file.exists() and port_file.read_text().count("\n")):
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"{CHROMIUM} did not start")
            time.sleep(0.1)
        port = port_file.read_text().split()[0]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
            tab = next(tab for tab in json.load(answer) if tab["type"] == "page")
        self.socket = create_connection(tab["webSocketDebuggerUrl"], timeout=60)
        self.sent, self.events = 0, []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.command(f"{domain}.enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.process.terminate()
        self.process.wait()

    def command(self, method: str, **parameters) -> dict:
        """Send one command and return its result; events meanwhile are kept."""
        self.sent += 1
        number = self.sent
        self.socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while (message := self._receive()).get("id") != number:
            pass
        if "error" in message:
            raise RuntimeError(f"{method}: {message['error']}")
        return message["result"]

    def open(self, page: Path, width: int = 1280, height: int = 900) -> dict:
        """What `SEEN` measures of a page, the errors of its console, and what it asks for."""
        self.command(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        self.events.clear()
        self.command("Page.navigate", url=page.resolve().as_uri())
        while not any(event["method"] == "Page.loadEventFired" for event in self.events):
            self._receive()
        answer = self.command(
            "Runtime.evaluate", expression=SEEN, returnByValue=True, awaitPromise=True
        )
        return answer["result"]["value"] | {"errors": self._errors(), "requests": self._requests()}

    def _receive(self) -> dict:
        message = json.loads(self.socket.recv())
        if "method" in message:
            self.events.append(message)
        return message

    def _errors(self) -> list[str]:
        found = []
        for event in self.events:
            details = event["params"]
            if event["method"] == "Runtime.exceptionThrown":
                found.append(details["exceptionDetails"]["text"])
            elif event["method"] == "Runtime.consoleAPICalled" and details["type"] == "error":
                found.append(str(details["args"]))
            elif event["method"] == "Log.entryAdded" and details["entry"]["level"] == "error":
                found.append(f"{details['entry']['text']} {details['entry'].get('url', '')}")
        return found

    def _requests(self) -> list[str]:
        sent = [e for e in self.events if e["method"] == "Network.requestWillBeSent"]
        urls = [event["params"]["request"]["url"] for event in sent]
        return [url for url in urls if not url.startswith(("file:", "data:", "about:"))]
