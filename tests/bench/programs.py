"""Reads cargo's JSON messages and prints the benchmark programs, and others, as {"name": "path"}."""

import json
import sys

programs = {}
for line in sys.stdin:
    message = json.loads(line) if line.startswith("{") else {}
    if message.get("executable") and {"bench", "bin"} & set(message["target"]["kind"]):
        programs[message["target"]["name"]] = message["executable"]
if not programs:
    sys.exit("no benchmark program was built")
print(json.dumps(programs))
