"""Headless Chromium, controlled by its DevTools protocol over pipes: no driver and no network needed."""

from __future__ import annotations

import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_OPTIONS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--no-first-run", "--disable-background-networking", "--disable-dev-shm-usage", "--remote-debugging-pipe"),
)


def chromium() -> str | None:
    """Return the path of Chromium, None if it is missing; DOO3D_CHROMIUM names another program."""
    return os.environ.get("DOO3D_CHROMIUM") or next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """One page in Chromium.

    problems : errors on the console so far. requests : addresses that the page has requested.
    """

    def __init__(self, size: tuple[int, int] = (1280, 800), dark: bool = False) -> None:
        program = chromium()
        assert program is not None
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        low_in, self._out = os.pipe()
        self._in, low_out = os.pipe()
        # Chromium expects the pipes at file descriptors 3 and 4, so its ends are duplicated above 10
        chrome_in, chrome_out = (fcntl.fcntl(low, fcntl.F_DUPFD, 10) for low in (low_in, low_out))
        start = f'exec "$@" 3<&{chrome_in} 4>&{chrome_out} {chrome_in}<&- {chrome_out}>&-'
        command = ["bash", "-c", start, "bash", program, *_OPTIONS, f"--user-data-dir={self._profile.name}"]
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._process = subprocess.Popen(command, pass_fds=(chrome_in, chrome_out), **quiet)
        for descriptor in (low_in, low_out, chrome_in, chrome_out):
            os.close(descriptor)
        self._unparsed, self._number, self._session = b"", 0, ""
        self.problems: list[str] = []
        self.requests: list[str] = []
        self._loaded = False
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")
        self.send("Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=-1, uploadThroughput=-1)
        self.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self.send("Emulation.setDeviceMetricsOverride", **metrics)

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._in)
        os.close(self._out)
        self._profile.cleanup()

    def send(self, method: str, **values: Any) -> dict[str, Any]:
        """Send a command of the protocol and return its result."""
        self._number += 1
        number = self._number
        message = {"id": number, "method": method, "params": values} | ({"sessionId": self._session} if self._session else {})
        unsent = json.dumps(message).encode() + b"\0"
        while unsent:
            unsent = unsent[os.write(self._out, unsent) :]
        while True:
            answer = self._read(60)
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return dict(answer["result"])

    def open(self, page: Path, seconds: float = 60) -> float:
        """Load a file and return the time until it was drawn, s."""
        self._loaded = False
        start = time.perf_counter()
        self.send("Page.navigate", url=page.absolute().as_uri())
        while not self._loaded:
            self._read(seconds)
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        return time.perf_counter() - start

    def run(self, script: str) -> Any:
        """Return the value of an expression in the page; of a promise, its result."""
        answer = self.send("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, condition: str, seconds: float = 60) -> None:
        """Wait until an expression is true in the page."""
        end = time.perf_counter() + seconds
        while not self.run(f"Boolean({condition})"):
            assert time.perf_counter() < end, f"not within {seconds} s: {condition}"
            time.sleep(0.05)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press the left button at `start`, move to `end` and release it, (x, y) px."""
        held = {"button": "left", "buttons": 1, "clickCount": 1}
        self.send("Input.dispatchMouseEvent", type="mouseMoved", x=start[0], y=start[1])
        self.send("Input.dispatchMouseEvent", type="mousePressed", x=start[0], y=start[1], **held)
        for i in range(1, 9):
            x, y = (a + (b - a) * i / 8 for a, b in zip(start, end, strict=True))
            self.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, button="left", buttons=1)
        self.send("Input.dispatchMouseEvent", type="mouseReleased", x=end[0], y=end[1], **held)

    def picture(self) -> bytes:
        """Return a screenshot of the page as PNG."""
        return base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"])

    def _read(self, seconds: float) -> dict[str, Any]:
        while b"\0" not in self._unparsed:
            ready, _, _ = select.select([self._in], [], [], seconds)
            assert ready, f"Chromium sent nothing for {seconds} s"
            data = os.read(self._in, 1 << 20)
            assert data, "Chromium has ended"
            self._unparsed += data
        text, _, self._unparsed = self._unparsed.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        self._note(message.get("method", ""), message.get("params", {}))
        return message

    def _note(self, event: str, values: dict[str, Any]) -> None:
        if event == "Page.loadEventFired":
            self._loaded = True
        elif event == "Runtime.exceptionThrown":
            self.problems.append(str(values["exceptionDetails"]))
        elif event == "Runtime.consoleAPICalled" and values["type"] in ("error", "assert"):
            self.problems.append(str(values["args"]))
        elif event == "Log.entryAdded" and values["entry"]["level"] == "error":
            self.problems.append(str(values["entry"]))
        elif event == "Network.requestWillBeSent":
            self.requests.append(values["request"]["url"])
