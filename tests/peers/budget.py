"""GTC's answers to uncertainty budgets, from standard input to one line of JSON.

In: of each its contributions, calibrated positions, places and pairs of places. Out: for each place its combined
standard uncertainty and its degrees of freedom (null for infinitely many), for each pair its covariance.
GTC is the uncertainty calculator of the Measurement Standards Laboratory of New Zealand.
"""

import json
import math
import sys

from GTC import dof, get_covariance, uncertainty, ureal

SIDES = "+-"


def real(line):
    """A contribution's input, with the degrees of freedom that it has."""
    freedom = line["degrees_of_freedom"]
    return ureal(0, line["value"], math.inf if freedom is None else freedom)


class Axis:
    """Inputs of their own wherever they are independent."""

    def __init__(self, task):
        self.lines = task["contributions"]
        self.positions = task["positions"]
        self.common = [real(line) for line in self.lines]
        intervals = range(len(self.positions))
        self.curves = [[real(line) for _ in intervals] for line in self.lines]
        self.scatters = [{side: [real(line) for _ in intervals] for side in SIDES} for line in self.lines]

    def interval(self, x):
        """The position before x, and the share of the one after it."""
        after = next(i for i, it in enumerate(self.positions) if it >= x and i > 0)
        low, high = self.positions[after - 1], self.positions[after]
        return after - 1, (x - low) / (high - low)

    def value(self, x, side, pooled):
        """The deviation at x, whose scatter is one pooled estimate where its freedom is asked for."""
        before, share = self.interval(x)
        total = ureal(0, 0)
        for at, line in enumerate(self.lines):
            if line["approach"] not in (None, side):
                continue
            kind = line["correlation"]
            if kind == "common_offset":
                own = self.common[at]
            elif kind == "common_scale":
                own = self.common[at] * x
            elif kind == "between_positions":
                own = 4 * share * (1 - share) * self.curves[at][before]
            elif pooled:
                own = math.hypot(share, 1 - share) * self.common[at]
            else:
                scatter = self.scatters[at][side]
                own = (1 - share) * scatter[before] + share * scatter[before + 1]
            total = total + line["sensitivity"] * own
        return total


def answer(task):
    axis = Axis(task)
    places = []
    for x, side in task["places"]:
        value = axis.value(x, side, True)
        freedom = dof(value)
        places.append([uncertainty(value), None if math.isinf(freedom) else freedom])
    pairs = [
        get_covariance(axis.value(*one, False), axis.value(*other, False))
        for one, other in task["pairs"]
    ]
    return {"places": places, "pairs": pairs}


print(json.dumps([answer(task) for task in json.load(sys.stdin)]), flush=True)
