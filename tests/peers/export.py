"""What exported journals say, read by DuckDB (Parquet), Python's csv and the mcap library, against the journals themselves.

In: a line of JSON for each journal: {"journal": PATH, "csv": [FILES], "parquet": [FILES], "mcap": FILE}. Out: a line of JSON with
the number of values compared, and every difference. The tables are made here once more from the journal's lines, by what
docs/journals.md says of them; nothing of the exporter is used.
"""

import csv
import datetime
import json
import math
import sys

import duckdb
from mcap.reader import make_reader

PARTS = {"nodes_m": "xyz", "interval_m": ["before", "behind"]}
for key in (
    "along at_m beam_shift_m correction_m fixed_m from_m high_m low_m roll_rad seen_from_m sideways_m to_m tool_m zero_m"
).split():
    PARTS[key] = "xyz"
PAIRED = ["beam_shift_m", "sideways_m"]
UNITS = "c humidity k m pa rad s si u v".split()


def lines_of(path):
    for number, line in enumerate(open(path, encoding="utf-8"), 1):
        text = line if line.startswith("{") else line[9:]
        entry = json.loads(text)
        entry.pop("crc32", None)
        yield number, entry.pop("entry"), entry


def micros(text):
    since = datetime.datetime.fromisoformat(text) - datetime.datetime.fromtimestamp(0, datetime.timezone.utc)
    return since // datetime.timedelta(microseconds=1)


def timed(path):
    begun = last = 0
    first = None
    for number, kind, entry in lines_of(path):
        begins = {"header": entry.get("started"), "resumed": entry.get("at")}.get(kind)
        if begins:
            begun = last = micros(begins)
            first = None
        elif entry.get("at_s") is not None:
            first = entry["at_s"] if first is None else first
            last = begun + round((entry["at_s"] - first) * 1e6)
        elif isinstance(entry.get("at"), str):
            last = micros(entry["at"])
        yield number, kind, entry, last


def part_named(name, part):
    head, _, unit = name.rpartition("_")
    return f"{head}_{part}_{unit}" if unit in UNITS else f"{name}_{part}"


def flat(name, key, value, row, lists):
    parts = PARTS.get(key)
    if parts and (value is None or (isinstance(value, list) and len(value) == len(parts))):
        for index, part in enumerate(parts):
            inner, of_part = value and value[index], part_named(name, part)
            if key in PAIRED:
                for at in range(2):
                    flat(part_named(of_part, str(at + 1)), "", inner and inner[at], row, lists)
            else:
                flat(of_part, "", inner, row, lists)
    elif isinstance(value, list):
        lists[name] = value
    elif isinstance(value, dict):
        for member, inner in value.items():
            flat(f"{name}_{member}", member, inner, row, lists)
    else:
        row[name] = value


def add(tables, name, row, lists, begin):
    tables.setdefault(name, []).append(row)
    depth = len(begin) - 1
    counter = "item" if depth == 1 else f"item_{depth}"
    for index in range(max(map(len, lists.values()), default=0)):
        inner_begin = {**begin, counter: index}
        inner, inner_lists = dict(inner_begin), {}
        for key, values in lists.items():
            if index < len(values):
                flat(key, "", values[index], inner, inner_lists)
        add(tables, f"{name}_items", inner, inner_lists, inner_begin)


def tables_of(path):
    tables = {}
    for number, kind, entry, at in timed(path):
        begin = {"journal_line": number, "time_utc": at}
        row, lists = dict(begin), {}
        for key, value in entry.items():
            flat(key, key, value, row, lists)
        add(tables, kind, row, lists, begin)
    return tables


def same(expected, seen):
    if isinstance(expected, float) and isinstance(seen, (int, float)):
        return math.copysign(1, expected) == math.copysign(1, seen) and expected == seen
    return expected == seen


def of_text(text, expected):
    """A cell of a CSV as the type that is expected there."""
    if text == "" and expected in (None, ""):
        return expected
    if isinstance(expected, bool):
        return {"true": True, "false": False}.get(text, text)
    if isinstance(expected, (int, float)):
        return float(text)
    return text


def instant(cell):
    return micros(cell) if isinstance(cell, str) else cell


def compare(what, tables, read, differences):
    """Every value of the journal is in the file, and nothing else is."""
    count = 0
    names = {name.rsplit(".", 2)[1] for name in read}
    if names != set(tables):
        differences.append(f"{what}: tables {sorted(names)}, expected {sorted(tables)}")
    for file, rows in read.items():
        name = file.rsplit(".", 2)[1]
        wanted = tables.get(name, [])
        if len(rows) != len(wanted):
            differences.append(f"{what} {name}: {len(rows)} rows, expected {len(wanted)}")
        for expected, seen in zip(wanted, rows):
            for key in set(seen) | {key for key, value in expected.items() if value is not None}:
                value, cell = expected.get(key), seen.get(key)
                if key == "time_utc":
                    cell = instant(cell)
                elif what == "csv":
                    cell = of_text(cell, value) if cell is not None else None
                    cell = None if cell == "" and value is None else cell
                count += 1
                if not same(value, cell):
                    differences.append(f"{what} {name} {key}: {cell!r}, expected {value!r}")
    return count


def csv_rows(file):
    with open(file, encoding="utf-8", newline="") as text:
        return list(csv.DictReader(text))


def parquet_rows(file):
    # As a number: for times with a zone DuckDB wants a package that nothing else needs.
    told = duckdb.execute("SELECT * REPLACE (epoch_us(time_utc) AS time_utc) FROM read_parquet(?)", [file])
    names = [it[0] for it in told.description]
    return [dict(zip(names, row)) for row in told.fetchall()]


def without_nulls(value):
    if isinstance(value, dict):
        return {key: without_nulls(inner) for key, inner in value.items() if inner is not None}
    return [without_nulls(inner) for inner in value] if isinstance(value, list) else value


def fits(schema, value):
    kinds = {
        "object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": (int, float),
    }
    if value is None:
        return True
    if not isinstance(value, kinds[schema["type"]]):
        return False
    if isinstance(value, dict):
        return all(key in schema["properties"] and fits(schema["properties"][key], it) for key, it in value.items())
    return all(fits(schema["items"], it) for it in value) if isinstance(value, list) else True


def compare_mcap(path, file, differences):
    count = 0
    with open(file, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        messages = sorted(reader.iter_messages(log_time_order=False), key=lambda it: it[2].sequence)
    wanted = list(timed(path))
    if len(messages) != len(wanted):
        differences.append(f"mcap: {len(messages)} messages, expected {len(wanted)}")
    for (number, kind, entry, at), (schema, channel, message) in zip(wanted, messages):
        seen = json.loads(message.data)
        expected = [number, f"/{kind}", "json", "jsonschema", at * 1000, json.dumps(without_nulls(entry))]
        said = [message.sequence, channel.topic, channel.message_encoding, schema.encoding, message.log_time, json.dumps(seen)]
        count += len(entry)
        if said != expected or not fits(json.loads(schema.data), seen):
            differences.append(f"mcap: {said}, expected {expected}")
    return count


def judged(task):
    tables, differences = tables_of(task["journal"]), []
    counts = {
        "csv": compare("csv", tables, {file: csv_rows(file) for file in task["csv"]}, differences),
        "parquet": compare("parquet", tables, {file: parquet_rows(file) for file in task["parquet"]}, differences),
        "mcap": compare_mcap(task["journal"], task["mcap"], differences),
    }
    return {"compared": counts, "differences": differences[:20]}


def main():
    for line in sys.stdin:
        print(json.dumps(judged(json.loads(line))), flush=True)


main()
