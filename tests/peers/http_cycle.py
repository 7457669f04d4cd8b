"""The cycle of the README by a client that openapi-python-client has generated, as it came out."""

import importlib
import sys

WAIT_S = 120
TARGET_MM = 12.5
WITHIN_MM = 0.001
# By the clock of an emulated machine that runs ahead, so that it holds over the whole cycle.
LEASE_S = 3600
WHO = "generated"


class Cycle:
    """The generated package, and how its functions are called."""

    def __init__(self, url):
        self.api = "truestage_client.api"
        self.models = importlib.import_module("truestage_client.models")
        package = importlib.import_module("truestage_client")
        self.client = package.Client(base_url=url, timeout=2 * WAIT_S, raise_on_unexpected_status=True)
        self.lease = {}

    def call(self, name, *words, **more):
        """One request, which must be answered with what was asked for."""
        function = importlib.import_module(f"{self.api}.{name}").sync
        answer = function(*words, client=self.client, **more)
        if answer is None or isinstance(answer, self.models.ProblemBody):
            raise RuntimeError(f"{name}: expected what was asked for, it was refused: {answer}")
        return answer

    def order(self, name, *words, **more):
        """Likewise, as the holder of the lease."""
        return self.call(name, *words, truestage_client=WHO, **self.lease, **more)

    def take_lease(self):
        """Nobody else commands from now on."""
        request = self.models.LeaseRequest(name=WHO, seconds=LEASE_S)
        self.lease = {"truestage_lease": self.order("machine.lease", body=request).token}

    def run(self, kind, **more):
        """Plans a run, starts it, waits for its end."""
        request = self.models.RunRequest(kind=self.models.RunKind(kind), axis="x", **more)
        planned = self.order("runs.plan", body=request)
        expect(f"{kind}, planned", planned.state, self.models.RunState.PLANNED)
        self.order("runs.start", planned.id)
        ended = self.call("runs.run", planned.id, wait_s=float(WAIT_S))
        expect(f"{kind}: {ended.cause}", ended.state, self.models.RunState.DONE)
        return ended.result.to_dict()

    def move(self):
        """To a target that is a text, and to one with value and unit."""
        value, unit = self.models.PlaceValue, self.models.PlaceValueUnit
        for target in ("0mm", value(value=TARGET_MM, unit=unit("mm"))):
            targets = self.models.MoveRequestTargets.from_dict({})
            targets["x"] = target
            begun = self.order("motions.begin", body=self.models.MoveRequest(targets=targets))
            ended = self.call("motions.motion", begun.id, wait_s=float(WAIT_S))
            expect(f"motion: {ended.cause}", ended.state, self.models.MotionState.DONE)

    def position_mm(self):
        """Corrected, with its uncertainty."""
        axis = self.call("machine.axis", "x")
        if not axis.corrected or axis.standard_uncertainty is None:
            raise RuntimeError(f"axis x: expected a corrected position with its uncertainty, seen: {axis}")
        if abs(axis.position.value - TARGET_MM) > WITHIN_MM:
            raise RuntimeError(f"axis x: expected {TARGET_MM} mm, seen: {axis.position}")
        return axis.position.value

    def stop(self):
        """With what says how, and the lease given back."""
        request = self.models.StopRequest(mode=self.models.StopMode("controlled"))
        if not self.order("machine.stop", body=request).done:
            raise RuntimeError("stop: expected that it was done, it was not")
        self.order("machine.release")


def expect(what, seen, expected):
    """One state and no other."""
    if seen != expected:
        raise RuntimeError(f"{what}: expected {expected}, seen: {seen}")


def run_cycle(folder, url):
    """Lease, zero, calibrate, verify, move, read, stop; what came of it."""
    sys.path.insert(0, str(folder))
    cycle = Cycle(url)
    cycle.take_lease()
    zero = cycle.run("zero")
    calibrated = cycle.run("calibrate")
    verified = cycle.run("verify")
    cycle.move()
    position = cycle.position_mm()
    cycle.stop()
    return {
        "origin_um": zero["origin_um"],
        "calibration": calibrated["calibration"],
        "is_verified": verified["within_tolerance"],
        "position_mm": position,
    }
