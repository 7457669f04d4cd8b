"""Strangers judge the HTTP interface of `truestage serve` on an emulated machine.

    http_judges.py PROGRAMS [--machine NAME] [--requests N] [--seed N]

PROGRAMS is the folder with `truestage` and `mock-bus`. A client that openapi-python-client generates of
/openapi.json runs the cycle of the README; then schemathesis asks what its seeds draw, until it was at least N
requests. The last line is a report in JSON; the exit code is 0 only when nothing failed.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

from http_cycle import run_cycle
from kept_machine import KeptMachine

HERE = Path(__file__).resolve().parent
# So many examples of each operation come to some so many requests, with those of the other phases.
REQUESTS_BEFORE = 700
REQUESTS_EACH = 30
EXAMPLES_MAX = 60
# A stream without an end is no answer to somebody who waits for one: the service's own tests read it.
ENDLESS = "/v1/events"
RUN_S = 900


def generated(kept):
    """The folder of a client that nobody has touched."""
    description = kept.path / "openapi.json"
    description.write_text(json.dumps(kept.ask("GET", "/openapi.json")))
    words = ["--path", str(description), "--output-path", str(kept.path / "generated" / "truestage_client")]
    tool = Path(sys.executable).parent / "openapi-python-client"
    # It tidies up with a program beside it.
    there = os.environ | {"PATH": f"{tool.parent}{os.pathsep}{os.environ['PATH']}"}
    ended = subprocess.run(
        [str(tool), "generate", *words, "--meta", "none"], env=there, capture_output=True, text=True
    )
    said = ended.stdout + ended.stderr
    if ended.returncode != 0 or "WARNING" in said or "ERROR" in said:
        raise RuntimeError(f"openapi-python-client: expected a whole client, it said:\n{said}")
    return kept.path / "generated"


def examples(requests):
    """Of each operation, so that it comes to about so many requests."""
    return max(1, min(EXAMPLES_MAX, (requests - REQUESTS_BEFORE) // REQUESTS_EACH))


def asked_by_schemathesis(kept, requests, seed):
    """One run of it: how many answers of which status, and what it found."""
    report = kept.path / "judged.json"
    report.unlink(missing_ok=True)
    task = {"seed": seed, "limits_mm": kept.limits_mm, "targets": kept.targets(), "url": kept.url}
    task |= {"axes": [it["name"] for it in kept.ask("GET", "/v1/axes")], "clock": str(kept.clock), "report": str(report)}
    task["true_axis"] = "x" if kept.machine == "linear" else None
    there = os.environ | {
        "TRUESTAGE_JUDGED": json.dumps(task),
        "SCHEMATHESIS_HOOKS": "http_hooks",
        "PYTHONPATH": str(HERE),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    words = ["--config-file", str(HERE / "schemathesis.toml"), "run", f"{kept.url}/openapi.json"]
    words += ["--exclude-path", ENDLESS, "--checks", "all", "--seed", str(seed)]
    words += ["--max-examples", str(examples(requests)), "--generation-database", "none"]
    words += ["--continue-on-failure", "--warnings", "off", "--no-color", "--request-timeout", "30"]
    tool = Path(sys.executable).parent / "schemathesis"
    ended = subprocess.run(
        [str(tool), *words], env=there, cwd=kept.path, capture_output=True, text=True, timeout=RUN_S
    )
    seen = json.loads(report.read_text()) if report.exists() else {"statuses": {}, "ends": {}, "beyond": [], "causes": []}
    failures = len(re.findall(r"^- ", ended.stdout, re.MULTILINE))
    # What it could not judge is not good.
    seen["failures"] = failures or int(ended.returncode != 0)
    if seen["failures"]:
        print(f"seed {seed}:\n{ended.stdout}\n{ended.stderr}", file=sys.stderr)
    return seen


def added(total, more):
    """The sum of two counts by name."""
    return {key: total.get(key, 0) + more.get(key, 0) for key in total | more}


def judge(kept, requests, first_seed):
    """Seed after seed until it was enough."""
    total = {"requests": 0, "failures": 0, "statuses": {}, "ends": {}, "beyond": [], "causes": [], "seeds": []}
    seed = first_seed
    while total["requests"] < requests:
        seen = asked_by_schemathesis(kept, requests - total["requests"], seed)
        count = sum(seen["statuses"].values())
        total["requests"] += count
        total["failures"] += seen["failures"]
        total["statuses"] = added(total["statuses"], seen["statuses"])
        total["ends"] = added(total["ends"], seen["ends"])
        total["beyond"] += seen["beyond"]
        total["causes"] = sorted({*total["causes"], *seen["causes"]})
        total["seeds"].append(seed)
        print(f"seed {seed}: {count} requests, {seen['failures']} failures", file=sys.stderr, flush=True)
        if count == 0:
            break
        seed += 1
    return total


def zeroed(kept):
    """Every axis has its zero."""
    run = kept.ask("POST", "/v1/runs", {"kind": "zero", "start": True})
    while run["state"] == "running":
        run = kept.ask("GET", f"/v1/runs/{run['id']}?wait_s=30")
    if run["state"] != "done":
        raise RuntimeError(f"zero: expected that it is done, seen: {run}")


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("programs", help="the folder with truestage and mock-bus")
    words.add_argument("--requests", type=int, default=500, help="at least so many by schemathesis")
    words.add_argument("--seed", type=int, default=1, help="the first of its seeds")
    words.add_argument("--machine", default="linear", help="one of configs/machines")
    words = words.parse_args()
    with KeptMachine(words.programs, words.machine) as kept:
        # The README's cycle is that of a linear stage; others find their zero, so that they can move.
        cycle = run_cycle(generated(kept), kept.url) if words.machine == "linear" else zeroed(kept)
        report = judge(kept, words.requests, words.seed)
        report["alive"] = kept.ask("GET", "/healthz")["state"]
        report["ended_well"] = kept.end()
        report["set_points"], report["beyond_mm"] = kept.set_points()
    report["cycle"] = cycle
    print(json.dumps(report), flush=True)
    is_good = report["ended_well"] and report["beyond_mm"] == 0 and not report["beyond"]
    sys.exit(0 if is_good and report["failures"] == 0 else 1)


main()
