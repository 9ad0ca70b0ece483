#!/usr/bin/env python3
"""Checks Kubernetes manifests against the official models of the Python client: every key must be one of the API, every
value must have its type, and what is required must be there.

Usage: check_manifests.py FILE.yaml ... (needs the packages kubernetes and PyYAML)
"""

import re
import sys

import yaml
from kubernetes import client


def problems(value, kind, place):
    """What is wrong with `value`, which should be of the type that the models call `kind`."""
    # Newer clients write `List[T]` and `Dict[str, T]`, older ones `list[T]` and `dict(str, T)`.
    several = re.fullmatch(r"[Ll]ist\[(.*)\]|[Dd]ict[\[(]str, (.*)[\])]", kind)
    if several:
        of_list, of_dict = several.groups()
        if not isinstance(value, list if of_list else dict):
            return [f"{place}: expected a {'list' if of_list else 'mapping'}"]
        items = enumerate(value) if of_list else value.items()
        return [p for key, item in items for p in problems(item, of_list or of_dict, f"{place}[{key}]")]
    plain = {"str": str, "int": int, "bool": bool, "float": (int, float)}
    if kind in plain:
        is_right = isinstance(value, plain[kind]) and (kind == "bool" or not isinstance(value, bool))
        return [] if is_right else [f"{place}: `{value}` is not of type {kind}"]
    if kind in ("object", "datetime"):
        return []
    model = getattr(client, kind)
    if not isinstance(value, dict):
        return [f"{place}: expected a mapping"]
    names = {model.attribute_map[name]: name for name in model.openapi_types}
    found = [f"{place}: there is no key `{key}` in {kind}" for key in value if key not in names]
    for key, item in value.items():
        if key in names:
            found += problems(item, model.openapi_types[names[key]], f"{place}.{key}")
    try:
        # The constructor refuses a model without what is required.
        model(**{names[key]: item for key, item in value.items() if key in names})
    except ValueError as error:
        found.append(f"{place}: {error}")
    return found


def main():
    found = []
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as file:
            for document in yaml.safe_load_all(file):
                version = document["apiVersion"].split("/")[-1]
                kind = version[0].upper() + version[1:] + document["kind"]
                found += problems(document, kind, path)
    print("\n".join(found) or f"{len(sys.argv) - 1} manifests are valid")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
