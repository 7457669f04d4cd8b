"""GTC's answer to a budget that is kept place by place, from standard input to one line of JSON.

In: a budget as a calibration keeps it, and what it is of. Out: `record`, for each place its combined and
expanded standard uncertainty and its degrees of freedom by the contributions in the record; `again`, the
same from readings by themselves, for whatever the budget is of.
"""

import json
import math
import sys

import numpy
from GTC import dof, multiple_ureal, uncertainty, ureal


def freedom_of(value):
    """Degrees of freedom as JSON has them: null for infinitely many."""
    return None if value is None or math.isinf(value) else value


def told(result):
    return [uncertainty(result), freedom_of(dof(result))]


def of_record(budget):
    """Each place by its sensitivities."""
    lines = budget["contributions"]
    inputs = [ureal(0, it["value"], it["degrees_of_freedom"] or math.inf) for it in lines]
    places = []
    for place in budget["places"]:
        terms = zip(place["sensitivities"], inputs)
        u, freedom = told(sum((c * it for c, it in terms), ureal(0, 0)))
        places.append([u, budget["coverage_factor"] * u, freedom])
    return places


def combined(weights, readings):
    return sum((float(c) * it for c, it in zip(weights, readings)), ureal(0, 0))


def of_table(task):
    """The errors of a rotary table by least squares over all readings, which share one scatter."""
    lines, offsets = task["lines"], task["offsets"]
    design = numpy.zeros((lines * len(offsets), 2 * lines + len(offsets)))
    for placement, offset in enumerate(offsets):
        for line in range(lines):
            row = design[placement * lines + line]
            row[(line + offset) % lines] = 1
            row[lines + line] = 1
            row[2 * lines + placement] = 1
    kept = [at for at in range(len(design)) if at not in task["missing"]]
    weights = numpy.linalg.pinv(design[kept])[:lines]
    weights -= weights.mean(axis=0)
    readings = multiple_ureal([0] * len(kept), [task["scatter"]] * len(kept), task["freedom"])
    return [told(combined(row, readings)) for row in weights]


def main():
    task = json.load(sys.stdin)
    again = {"table": of_table}[task["of"]](task)
    print(json.dumps({"record": of_record(task["budget"]), "again": again}), flush=True)


main()
