"""Runs the benchmark programs in turn and prints what they measured as one JSON object.

    measure.py bus PROGRAMS    SDO round trips, SYNC jitter and the cyclic engine on vcan0
    measure.py host PROGRAMS   corrections, rotary self-calibration, SYNC jitter without CAN, and
                               the cyclic engine on a pseudo-terminal
    measure.py load PROGRAMS   a service beside clients and floods, and beside the command line

PROGRAMS names the benchmark programs: {"sdo": path, "table": path, "rotary": path,
"volumetric": path, "sync": path, "cycle": path, "load": path, "truestage": path}.
The caller pins this process to one core, except for `load`; what it starts inherits that.
"""

import contextlib
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
INTERFACE = "vcan0"
QUICK = bool(os.environ.get("BENCH_QUICK"))

SDO_ROUNDS = 3 if QUICK else 21
ROUND_TRIPS = {"ours": 2000, "raw": 2000, "python": 400}

SYNC_ROUNDS = 1 if QUICK else 5
# As many frames as an unprivileged listener can keep until the end.
SYNC_COUNT = 400
BUS_PERIODS_US = [5000]
HOST_PERIODS_US = [2000, 5000]
FIFO_PRIORITY = 40

# Four axes; the first of these periods that the computer bears.
CYCLE_PERIODS_MS = ["2.0", "5.0", "10.0", "20.0"]
CYCLE_S = "5" if QUICK else "60"

# Of each kind by turns.
LOAD_TURN_S, LOAD_ROUNDS = ("4", "1") if QUICK else ("10", "5")

COUNTED_CALLS = 200_000
COUNTED = [("linear", 20), ("linear", 20_000), ("monotone cubic", 20), ("monotone cubic", 20_000)]


def run(command, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, **options)
    return json.loads(done.stdout)


@contextlib.contextmanager
def background(command):
    """A process that lives as long as the block."""
    process = subprocess.Popen(command)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def wait_for_server(client):
    """Returns when the server answers; the client waits for ever for a server that does not."""
    for _ in range(20):
        with contextlib.suppress(subprocess.TimeoutExpired):
            subprocess.run(client, timeout=5, check=True, stdout=subprocess.DEVNULL)
            return
    sys.exit("the SDO server does not answer")


def sdo(program):
    clients = {
        "ours": [program, "ours", INTERFACE],
        "raw": [program, "raw", INTERFACE],
        "python": [sys.executable, os.path.join(HERE, "python_client.py"), INTERFACE],
    }
    rates = {name: [] for name in clients}
    with background([program, "server", INTERFACE]):
        wait_for_server([*clients["raw"], "1"])
        for _ in range(SDO_ROUNDS):
            for name, command in clients.items():
                count = ROUND_TRIPS[name]
                rates[name].append(count / run([*command, str(count)])["seconds"])
    return {
        "rounds": SDO_ROUNDS,
        "round_trips_per_round": ROUND_TRIPS,
        "round_trips_per_s": {name: spread(values) for name, values in rates.items()},
        "ours_to_python": spread(ratios(rates, "ours", "python")),
        "ours_to_raw": spread(ratios(rates, "ours", "raw")),
    }


def ratios(rates, one, other):
    """Round by round, so that what disturbs a whole round disturbs no ratio."""
    return [mine / theirs for mine, theirs in zip(rates[one], rates[other])]


def spread(values):
    return {"median": statistics.median(values), "min": min(values), "max": max(values)}


def as_real_time():
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))


def real_time_is_allowed():
    try:
        subprocess.run(["true"], preexec_fn=as_real_time, check=True)
    except (OSError, subprocess.SubprocessError):
        return False
    return True


def load(busy):
    """One thread that never rests, on the same core."""
    spin = [sys.executable, "-c", "while True: pass"]
    return background(spin) if busy else contextlib.nullcontext()


def sync(program, sink, periods_us):
    senders = {"ours": ("ours", {}), "tokio": ("tokio", {})}
    if real_time_is_allowed():
        senders["tokio, SCHED_FIFO"] = ("tokio", {"preexec_fn": as_real_time})
    cases = [
        (name, period_us, busy)
        for period_us in periods_us
        for busy in (False, True)
        for name in senders
    ]
    runs = {case: [] for case in cases}
    for _ in range(SYNC_ROUNDS):
        for case in cases:
            name, period_us, busy = case
            sender, options = senders[name]
            command = [program, sender, sink, str(period_us), str(SYNC_COUNT)]
            with load(busy):
                runs[case].append(run(command, **options))
    return {
        "rounds": SYNC_ROUNDS,
        "frames_per_round": SYNC_COUNT,
        "cases": [judge_sync(case, runs[case]) for case in cases],
    }


def cycle(program, bus, cases):
    """The engine beside a tokio interval in the same process, on machines with and without load."""
    return [cycle_of(program, bus, machine, busy) for machine, busy in cases]


def cycle_of(program, bus, machine, busy):
    with load(busy):
        measured = run([program, "follow", machine, bus, CYCLE_S, *CYCLE_PERIODS_MS])
    return {"machine": machine, "bus": bus, "busy": busy} | measured


def judge_sync(case, runs):
    name, period_us, busy = case
    own = runs[0]["real_time"]
    return {
        "sender": name,
        "period_us": period_us,
        "busy": busy,
        "sched_fifo": "SCHED_FIFO" in name if own is None else own,
        "p50_us": statistics.median(run["p50_us"] for run in runs),
        "p99_us": statistics.median(run["p99_us"] for run in runs),
        "max_us": max(run["max_us"] for run in runs),
        "earliest_us": statistics.median(run["earliest_us"] for run in runs),
        "skipped": sum(run["skipped"] for run in runs),
    }


def instructions(program):
    """Instructions per call, as the difference of two runs; nothing without valgrind."""
    if not shutil.which("valgrind"):
        return []
    return [
        {"interpolation": name, "nodes": nodes, "instructions": per_call(program, name, nodes)}
        for name, nodes in COUNTED
    ]


def per_call(program, name, nodes):
    few, many = (
        count_instructions([program, "calls", name, str(nodes), str(calls)])
        for calls in (COUNTED_CALLS, 2 * COUNTED_CALLS)
    )
    return (many - few) / COUNTED_CALLS


def count_instructions(command):
    valgrind = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    done = subprocess.run([*valgrind, *command], stderr=subprocess.PIPE, text=True, check=True)
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


def main(place, programs):
    begin = time.monotonic()
    if place == "bus":
        measured = {
            "sdo": sdo(programs["sdo"]),
            "sync": sync(programs["sync"], INTERFACE, BUS_PERIODS_US),
            "cycle": cycle(
                programs["cycle"],
                INTERFACE,
                [("screws", False), ("screws", True), ("volumetric", False)],
            ),
        }
    elif place == "load":
        words = ["show", LOAD_TURN_S, LOAD_ROUNDS, programs["truestage"]]
        measured = run([programs["load"], *words])
    else:
        measured = {
            "table": run([programs["table"], "times"]),
            "rotary": run([programs["rotary"], "times"]),
            "volumetric": run([programs["volumetric"], "times"]),
            "table_instructions": instructions(programs["table"]),
            "sync": sync(programs["sync"], "pipe", HOST_PERIODS_US),
            "cycle": cycle(programs["cycle"], "pty", [("screws", False), ("screws", True)]),
            "cycle_cost": run([programs["cycle"], "cost"])["cases"],
            "virtual_time": run([programs["virtual_time"], "times"])["cases"],
        }
    measured["seconds"] = round(time.monotonic() - begin)
    print(json.dumps(measured))


main(sys.argv[1], json.loads(sys.argv[2]))
