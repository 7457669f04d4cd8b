"""Prints what was measured: a table for people, then one JSON object on the last line.

`report.py VCAN_HOST HOST_JSON [BUS_JSON]`: VCAN_HOST says where vcan0 was; without BUS_JSON
nothing was measured there.
"""

import datetime
import json
import os
import platform
import sys

GOALS = {"ours_to_python": 5.0, "set_point_ns": 40.0}


def line(*cells):
    print("  " + "".join(f"{cell:<{width}}" for cell, width in cells).rstrip())


def show_sdo(sdo):
    print("\nSDO expedited upload on vcan0, round trips per second")
    for name, rate in sdo["round_trips_per_s"].items():
        line((name, 10), (f"{rate['median']:9.0f}", 12), (f"{rate['min']:.0f} to {rate['max']:.0f}", 0))
    line((f"ours / python-canopen = {sdo['ours_to_python']:.1f} (goal: at least 5)", 0))
    line((f"ours / raw ping-pong  = {sdo['ours_to_raw']:.2f}", 0))


def show_sync(title, sync):
    print(f"\nSYNC lateness in us, {title}")
    line(("sender", 20), ("period", 8), ("load", 7), ("FIFO", 6), ("p50", 9), ("p99", 9), ("max", 9), ("skipped", 9), ("earliest", 0))
    for case in sync["cases"]:
        line(
            (case["sender"], 20),
            (f"{case['period_us'] // 1000} ms", 8),
            ("busy" if case["busy"] else "idle", 7),
            ("yes" if case["sched_fifo"] else "no", 6),
            *((f"{case[key]:.0f}", 9) for key in ("p50_us", "p99_us", "max_us", "skipped")),
            (f"{case['earliest_us']:.0f}", 0),
        )


def show_table(table, counts):
    print("\nCorrection of one target, exact inverse included, ns per call (goal: at most 40)")
    counted = {(it["interpolation"], it["nodes"]): it["instructions"] for it in counts}
    line(("interpolation", 20), ("nodes", 8), ("in a row", 10), ("alone", 10), ("instructions", 0))
    for case in table["cases"]:
        instructions = counted.get((case["interpolation"], case["nodes"]))
        line(
            (case["interpolation"], 20),
            (case["nodes"], 8),
            (f"{case['apart_ns']:.1f}", 10),
            (f"{case['chained_ns']:.1f}", 10),
            (f"{instructions:.0f}" if instructions else "", 0),
        )


def judge(measured):
    slowest = max(case["chained_ns"] for case in measured["host"]["table"]["cases"])
    goals = {"set_point_ns": {"measured": slowest, "at_most": GOALS["set_point_ns"]}}
    if "bus" in measured:
        ratio = measured["bus"]["sdo"]["ours_to_python"]
        goals["ours_to_python"] = {"measured": ratio, "at_least": GOALS["ours_to_python"]}
    return goals


def main(vcan_host, host_file, bus_file=None):
    measured = {
        "date": datetime.date.today().isoformat(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "vcan": vcan_host,
    }
    with open(host_file, encoding="utf-8") as file:
        measured["host"] = json.load(file)
    show_table(measured["host"]["table"], measured["host"]["table_instructions"])
    show_sync("on the host, without CAN", measured["host"]["sync"])
    if bus_file:
        with open(bus_file, encoding="utf-8") as file:
            measured["bus"] = json.load(file)
        show_sdo(measured["bus"]["sdo"])
        show_sync(f"vcan0 ({vcan_host})", measured["bus"]["sync"])
    measured["goals"] = judge(measured)
    print()
    print(json.dumps(measured))


main(*sys.argv[1:])
