"""Prints what scipy's RegularGridInterpolator takes for a point of three components.

One JSON object: nanoseconds per point, as median and minimum of the repetitions, for a whole
array of points in one call and for calls of one point each. Linear and cubic, on grids of the
sizes of volumetric.rs.
"""

import json
import statistics
import time

import numpy
from scipy.interpolate import RegularGridInterpolator

SPAN_M = (0.6, 0.5, 0.4)
GRIDS = ((13, 11, 9), (41, 31, 21))
REPETITIONS = 5
POINTS = {"linear": 8192, "cubic": 256}
SINGLE_CALLS = 20


def field(size):
    nodes = [numpy.linspace(0.0, span, count) for span, count in zip(SPAN_M, size)]
    x, y, z = numpy.meshgrid(*nodes, indexing="ij")
    waves = [numpy.sin(7 * x + k) * numpy.cos(5 * y) + numpy.sin(6 * z) for k in range(3)]
    return nodes, 1e-5 * numpy.stack(waves, axis=-1)


def nanoseconds(calls, points):
    begin = time.perf_counter()
    calls()
    return (time.perf_counter() - begin) * 1e9 / points


def case(method, size, generator):
    nodes, values = field(size)
    interpolate = RegularGridInterpolator(nodes, values, method=method)
    points = generator.random((POINTS[method], 3)) * SPAN_M
    singles = points[:SINGLE_CALLS]
    arrays = [nanoseconds(lambda: interpolate(points), len(points)) for _ in range(REPETITIONS)]
    single = [
        nanoseconds(lambda: [interpolate(point) for point in singles], len(singles))
        for _ in range(REPETITIONS)
    ]
    return {
        "case": f"(scipy) {method}, {' x '.join(map(str, size))}",
        "array_ns": statistics.median(arrays),
        "array_ns_min": min(arrays),
        "single_ns": statistics.median(single),
        "single_ns_min": min(single),
    }


def main():
    generator = numpy.random.default_rng(1)
    cases = [case(method, size, generator) for size in GRIDS for method in POINTS]
    print(json.dumps({"repetitions": REPETITIONS, "cases": cases}))


main()
