#!/usr/bin/env python3
"""Prints a list of all components of the program, in the format CycloneDX 1.5: `scripts/sbom.py TARGET`.

The components are those that `cargo metadata` names for a target, without what only tests and build scripts use.
"""

import json
import subprocess
import sys


def main():
    target = sys.argv[1]
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", target]
    data = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    packages = {package["id"]: package for package in data["packages"]}
    nodes = {node["id"]: node for node in data["resolve"]["nodes"]}
    root = next(package["id"] for package in data["packages"] if package["name"] == "firstlight")

    def needs(package):
        kinds = ((dep["pkg"], {kind["kind"] for kind in dep["dep_kinds"]}) for dep in nodes[package]["deps"])
        return sorted(needed for needed, kind in kinds if None in kind)

    found, open_ = {root}, [root]
    while open_:
        new = [package for package in needs(open_.pop()) if package not in found]
        found.update(new)
        open_ += new

    def reference(package):
        return f"pkg:cargo/{packages[package]['name']}@{packages[package]['version']}"

    def component(package):
        about = packages[package]
        kind = "application" if package == root else "library"
        made = {"type": kind, "bom-ref": reference(package), "name": about["name"], "version": about["version"]}
        if about["license"]:
            # Old manifests separate alternatives by a slash.
            made["licenses"] = [{"expression": about["license"].replace("/", " OR ")}]
        return {**made, "purl": reference(package)}

    print(
        json.dumps(
            {
                "bomFormat": "CycloneDX",
                "specVersion": "1.5",
                "version": 1,
                "metadata": {"component": component(root)},
                "components": [component(package) for package in sorted(found - {root}, key=reference)],
                "dependencies": [
                    {"ref": reference(package), "dependsOn": [reference(needed) for needed in needs(package)]}
                    for package in sorted(found, key=reference)
                ],
            },
            indent=1,
        )
    )


main()
