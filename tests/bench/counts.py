"""Compares counts of instructions with those in a file of JSON lines.

counts.py PROFILE FILE [--write]: reads gungraun's summaries, a JSON object a line, prints a table, and ends with exit
code 1 where a count is more than 3 % above the one that FILE has for the same compiler, profile and libc.
"""

import json
import platform
import subprocess
import sys

MARGIN = 1.03
# Simulated seconds of a cycle: its log is pinned, so that its time does not change either.
SIMULATED_S = {
    "cycle linear": 106.7,
    "cycle uvw": 182.2,
    "cycle uvw_copley": 187.6,
    "cycle rotary": 127.3,
    "day volumetric": 7569.4,
    "wait second": 1.0,
}


def key(profile):
    said = subprocess.run(["rustc", "-vV"], check=True, capture_output=True, text=True).stdout
    lines = dict(line.split(": ", 1) for line in said.splitlines() if ": " in line)
    libc = " ".join(platform.libc_ver())
    return {"rustc": lines["release"], "target": lines["host"], "profile": profile, "libc": libc}


def count(summary):
    profile = next(it for it in summary["profiles"] if it["tool"] == "Callgrind")
    (part,) = profile["data"]["parts"]
    return f"{summary['function_name']} {summary['id']}", int(part["metrics"]["Ir"]["values"]["new"])


def main():
    profile, path, *words = sys.argv[1:]
    here = key(profile)
    counts = dict(count(json.loads(line)) for line in sys.stdin if line.startswith("{"))
    if not counts:
        sys.exit("nothing was counted")
    with open(path, encoding="utf-8") as file:
        lines = [json.loads(line) for line in file]
    own = {line["name"]: line["instructions"] for line in lines if line["key"] == here}
    grown = []
    for name, now in counts.items():
        before = own.get(name)
        beside = f"{now / before - 1:+8.2%}" if before else ""
        second = f"{now / SIMULATED_S[name] / 1e6:8.2f} M/s" if name in SIMULATED_S else ""
        print(f"{name:42} {now:15,} {beside:9} {second}")
        if before and now > MARGIN * before:
            grown.append(name)
    if "--write" in words:
        kept = [line for line in lines if line["key"] != here or line["name"] not in counts]
        kept += [{"key": here, "name": name, "instructions": now} for name, now in counts.items()]
        with open(path, "w", encoding="utf-8") as file:
            file.writelines(json.dumps(line) + "\n" for line in kept)
        return
    if not own:
        print("no counts are written down for", json.dumps(here))
    if grown:
        sys.exit("more than 3 % above what is written down: " + ", ".join(grown))


main()
