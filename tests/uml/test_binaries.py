"""Reads cargo's JSON messages and prints `name path` of each test program of one package.

Argument: the Cargo.toml of the package.
"""

import json
import os
import sys

manifest = os.path.realpath(sys.argv[1])
for line in sys.stdin:
    message = json.loads(line) if line.startswith("{") else {}
    if message.get("reason") != "compiler-artifact" or not message.get("executable"):
        continue
    if message["profile"]["test"] and os.path.realpath(message["manifest_path"]) == manifest:
        print(message["target"]["name"], message["executable"])
