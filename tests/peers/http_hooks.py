"""What schemathesis loads: it makes half of the valid requests mean something here, counts, and watches the axis.

A drawn name of an axis, a motion or a run is hardly ever one that there is, so that nearly every valid request would
be refused for its name. Half of them get one that was answered before, and half of the motions a target within a
little more than the travel. Invalid requests stay as they were drawn, and so does what is judged.
"""

import atexit
import json
import os
import random
import re
import urllib.request
from pathlib import Path

import schemathesis

from kept_machine import Truth

TASK = json.loads(os.environ["TRUESTAGE_JUDGED"])
# Soft limits by axis, in millimetres, and what motions can name.
LIMITS, TARGETS = TASK["limits_mm"], TASK["targets"]
AXES = list(TASK["axes"])
# What its truth is called, where it is that of one axis.
TRUE_AXIS = TASK["true_axis"]
# As long as a request is held back for an end, by the computer's clock.
WAIT_MAX_S = 0.3
# What the set-point may differ from a limit by in printing.
PRINTED_MM = 1e-9
# The true origin is not the one that was found, and the true place not that which the encoder knows.
TRUE_MM = 0.2
LOOK_EVERY = 20
NAMES = ("motions", "runs", "calibrations")
SHARE = 0.5


class Watch:
    """What was asked, what was seen."""

    def __init__(self):
        self.random = random.Random(TASK["seed"])
        self.truth = Truth(TASK["clock"])
        self.statuses = {}
        self.known = {name: [] for name in NAMES}
        self.lease = None
        self.ends = {}
        self.causes = {}
        self.beyond = []

    def count(self, status):
        """One more answer."""
        self.statuses[str(status)] = self.statuses.get(str(status), 0) + 1
        if sum(self.statuses.values()) % LOOK_EVERY == 0:
            self.look()

    def look(self):
        """Where the stage truly is. A zero looks for the limit switch, which lies beyond, and may be stopped there."""
        if not TRUE_AXIS:
            return
        mm = self.truth.position_mm()
        with urllib.request.urlopen(f"{TASK['url']}/v1/axes/{TRUE_AXIS}", timeout=30) as answer:
            axis = json.load(answer)
        if axis["homed"] and axis["state"] != "Homing":
            self.within("truth", TRUE_AXIS, mm, TRUE_MM)

    def within(self, what, axis, mm, more):
        """It is not beyond a soft limit by more than that."""
        low, high = LIMITS[axis]
        if not low - more <= mm <= high + more:
            self.beyond.append([what, axis, mm])

    def learn(self, value):
        """Names and set-points of an answer."""
        if isinstance(value, list):
            for each in value:
                self.learn(each)
        if not isinstance(value, dict):
            return
        point = value.get("set_point")
        if isinstance(point, dict) and value.get("name") in LIMITS and point["unit"] == "mm":
            self.within("set_point", value["name"], point["value"], PRINTED_MM)
        if value.get("state") in ("done", "stopped", "failed", "timed_out") and "id" in value:
            self.ends[value["id"]] = value["state"]
            if value["state"] == "failed":
                self.causes[value["id"]] = value["cause"]["cause"]
        for name, each in value.items():
            if name in LIMITS and isinstance(each, dict):
                self.learn({"name": name, **each})
            else:
                self.learn(each)

    def name(self, path, value):
        """Keeps what can be asked for again."""
        for kind in NAMES:
            if kind in path:
                for each in value if isinstance(value, list) else [value]:
                    name = each.get("id")
                    if name and name not in self.known[kind]:
                        self.known[kind].append(name)

    def report(self):
        """For whoever began schemathesis."""
        ends = {state: list(self.ends.values()).count(state) for state in set(self.ends.values())}
        seen = {"statuses": self.statuses, "ends": ends, "beyond": self.beyond[:10]}
        seen["causes"] = sorted(set(self.causes.values()))
        Path(TASK["report"]).write_text(json.dumps(seen))


WATCH = Watch()
atexit.register(WATCH.report)


def drawn_targets():
    """One of what motions can name here, to within a little more than its travel."""
    name = WATCH.random.choice(list(TARGETS))
    unit, low, high = TARGETS[name]
    value = WATCH.random.uniform(low - 1, high + 1)
    return {name: WATCH.random.choice([f"{value:.6f}{unit}", {"value": value, "unit": unit}])}


def meant(case):
    """A valid request becomes one that means something."""
    for kind in NAMES:
        names = WATCH.known[kind]
        if f"/{kind}/{{id}}" in case.path and names:
            case.path_parameters["id"] = WATCH.random.choice(names[-5:])
    if "{axis}" in case.path:
        case.path_parameters["axis"] = WATCH.random.choice(AXES)
    if not isinstance(case.body, dict):
        return
    if case.body.get("axis") is not None:
        case.body["axis"] = WATCH.random.choice(AXES)
    if "targets" in case.body:
        case.body["targets"] = drawn_targets()
        # Nothing corrects the axis, and most strangers are to get it moving.
        case.body["uncompensated"] = WATCH.random.random() < 0.9
        case.body["dead_man_ms"] = WATCH.random.choice([None, case.body.get("dead_man_ms")])


def with_lease(case):
    """As its holder asks; otherwise one lease refuses everything for an hour."""
    headers = dict(case.headers or {})
    if WATCH.lease:
        headers["Truestage-Lease"] = WATCH.lease
    case.headers = headers


def is_long(wait):
    """Whether it is a time that the service would wait for, and longer than anybody does here."""
    try:
        return WAIT_MAX_S < float(wait) <= 300
    except (TypeError, ValueError):
        return False


@schemathesis.hook
def before_call(_context, case, _kwargs):
    """Nobody waits for long; and see above."""
    if is_long((case.query or {}).get("wait_s")):
        case.query["wait_s"] = WAIT_MAX_S
    if case.meta is None or not case.meta.generation.mode.is_positive:
        return
    with_lease(case)
    if WATCH.random.random() < SHARE:
        meant(case)


@schemathesis.hook
def after_call(_context, case, response):
    """Counts and watches."""
    WATCH.count(response.status_code)
    if not re.search("json", response.headers.get("content-type", [""])[0]):
        return
    value = response.json()
    WATCH.learn(value)
    if response.status_code < 300:
        WATCH.name(case.path, value)
    if response.status_code == 200 and case.path == "/v1/lease":
        WATCH.lease = value.get("token")
