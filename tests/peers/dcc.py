"""Whether certificates are valid by the DCC schema, and what they say, read as D-SI defines it.

In: the schema's path as argument, then a line with the path of a certificate for each; one that is of another schema
has that schema's path behind it, after a tab. Out: for each one line of
JSON: whether it is valid, why not, the unit and the numbers of each result, and its statements. The schema is that of the
Physikalisch-Technische Bundesanstalt; lxml (libxml2) judges by it.
"""

import json
import sys

from lxml import etree

DCC = "{https://ptb.de/dcc}"
SI = "{https://ptb.de/si}"


def texts(node, path):
    return [" ".join(it.itertext()).strip() for it in node.iterfind(path)]


def numbers(node, path):
    return [float(it) for text in texts(node, path) for it in text.split()]


def single(root):
    """Quantities that stand by themselves, by the names of their result and their own: value, unit and standard
    uncertainty."""
    found = {}
    for result in root.iter(DCC + "result"):
        own = found.setdefault(texts(result, DCC + "name")[0], {})
        for quantity in result.iter(DCC + "quantity"):
            for real in quantity.iterfind(SI + "real"):
                u = numbers(real, ".//" + SI + "valueStandardMU")
                own[texts(quantity, DCC + "name")[0]] = {
                    "value": numbers(real, SI + "value")[0],
                    "unit": texts(real, SI + "unit")[0],
                    "u": u[0] if u else None,
                }
    return {name: own for name, own in found.items() if own}


def said(root):
    results = []
    for result in root.iter(DCC + "result"):
        quantities = list(result.iter(DCC + "quantity"))
        # Deviations at positions; whatever else is in a list is not asked for.
        if result.find(".//" + DCC + "list") is None or len(quantities) < 2:
            continue
        results.append(
            {
                "name": texts(result, DCC + "name")[0],
                "units": texts(result, ".//" + SI + "unitXMLList"),
                "positions": numbers(quantities[0], ".//" + SI + "valueXMLList"),
                "deviations": numbers(quantities[1], ".//" + SI + "valueXMLList"),
                "uncertainties": numbers(quantities[1], ".//" + SI + "valueStandardMUXMLList"),
            }
        )
    return {
        "results": results,
        "single": single(root),
        "statements": texts(root, ".//" + DCC + "statement"),
        "items": texts(root, ".//" + DCC + "identification/" + DCC + "value"),
    }


def judged(schema, path):
    try:
        tree = etree.parse(path)
    except etree.XMLSyntaxError as error:
        return {"valid": False, "errors": [str(error)]}
    valid = schema.validate(tree)
    errors = [f"{it.line}: {it.message}" for it in schema.error_log]
    return {"valid": valid, "errors": errors, **(said(tree.getroot()) if valid else {})}


def main():
    schemas = {}
    for line in sys.stdin:
        path, _, of = line.strip().partition("\t")
        of = of or sys.argv[1]
        if of not in schemas:
            schemas[of] = etree.XMLSchema(etree.parse(of))
        print(json.dumps(judged(schemas[of], path)), flush=True)


main()
