"""Prints what was measured: a table for people, then one JSON object on the last line.

`report.py VCAN_HOST HOST_JSON LOAD_JSON [BUS_JSON]`: VCAN_HOST says where vcan0 was; without BUS_JSON
nothing was measured there.
"""

import datetime
import json
import os
import platform
import sys

# The table that others would write, for comparison.
OTHER = "(bisected)"

POINT_GOALS_NS = {
    "model of splines": 80.0,
    "model of splines, inverse": 250.0,
}


def line(*cells):
    print("  " + "".join(f"{cell:<{width}}" for cell, width in cells).rstrip())


def show_sdo(sdo):
    print("\nSDO expedited upload on vcan0, round trips per second")
    for name, rate in sdo["round_trips_per_s"].items():
        span = f"{rate['min']:.0f} to {rate['max']:.0f}"
        line((name, 10), (f"{rate['median']:9.0f}", 12), (span, 0))
    for key, title in (("ours_to_python", "python-canopen"), ("ours_to_raw", "raw ping-pong")):
        ratio = sdo[key]
        span = f"{ratio['min']:.2f} to {ratio['max']:.2f}"
        line((f"ours / {title}", 24), (f"{ratio['median']:.2f}", 8), (span, 0))


def show_sync(title, sync):
    print(f"\nSYNC lateness in us, {title}")
    columns = ["p50", "p99", "max", "skipped", "earliest"]
    heads = ((name, 9) for name in columns)
    line(("sender", 20), ("period", 8), ("load", 7), ("FIFO", 6), *heads)
    for case in sync["cases"]:
        line(
            (case["sender"], 20),
            (f"{case['period_us'] // 1000} ms", 8),
            ("busy" if case["busy"] else "idle", 7),
            ("yes" if case["sched_fifo"] else "no", 6),
            *((f"{case[key]:.0f}", 9) for key in ("p50_us", "p99_us", "max_us", "skipped")),
            (f"{case['earliest_us']:.0f}", 0),
        )


def show_table(table, counts, growth):
    print("\nCorrection of one target, exact inverse included: ns per call, median (least)")
    counted = {(it["interpolation"], it["nodes"]): it["instructions"] for it in counts}
    line(("interpolation", 20), ("nodes", 8), ("in a row", 16), ("alone", 16), ("instructions", 0))
    for case in table["cases"]:
        instructions = counted.get((case["interpolation"], case["nodes"]))
        line(
            (case["interpolation"], 20),
            (case["nodes"], 8),
            *(
                (f"{case[key]:.1f} ({case[key + '_min']:.1f})", 16)
                for key in ("in_a_row_ns", "alone_ns")
            ),
            (f"{instructions:.0f}" if instructions else "", 0),
        )
    for name, ratio in growth.items():
        line((f"longest / shortest table, {name}: {ratio:.1f}", 0))


def show_rotary(rotary):
    print("\nRotary self-calibration: us for a whole evaluation, ms to plan the offsets")
    heads = ("solve", "least", "plan worst", "plan rms")
    line(("lines", 8), ("placements", 12), *((name, 12) for name in heads))
    for case in rotary["evaluations"]:
        line(
            (case["lines"], 8),
            (case["placements"], 12),
            *((f"{case[key]:.0f}", 12) for key in ("solve_us", "solve_us_min")),
            *((f"{case[key]:.0f}", 12) for key in ("plan_worst_ms", "plan_rms_ms")),
        )
    for case in rotary["set_points"]:
        time = f"{case['ns']:.1f} ({case['ns_min']:.1f}) ns"
        line((f"set-point of 3600 lines, {case['interpolation']}: {time}", 0))


def show_volumetric(volumetric):
    print("\nCorrection of a point of three axes: ns per point, median (least)")
    line(("case", 46), ("in a row", 18), ("alone", 0))
    for case in volumetric["cases"]:
        line(
            (case["case"], 46),
            *(
                (f"{case[key]:.1f} ({case[key + '_min']:.1f})", 18)
                for key in ("in_a_row_ns", "alone_ns")
            ),
        )


def show_cycle(title, cases):
    print(f"\nThe cyclic engine, {title}: lateness in us beside a tokio interval")
    columns = ("p50", "p99", "p999", "max")
    heads = [(name, 9) for name in columns]
    line(("", 8), ("load", 12), *heads, ("followed", 11), ("overruns", 10), ("stops", 0))
    for case in cases:
        load = "busy" if case["busy"] else "idle"
        line((f"{case['axes']} axes, {case['machine']}", 0))
        for name, key in (("ours", "lateness"), ("tokio", "tokio")):
            if name == "ours":
                load += f" {case['period_us'] / 1000:.0f} ms"
            cells = [(f"{case[key][column + '_us']:.0f}", 9) for column in columns]
            counted = [
                (f"{case['followed_s']:.0f} s", 11),
                (case["overruns"], 10),
                (sum(case["stops"].values()), 0),
            ]
            line((name, 8), (load, 12), *cells, *(counted if name == "ours" else []))
        line((f"  {case['scheduling']}", 0))
        for stop, count in case["stops"].items():
            line((f"  {count} times: {stop}", 0))


