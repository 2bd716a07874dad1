"""Debian's Chromium without a window, driven over its DevTools pipe: pages are opened, asked, typed into and looked at."""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
import time
from base64 import b64decode
from pathlib import Path
from typing import Any

from tools import need

NAMES = ("chromium", "chromium-browser", "google-chrome")
LIMIT = 60  # s, until a page must have answered
# No sandbox, for CI runs as root; nothing but the one page is opened, and that has no network.
OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
           "--disable-background-networking", "--disable-component-update", "--hide-scrollbars",
           "--remote-debugging-pipe")  # fmt: skip
KEYS = {"ArrowRight": 39, "ArrowLeft": 37, "ArrowUp": 38, "ArrowDown": 40, "Home": 36, "End": 35, "Tab": 9, "Enter": 13}


class Browser:
    """One page in a browser; ``errors`` has what its console and its scripts complained of."""

    def __init__(self, profile: Path) -> None:
        (receive, self._write), (self._read, send) = _pipe(), _pipe()
        script = f'exec 3<&{receive} 4>&{send}; exec "$@"'  # the browser reads from its descriptor 3 and writes to 4
        command = ["bash", "-c", script, "bash", need(*NAMES), *OPTIONS, f"--user-data-dir={profile}", "about:blank"]
        self._process = subprocess.Popen(command, pass_fds=(receive, send), stderr=subprocess.DEVNULL)
        os.close(receive)
        os.close(send)
        self._rest, self._count, self._session = b"", 0, ""
        self.errors: list[str] = []
        self.asked: list[str] = []
        target = next(t for t in self("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self._session = self("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self(f"{domain}.enable")

    def close(self) -> None:
        """End the browser."""
        session, self._session = self._session, ""
        if session:
            self("Browser.close")
        self._process.wait(LIMIT)
        os.close(self._write)
        os.close(self._read)

    def __call__(self, method: str, **parameters: Any) -> Any:
        """One command of the DevTools protocol, and its result."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]

    def open(self, path: Path, width: int = 1200, height: int = 900, dark: bool = False) -> None:
        """Open a file in a window of a size [px], light or dark, and wait until it is loaded."""
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self("Emulation.setEmulatedMedia", features=[scheme])
        self("Page.navigate", url=path.resolve().as_uri())
        self.wait("document.readyState === 'complete'")

    def ask(self, expression: str) -> Any:
        """The value of a JavaScript expression; promises are awaited."""
        found = self("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""
        for _ in range(20 * LIMIT):
            if self.ask(condition):
                return
            time.sleep(0.05)
        raise TimeoutError(condition)

    def press(self, key: str, times: int = 1) -> None:
        """Press a key of `KEYS`."""
        for kind in ("rawKeyDown", "keyUp") * times:
            code = KEYS[key]
            self("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def picture(self, path: Path, whole: bool = False) -> None:
        """Write a PNG of what is seen, or of the whole page."""
        data = self("Page.captureScreenshot", captureBeyondViewport=whole)["data"]
        path.write_bytes(b64decode(data))

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            piece = os.read(self._read, 1 << 20)
            assert piece, "the browser has ended"
            self._rest += piece
        text, _, self._rest = self._rest.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        self._hear(message.get("method"), message.get("params", {}))
        return message

    def _hear(self, method: str | None, told: Any) -> None:
        if method == "Runtime.exceptionThrown":
            details = told["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description") or details["text"])
        elif method == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(each.get("value", each)) for each in told["args"]))
        elif method == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
            self.errors.append(told["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.asked.append(told["request"]["url"].partition(":")[0])


def _pipe() -> tuple[int, int]:
    """Both ends of a pipe, whose numbers are beyond those that the browser uses."""
    ends = os.pipe()
    high = fcntl.fcntl(ends[0], fcntl.F_DUPFD_CLOEXEC, 20), fcntl.fcntl(ends[1], fcntl.F_DUPFD_CLOEXEC, 20)
    for end in ends:
        os.close(end)
    return high
