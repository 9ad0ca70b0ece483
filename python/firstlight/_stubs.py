"""Writes `materials.pyi` from the table of the engine: `python -m firstlight._stubs`."""

from __future__ import annotations

from pathlib import Path

from .materials import TABLE

TYPES = {
    "color": "Union[Color, Texture]",
    "scalar": "Union[float, Texture]",
    "number": "float",
    "flag": "bool",
    "cutoff": "Optional[float]",
    "rgb": "Color",
    "fresnel": "str",
    "material": "Union[Material, str]",
}


def stub() -> str:
    """The text of the stub."""
    lines = [
        '"""Written by `python -m firstlight._stubs`."""',
        "",
        "from typing import Any, Optional, Sequence, Union",
        "",
        "from ._parts import Material, Texture",
        "",
        "Color = Union[float, Sequence[float], str]",
        "TABLE: Any",
    ]
    for kind in TABLE:
        lines += ["", "", f"def {kind['name']}(", "    *,"]
        # What must be given comes first.
        for row in sorted(kind["properties"], key=lambda row: not row["required"]):
            default = "" if row["required"] else f" = {row['default']!r}"
            lines.append(f"    {row['name']}: {TYPES[row['value']]}{default},")
        lines += [") -> Material:", f'    """{kind["about"]}', ""]
        lines += [f"    - `{row['name']}`: {row['help']}; must {row['rule']}" for row in kind["properties"]]
        lines += ['    """']
    return "\n".join(lines) + "\n"


def path() -> Path:
    """Where it is."""
    return Path(__file__).with_name("materials.pyi")


if __name__ == "__main__":
    path().write_text(stub(), encoding="utf-8")