def show_cycle_cost(cases):
    print("\nA period of the cyclic engine apart from its bus: us, median (least)")
    for case in cases:
        line((case["case"], 46), (f"{case['us']:.1f} ({case['us_min']:.1f})", 0))


def show_virtual_time(cases):
    print("\nMachines in virtual time, every frame on their buses, by seconds of the processor")
    heads = ("lived", "processor", "times real time")
    line(("machine", 14), *((name, 14) for name in heads))
    for case in cases:
        line(
            (case["machine"], 14),
            (f"{case['lived_s']:.0f} s", 14),
            (f"{case['processor_s']:.2f} s", 14),
            (f"{case['times_real_time']:.0f}", 0),
        )


def show_load(load):
    print("\nA service: SYNC lateness in us, and ms from a command to its first frame")
    columns = ("SYNC p50", "p99", "lone p99", "left out", "to nothing", "frame p50", "p99", "max")
    line(("load", 12), *((name, 12) for name in columns))
    for turn in load["turns"]:
        frame = turn["command_to_frame_ms"]
        line(
            (turn["load"], 12),
            *((f"{turn[key]:.0f}", 12) for key in ("sync_p50_us", "sync_p99_us", "lone_p99_us", "left_out")),
            (f"{turn['p99_to_nothing']['median']:.2f}", 12),
            *((f"{frame[key]:.2f}", 12) for key in ("p50", "p99", "max")),
        )
    again = load["second_motion"]
    if again:
        times = ", ".join(f"{it:.1f}" for it in again["command_line_s"])
        line((f"a second motion: {again['service_s'] * 1e3:.2f} ms; by the command line {times} s", 0))


def growth_of(table):
    """How much longer a call takes in the longest table than in the shortest, in a row."""
    least = {}
    for case in table["cases"]:
        least.setdefault(case["interpolation"], []).append(case["in_a_row_ns_min"])
    return {name: times[-1] / times[0] for name, times in least.items()}


def goals_of(measured):
    ours = [case for case in measured["host"]["table"]["cases"] if case["interpolation"] != OTHER]
    slowest = max(case["in_a_row_ns"] for case in ours)
    largest = measured["host"]["rotary"]["evaluations"][-1]
    goals = {
        "set_point_ns": {"measured": slowest, "at_most": 40.0},
        "rotary_solve_us": {"measured": largest["solve_us"], "at_most": 1000.0},
    }
    points = {case["case"]: case["in_a_row_ns"] for case in measured["host"]["volumetric"]["cases"]}
    for name, at_most in POINT_GOALS_NS.items():
        goals[name] = {"measured": points[name], "at_most": at_most}
    speeds = {it["machine"]: it["times_real_time"] for it in measured["host"]["virtual_time"]}
    goals["linear_stage_in_virtual_time"] = {"measured": speeds["linear"], "at_least": 1000.0}
    turns = {turn["load"]: turn for turn in measured["load"]["turns"]}
    for name in ("clients", "flood"):
        ratio = turns[name]["p99_to_nothing"]["median"]
        goals[f"sync_p99_{name}_to_nothing"] = {"measured": ratio, "at_most": 1.1}
    frames = max(turns[name]["command_to_frame_ms"]["p99"] for name in ("clients", "flood"))
    limit = measured["load"]["command_to_frame_limit_ms"]
    goals["command_to_frame_p99_ms"] = {"measured": frames, "at_most": limit}
    if "bus" in measured:
        ratio = measured["bus"]["sdo"]["ours_to_python"]["median"]
        goals["ours_to_python"] = {"measured": ratio, "at_least": 5.0}
    return goals


def main(vcan_host, host_file, load_file, bus_file=None):
    measured = {
        "date": datetime.date.today().isoformat(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "vcan": vcan_host,
    }
    with open(host_file, encoding="utf-8") as file:
        measured["host"] = json.load(file)
    with open(load_file, encoding="utf-8") as file:
        measured["load"] = json.load(file)
    measured["growth"] = growth_of(measured["host"]["table"])
    show_table(
        measured["host"]["table"], measured["host"]["table_instructions"], measured["growth"]
    )
    show_rotary(measured["host"]["rotary"])
    show_volumetric(measured["host"]["volumetric"])
    show_sync("on the host, without CAN", measured["host"]["sync"])
    show_cycle("on a pseudo-terminal", measured["host"]["cycle"])
    show_cycle_cost(measured["host"]["cycle_cost"])
    show_virtual_time(measured["host"]["virtual_time"])
    show_load(measured["load"])
    if bus_file:
        with open(bus_file, encoding="utf-8") as file:
            measured["bus"] = json.load(file)
        show_sdo(measured["bus"]["sdo"])
        show_sync(f"vcan0 ({vcan_host})", measured["bus"]["sync"])
        show_cycle(f"vcan0 ({vcan_host})", measured["bus"]["cycle"])
    measured["goals"] = goals_of(measured)
    print()
    print(json.dumps(measured))


main(*sys.argv[1:])
