"""An emulated machine in lockstep, or in real time, kept by `truestage serve` at a port of this computer.

`with KeptMachine(programs, machine, seed) as kept:`; all files are in a temporary folder. What was sent on the buses is
recorded, so that afterwards each set-point can be judged, whatever the service said of it.
"""

import json
import re
import socket
import subprocess
import tempfile
import threading
import time
import tomllib
import urllib.error
import urllib.request
from pathlib import Path

from child import dies_with_its_parent

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
# How long anything is waited for; only a broken run takes so long.
PATIENCE_S = 60.0
# What is written to the drive's mode of operation (0x6060): 1 goes to set-points, 6 looks for the limit switch.
# And its RPDO: control word, then a position in counts, which counts as soon as bit 4 of the word is set.
SENT = re.compile(rb" can0 (?:60(.)#2F606000(..)|20(.)#(..)..(.{8}))[0-9A-F]* T$", re.MULTILINE)
TO_SET_POINTS = 1
NEW_SET_POINT = 1 << 4
# A zero that is found is this far from the drive's own at most.
ORIGIN_MM = 0.2
PIECE = 1 << 24
# While a person acts, the machine's time passes at a fifth of the wall's, so that a lease of ten seconds outlives a click
# on however busy a computer; while a run is under way, as fast as the computer can.
STEP_NS = 2_000_000
PAUSE_S = 0.01
STRIDE_NS = 1_000_000_000
# Fewer measurements than the shipped ones: they are not what is judged.
SHORTER = (("runs = 3", "runs = 2"), ("targets = 8\nruns = 5", "targets = 4\nruns = 2"))
# By the computer's clock a request is late that is not by the machine's, whose clock runs ahead.
PATIENT = (re.compile(r"move_timeout_s = [0-9.]+"), "move_timeout_s = 100000.0")


def edited(text, machine, changes):
    """The configuration of a machine as it is kept; a change that finds nothing would prove nothing."""
    for old, new in (*(SHORTER if machine == "linear" else ()), *changes):
        if old not in text:
            raise RuntimeError(f"configs/machines/{machine}.toml: expected `{old}`, it is not there")
        text = text.replace(old, new)
    return PATIENT[0].sub(PATIENT[1], text)


class KeptMachine:
    """Two processes and their folder."""

    def __init__(self, programs, machine="linear", seed=51, is_real_time=False, changes=()):
        self.programs = Path(programs).resolve()
        self.changes = changes
        self.machine = machine
        self.seed = seed
        self.is_real_time = is_real_time
        self.processes = []

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="kept-")
        self.path = Path(self.folder.name)
        try:
            ports = self._emulate()
            self._serve(ports)
            self.limits_mm = self._soft_limits()
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

    def text(self, path):
        """What is there, as it is."""
        with urllib.request.urlopen(self.url + path, timeout=PATIENCE_S) as answer:
            return answer.read().decode()

    def set_points(self):
        """How many set-points drives were sent, and how far they lie beyond the soft limits, in millimetres."""
        count, beyond = 0, 0.0
        nodes = self._nodes()
        for node, counts in recorded(self.path / "recording.log"):
            count += 1
            if node in nodes:
                (low, high), counts_per_mm = nodes[node]
                mm = counts / counts_per_mm
                beyond = max(beyond, low - mm, mm - high)
        return count, max(0.0, beyond - ORIGIN_MM)

    def _nodes(self):
        """Of each drive with soft limits: these, and its counts per millimetre, by its node."""
        axes = tomllib.loads((self.path / "machine.toml").read_text()).get("axis", {})
        on_can = {name: it for name, it in axes.items() if "node_id" in it and name in self.limits_mm}
        return {it["node_id"]: (self.limits_mm[name], 1e6 / it["resolution_nm"]) for name, it in on_can.items()}

    def _emulate(self):
        emulated = CONFIGS / "emulated" / f"{self.machine}.toml"
        time = ["--speed", "1"] if self.is_real_time else ["--clock", "lockstep:clock", "--outlive"]
        words = ["--seed", str(self.seed), *time]
        words += ["--slcan", "can0"] if 'name = "can0"' in emulated.read_text() else []
        count = emulated.read_text().count("[[ports]]")
        named = dict(line.split(": ", 1) for line in self._start(count, "mock-bus", str(emulated), *words))
        configured = (CONFIGS / "machines" / f"{self.machine}.toml").read_text()
        known = {name: place for name, place in named.items() if f".{name}]" in configured}
        return {name: place.replace(" ", ":") for name, place in known.items()}

    def _serve(self, ports):
        text = (CONFIGS / "machines" / f"{self.machine}.toml").read_text()
        (self.path / "machine.toml").write_text(edited(text, self.machine, self.changes))
        self.words = [] if self.is_real_time else ["--clock", "lockstep:clock"]
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
                [str(self.programs / name), *words],
                cwd=self.path,
                stdout=log,
                stderr=log,
                preexec_fn=dies_with_its_parent,
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
        """Of each axis that has some, in millimetres."""
        axes = [it for it in self.ask("GET", "/v1/axes") if it["soft_min"]]
        return {it["name"]: (it["soft_min"]["value"], it["soft_max"]["value"]) for it in axes}

    def targets(self):
        """What a motion can name here: each with its unit, and from where to where it is worth trying."""
        axes = {it["name"]: it for it in self.ask("GET", "/v1/axes")}
        named = {}
        for name, axis in axes.items():
            named[name] = ("mm", *self.limits_mm[name]) if axis["soft_min"] else ("deg", -400.0, 400.0)
        for group in self.ask("GET", "/v1/machine")["groups"]:
            for name in group["targets"]:
                named.setdefault(name, ("arcsec", -600.0, 600.0) if name == "theta" else ("mm", -4.0, 4.0))
        return named


class Pace:
    """Somebody at the machine's clock who lets time pass slowly, or does not hold it back."""

    def __init__(self, clock):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(PATIENCE_S)
        self.socket.connect(str(clock))
        self.lines = self.socket.makefile()
        self.now = int(self._asked("hello 1 0 a pace").split()[1])
        self.slow = True
        self.over = False
        self.thread = threading.Thread(target=self._hold, daemon=True)
        self.thread.start()

    def _asked(self, line):
        self.socket.sendall(f"{line}\n".encode())
        return self.lines.readline()

    def _hold(self):
        while not self.over:
            step = STEP_NS if self.slow else STRIDE_NS
            self.now = int(self._asked(f"idle {self.now + step}").split()[1])
            if self.slow:
                time.sleep(PAUSE_S)

    def end(self):
        """Takes leave."""
        self.over = True
        self.thread.join(PATIENCE_S)
        self.socket.sendall(b"bye\n")
        self.socket.close()


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
    """Each set-point of a recording: for which node, in counts, as often as it was sent."""
    rest, modes = b"", {}
    with path.open("rb") as file:
        while piece := file.read(PIECE):
            whole, end, rest = (rest + piece).rpartition(b"\n")
            for told, now, node, word, counts in SENT.findall(whole + end):
                if told:
                    modes[told] = int(now, 16)
                elif modes.get(node) == TO_SET_POINTS and int(word, 16) & NEW_SET_POINT:
                    yield int(node, 16), int.from_bytes(bytes.fromhex(counts.decode()), "little", signed=True)


def wait_for(what, is_so):
    """Asks again until it is so."""
    limit = time.monotonic() + PATIENCE_S
    while time.monotonic() < limit:
        if is_so():
            return
        time.sleep(0.01)
    raise RuntimeError(f"waited {PATIENCE_S} s for {what}")
