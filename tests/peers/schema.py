"""Whether values are as a JSON Schema says, by the library jsonschema-rs.

In: one line of JSON: {"schema": SCHEMA, "values": [VALUES]}. Out: one line: {"valid": [true or false, in their order]}. A schema
that is none by the rules of draft 2020-12 is an error.
"""

import json
import sys

import jsonschema_rs

task = json.loads(sys.stdin.readline())
jsonschema_rs.meta.validate(task["schema"])
judge = jsonschema_rs.Draft202012Validator(task["schema"])
print(json.dumps({"valid": [judge.is_valid(value) for value in task["values"]]}))
