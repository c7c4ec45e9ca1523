"""validate_schema.py SCHEMA REPORT...: every report must follow the JSON schema, and hold no field that the schema
does not describe."""
import json
import sys

from jsonschema import Draft202012Validator


def closed(node):
    """The schema with no room for further properties."""
    if isinstance(node, list):
        return [closed(n) for n in node]
    if not isinstance(node, dict):
        return node
    node = {key: closed(value) for key, value in node.items()}
    if node.get("type") == "object" and "required" in node:
        node.setdefault("additionalProperties", False)
    return node


schema = json.load(open(sys.argv[1], encoding="utf-8"))
Draft202012Validator.check_schema(schema)
validator = Draft202012Validator(closed(schema))
broken = 0
for path in sys.argv[2:]:
    for error in validator.iter_errors(json.load(open(path, encoding="utf-8"))):
        print(f"{path}: {error.json_path}: {error.message}")
        broken += 1
sys.exit(1 if broken else 0)
