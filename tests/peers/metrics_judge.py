"""Prometheus' own library reads what `GET /metrics` says of an emulated linear machine in real time.

    metrics_judge.py PROGRAMS

PROGRAMS is the folder with `truestage` and `mock-bus`. The last line is a report in JSON: of each metric its kind, what
it is, and its samples as names with labels and value.
"""

import argparse
import json
import time

from prometheus_client.parser import text_string_to_metric_families

from kept_machine import KeptMachine

# Figures are taken once a second.
LIVED_S = 2.5


def read(text):
    """Each metric by its name; the library raises what it cannot read."""
    families = {}
    for family in text_string_to_metric_families(text):
        samples = [[it.name, it.labels, it.value] for it in family.samples]
        families[family.name] = {"kind": family.type, "what": family.documentation, "samples": samples}
    return families


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("programs", help="the folder with truestage and mock-bus")
    words = words.parse_args()
    with KeptMachine(words.programs, is_real_time=True) as kept:
        begun = kept.ask("GET", "/v1/machine")["clock_s"]
        while kept.ask("GET", "/v1/machine")["clock_s"] < begun + LIVED_S:
            time.sleep(0.05)
        print(json.dumps(read(kept.text("/metrics"))), flush=True)


main()
