"""GTC's answer to a budget that is kept place by place, from standard input to one line of JSON.

In: a budget as a calibration keeps it, and what it is of. Out: `record`, for each place its combined and
expanded standard uncertainty and its degrees of freedom by the contributions in the record; `again`, the
same from readings by themselves, for whatever the budget is of.
"""

import json
import math
import sys

import numpy
from GTC import dof, multiple_ureal, set_correlation, type_b, uncertainty, ureal, value
from scipy import stats


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


def of_screw(task):
    """Where a screw stops: its model by least squares over strokes that are all repeated alike.

    What a stroke's mean and the difference of its sides scatter are independent; each is widened so that twice
    it is exceeded as seldom as twice that of a normal distribution.
    """
    strokes, lines = task["strokes"], task["budget"]["contributions"]
    inputs = []
    count = len(strokes)
    for line in lines[:2]:
        freedom = line["degrees_of_freedom"]
        u = line["value"] * stats.t.isf(0.0455 / 2, freedom) / 2 / math.sqrt(2 * task["repeated"])
        inputs += multiple_ureal([0] * count, [u] * count, freedom)
    # The mean of both sides, and half their difference.
    design = [[1, s, 0.5] for s in strokes] + [[0, 0, 0.5] for _ in strokes]
    weights = numpy.linalg.pinv(numpy.array(design))
    stop = ureal(0, lines[2]["value"], lines[2]["degrees_of_freedom"])
    places = []
    for place in task["budget"]["places"]:
        row = numpy.array([1, place["at_si"][0], place["approach"] == "-"])
        places.append(told(combined(row @ weights, inputs) + stop))
    return places


def of_tool(task):
    """The length of a tool's deviation by what each reading, off by its standard uncertainty, moves it by."""
    lengths = []
    for pulls in task["pulls"]:
        readings = [ureal(0, 1) for _ in pulls[0]]
        each = [uncertainty(combined(row, readings)) for row in pulls]
        lengths.append(math.hypot(*each))
    return lengths


def of_zero(task):
    """Half-way between the means of the passes of either direction, which share one scatter, and a whole count.

    The scatter is widened so that twice it is exceeded as seldom as twice that of a normal distribution.
    """
    sides = [numpy.array(it) for it in task["origins"]]
    freedom = sum(len(it) - 1 for it in sides)
    squares = sum(((it - it.mean()) ** 2).sum() for it in sides)
    u = math.sqrt(squares / freedom) * stats.t.isf(0.0455 / 2, freedom) / 2
    origins = [float(it) for side in sides for it in side]
    inputs = multiple_ureal(origins, [u] * len(origins), freedom)
    weights = [1 / (2 * len(side)) for side in sides for _ in side]
    origin = combined(weights, inputs) + ureal(0, type_b.uniform(task["count"] / 2))
    return [value(origin), *told(origin)]


def of_now(task):
    """The tool along x, y and z, d + turn × tool, of errors and coefficients with a covariance, and of inputs by themselves."""
    known = task["covariance"]
    errors = [ureal(0, math.sqrt(own[k]), independent=False) for k, own in enumerate(known)]
    for i in range(len(known)):
        for k in range(i):
            correlation = known[i][k] / math.sqrt(known[i][i] * known[k][k])
            set_correlation(correlation, errors[i], errors[k])
    tx, ty, tz = task["tool"]
    dx, dy, dz, rx, ry, rz, *coefficients = errors
    moved = [dx + ry * tz - rz * ty, dy + rz * tx - rx * tz, dz + rx * ty - ry * tx]
    for k, warm in enumerate(task["warm"]):
        for pull, coefficient in zip(warm, coefficients):
            moved[k] = moved[k] + pull * coefficient
    for k, pulls in enumerate(task["pulls"]):
        for pull in pulls:
            moved[k] = moved[k] + ureal(0, abs(pull))
    return [uncertainty(it) for it in moved]


def main():
    task = json.load(sys.stdin)
    ways = {"table": of_table, "screw": of_screw, "tool": of_tool, "zero": of_zero, "now": of_now}
    again = ways[task["of"]](task)
    print(json.dumps({"record": of_record(task["budget"]), "again": again}), flush=True)


main()
