"""One function per kind of material, made from the table of the engine: names, defaults and documentation are its own.

`materials.pyi` has the same for editors; `python -m firstlight._stubs` writes it.
"""

from __future__ import annotations

import inspect
import json
from typing import Any, Callable

from . import _firstlight
from ._parts import Material

TABLE = json.loads(_firstlight.materials())


def _documentation(kind: Any) -> str:
    rows = []
    for row in kind["properties"]:
        default = "" if row["required"] else f" [{row['default']}]"
        rows.append(f"- `{row['name']}`{default}: {row['help']}; must {row['rule']}")
    return kind["about"] + "\n\n" + "\n".join(rows)


def _function(kind: Any) -> Callable[..., Material]:
    def make(**values: Any) -> Material:
        return Material(kind["name"], **values)

    parameters = [
        inspect.Parameter(
            row["name"],
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if row["required"] else row["default"],
        )
        for row in kind["properties"]
    ]
    make.__name__ = make.__qualname__ = kind["name"]
    make.__module__ = __name__
    make.__doc__ = _documentation(kind)
    make.__signature__ = inspect.Signature(parameters, return_annotation=Material)  # type: ignore[attr-defined]
    return make


__all__ = [kind["name"] for kind in TABLE]
globals().update({kind["name"]: _function(kind) for kind in TABLE})
