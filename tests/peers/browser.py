"""A headless Chromium, commanded by the DevTools protocol.

`with Browser("chromium") as browser:` is its first page, `browser.tab()` another one; whatever a page says of errors
(exceptions, its console, what its policy refused) is kept in its `errors`.
"""

import json
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path

from child import dies_with_its_parent
from websocket import create_connection

PATIENCE_S = 60.0
# As root Chromium needs the first; without a display server and a GPU the others.
WORDS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--remote-debugging-port=0"]


class Page:
    """One page."""

    def __init__(self):
        self.number = 0
        self.errors = []

    def connect(self, place):
        """Commands the page at that place from now on."""
        self.socket = create_connection(place, timeout=PATIENCE_S, suppress_origin=True)
        for domain in ("Runtime", "Page", "Log"):
            self.command(f"{domain}.enable")
        return self

    def command(self, method, **parameters):
        """A command of the protocol, and its result."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": parameters}))
        while True:
            said = json.loads(self.socket.recv())
            if said.get("id") == self.number:
                if "error" in said:
                    raise RuntimeError(f"{method}: {said['error']}")
                return said["result"]
            self._hear(said)

    def _hear(self, said):
        parameters = said.get("params", {})
        if said.get("method") == "Runtime.exceptionThrown":
            self.errors.append(parameters["exceptionDetails"].get("text", "an exception"))
        elif said.get("method") == "Runtime.consoleAPICalled" and parameters["type"] == "error":
            self.errors.append(str(parameters["args"]))
        elif said.get("method") == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.errors.append(parameters["entry"]["text"])

    def open(self, url):
        """Goes to a page."""
        self.command("Page.navigate", url=url)

    def value(self, script):
        """What a script in the page comes to."""
        result = self.command("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{script}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait_for(self, what, script):
        """Asks again until a script comes to something true; what that is. A page that is still loading lacks what
        the script names."""
        limit = time.monotonic() + PATIENCE_S
        while time.monotonic() < limit:
            if found := self.value(f"(() => {{ try {{ return {script} }} catch {{ return false }} }})()"):
                return found
            time.sleep(0.02)
        raise RuntimeError(f"waited {PATIENCE_S} s for {what}; the page says: {self.value('document.body.innerText')}")


class Browser(Page):
    """One process, and its first page."""

    def __init__(self, program):
        super().__init__()
        self.program = program

    def tab(self, in_window=False):
        """Another page, in a window of its own or in that of the first one, which it hides."""
        made = self.command("Target.createTarget", url="about:blank", newWindow=in_window)
        return Page().connect(f"ws://127.0.0.1:{self.port}/devtools/page/{made['targetId']}")

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="browser-")
        words = [self.program, *WORDS, f"--user-data-dir={self.folder.name}", "about:blank"]
        self.process = subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=dies_with_its_parent
        )
        try:
            port = self._port()
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=PATIENCE_S) as answer:
                (page,) = [it for it in json.load(answer) if it["type"] == "page"]
            self.port = port
            self.connect(page["webSocketDebuggerUrl"])
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        # Its helpers may still write.
        time.sleep(0.2)
        self.folder.cleanup()

    def _port(self):
        said = Path(self.folder.name) / "DevToolsActivePort"
        limit = time.monotonic() + PATIENCE_S
        while time.monotonic() < limit:
            if said.exists() and "\n" in (text := said.read_text()):
                return int(text.splitlines()[0])
            if self.process.poll() is not None:
                raise RuntimeError(f"{self.program} ended with {self.process.returncode}")
            time.sleep(0.05)
        raise RuntimeError(f"{self.program} did not say its port for {PATIENCE_S} s")
