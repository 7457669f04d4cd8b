"""The uncertainty of a length by an interferometer, by GTC, from the uncertainties of what goes into it.

In: one JSON object for each task: wavelength, air and machine with their standard uncertainties. Out: for each one line:
the relative standard uncertainty of a length at 20 degrees Celsius. The index of air is the modified equation of Edlen as
the NIST Engineering Metrology Toolbox prints it, which is not the one of the program that is judged.
"""

import json
import sys

from GTC import exp, uncertainty, ureal, value


def index(celsius, pascal, fraction):
    """Edlen's equation as modified by Birch and Downs; vapour pressure by Buck."""
    sigma2 = (1 / 0.6329912) ** 2
    standard = (8342.54 + 2406147 / (130 - sigma2) + 15998 / (38.9 - sigma2)) * 1e-8
    x = (1 + 1e-8 * (0.601 - 0.00972 * celsius) * pascal) / (1 + 0.003661 * celsius)
    saturated = 611.21 * exp((18.678 - celsius / 234.5) * celsius / (257.14 + celsius))
    vapour = fraction * saturated
    dry = standard * pascal / 96095.43 * x
    return 1 + dry - 1e-10 * (292.75 / (celsius + 273.15)) * (3.7345 - 0.0401 * sigma2) * vapour


def relative(task):
    real = {name: ureal(*pair) for name, pair in task.items()}
    n = index(real["air_c"], real["pressure_pa"], real["humidity"])
    expanded = 1 + real["expansion"] * (real["material_c"] - 20)
    length = real["wavelength_m"] / n / expanded
    return uncertainty(length) / value(length)


print(json.dumps([relative(task) for task in json.load(sys.stdin)]), flush=True)
