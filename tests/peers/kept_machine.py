"""An emulated linear machine in lockstep, kept by `truestage serve` at a port of this computer.

`with KeptMachine(programs, seed) as kept:`; all files are in a temporary folder. What was sent on the buses is
recorded, so that afterwards each set-point can be judged, whatever the service said of it.
"""

import json
import re
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
# How long anything is waited for; only a broken run takes so long.
PATIENCE_S = 60.0
# What is written to the drive's mode of operation (0x6060): 1 goes to set-points, 6 looks for the limit switch.
# And its RPDO: control word, then a position in counts of 10 nm, which counts as soon as bit 4 of the word is set.
SENT = re.compile(rb" can0 (?:601#2F606000(..)|201#(..)..(.{8}))[0-9A-F]* T$", re.MULTILINE)
TO_SET_POINTS = 1
NEW_SET_POINT = 1 << 4
COUNTS_PER_MM = 100_000
# The zero that the Hall sensors find is this far from the drive's own at most.
ORIGIN_MM = 0.2
PIECE = 1 << 24
# Fewer measurements than the shipped ones: they are not what is judged.
SHORTER = (("runs = 3", "runs = 2"), ("targets = 8\nruns = 5", "targets = 4\nruns = 2"))
# By the computer's clock a request is late that is not by the machine's, whose clock runs ahead.
PATIENT = (("move_timeout_s = 10.0", "move_timeout_s = 100000.0"),)


def edited(text, changes):
    """The text with each change made; one that finds nothing would prove nothing."""
    for old, new in changes:
        if old not in text:
            raise RuntimeError(f"configs/machines/linear.toml: expected `{old}`, it is not there")
        text = text.replace(old, new)
    return text


class KeptMachine:
    """Two processes and their folder."""

    def __init__(self, programs, seed=51):
        self.programs = Path(programs).resolve()
        self.seed = seed
        self.processes = []

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="kept-")
        self.path = Path(self.folder.name)
        try:
            ports = self._emulate()
            self._serve(ports)
            self.soft_mm = self._soft_limits()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for process in reversed(self.processes):
            process.terminate()
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.processes = []
        self.folder.cleanup()

    @property
    def clock(self):
        """The socket of the emulator's clock."""
        return self.path / "clock"

    def end(self):
        """Ends the service as a person does; whether it ended well."""
        service = self.processes.pop()
        service.terminate()
        return service.wait(PATIENCE_S) == 0

    def ask(self, method, path, body=None):
        """A request that must not fail, and its answer."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data, method=method)
        request.add_header("Content-Type", "application/json")
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as error:
            raise RuntimeError(f"{method} {path}: {error.code}: {error.read()!r}") from error

    def set_points(self):
        """How many set-points the drive was sent, and how far they lie beyond the soft limits, in millimetres."""
        count, beyond = 0, 0.0
        low, high = self.soft_mm
        for counts in recorded(self.path / "recording.log"):
            count += 1
            mm = counts / COUNTS_PER_MM
            beyond = max(beyond, low - mm, mm - high)
        return count, max(0.0, beyond - ORIGIN_MM)

    def _emulate(self):
        emulated = CONFIGS / "emulated" / "linear.toml"
        words = ["--seed", str(self.seed), "--clock", "lockstep:clock", "--outlive", "--slcan", "can0"]
        count = emulated.read_text().count("[[ports]]")
        named = dict(line.split(": ", 1) for line in self._start(count, "mock-bus", str(emulated), *words))
        return {"can0": named["can0"].replace(" ", ":"), "laser": named["laser"]}

    def _serve(self, ports):
        text = (CONFIGS / "machines" / "linear.toml").read_text()
        (self.path / "machine.toml").write_text(edited(text, SHORTER + PATIENT))
        self.words = ["--clock", "lockstep:clock"]
        for name, place in ports.items():
            self.words += ["--port", f"{name}={place}"]
        self._listen("tcp:127.0.0.1:0", "--record", "recording.log")

    def _listen(self, place, *more):
        (line,) = self._start(1, "truestage", "serve", "machine.toml", "--listen", place, *self.words, *more)
        self.url = "http://" + line.rsplit("tcp:", 1)[1]

    def kill_service(self):
        """The service is gone, without a word to anybody."""
        service = self.processes.pop()
        service.kill()
        service.wait()

    def serve_again(self):
        """Another service, at the same place."""
        self._listen("tcp:" + self.url.removeprefix("http://"))

    def _start(self, count, name, *words):
        """Starts a program; the first lines that it says."""
        said = self.path / f"{name}.log"
        with said.open("w") as log:
            process = subprocess.Popen(
                [str(self.programs / name), *words], cwd=self.path, stdout=log, stderr=log
            )
        self.processes.append(process)
        wait_for(
            f"{name} to say where it is found",
            lambda: said.read_text().count("\n") >= count or process.poll() is not None,
        )
        lines = said.read_text().splitlines()[:count]
        if process.poll() is not None:
            raise RuntimeError(f"{name} ended with {process.returncode}: {' '.join(lines)}")
        return lines

    def _soft_limits(self):
        axis = self.ask("GET", "/v1/axes/x")
        return axis["soft_min"]["value"], axis["soft_max"]["value"]


class Truth:
    """Where the emulated stage truly stands, asked as a hand at the machine asks."""

    def __init__(self, clock):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(PATIENCE_S)
        self.socket.connect(str(clock))
        self.lines = self.socket.makefile()

    def position_mm(self):
        """In millimetres from the true origin."""
        self.socket.sendall(b"do truth\n")
        word, _, text = self.lines.readline().partition(" ")
        if word != "done":
            raise RuntimeError(f"the emulator said `{word} {text.strip()}`, expected its truth")
        return json.loads(text)["position_mm"]


def recorded(path):
    """Each set-point of a recording, in counts, as often as it was sent."""
    rest, mode = b"", None
    with path.open("rb") as file:
        while piece := file.read(PIECE):
            whole, end, rest = (rest + piece).rpartition(b"\n")
            for now, word, counts in SENT.findall(whole + end):
                mode = int(now, 16) if now else mode
                if not now and mode == TO_SET_POINTS and int(word, 16) & NEW_SET_POINT:
                    yield int.from_bytes(bytes.fromhex(counts.decode()), "little", signed=True)


def wait_for(what, is_so):
    """Asks again until it is so."""
    limit = time.monotonic() + PATIENCE_S
    while time.monotonic() < limit:
        if is_so():
            return
        time.sleep(0.01)
    raise RuntimeError(f"waited {PATIENCE_S} s for {what}")
