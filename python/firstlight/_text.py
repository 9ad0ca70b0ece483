"""Parts of a scene as the text of a scene file.

The engine reads the text, so names, ranges and messages are those of scene files. Start reading at `Parts`.
"""

from __future__ import annotations

import numbers
from typing import Any, Dict, List, Mapping, Optional

import numpy as np

from ._errors import InputError

# Fields whose text is one of a few words; all other text is in quotes: names, paths, colours such as "#ccbbaa".
WORDS = {"channel", "encoding", "falloff", "filter", "fresnel", "integrator", "layout", "tone_curve", "wrap", "wrap_v"}

ANY_CAMERA = "(eye: (0, 0, 1), look_at: (0, 0, 0))"


def quoted(text: str) -> str:
    """Text in quotes."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def value(field: str, given: Any) -> str:
    """A value as a scene file has it: a number, a word, a name, or a list of values in round brackets."""
    if isinstance(given, (bool, np.bool_)):
        return "true" if given else "false"
    if isinstance(given, numbers.Integral):
        return str(int(given))
    if isinstance(given, numbers.Real):
        number = float(given)
        return "NaN" if number != number else repr(number)
    if isinstance(given, str):
        return given if field in WORDS and given.isidentifier() else quoted(given)
    if isinstance(given, np.ndarray):
        given = given.tolist()
        if not isinstance(given, list):
            return value(field, given)
    if isinstance(given, (list, tuple)):
        return "(" + ", ".join(value(field, item) for item in given) + ")"
    raise InputError(f"`{field}` is {given!r}, but must be a number, a text or a list of numbers")


def struct(kind: str, fields: Mapping[str, Any]) -> str:
    """`kind(name: value, …)`, without what is `None`."""
    given = ", ".join(f"{name}: {value(name, item)}" for name, item in fields.items() if item is not None)
    return f"{kind}({given})"


class Parts:
    """Parts of a scene that the engine reads together: each is the text of one, by name or in order."""

    def __init__(self) -> None:
        self.camera = ANY_CAMERA
        self.environment: Optional[str] = None
        self.settings: Dict[str, str] = {}
        self.textures: Dict[str, str] = {}
        self.materials: Dict[str, str] = {}
        self.objects: List[str] = []
        self.lights: List[str] = []
        # Images in memory by the paths in the texts.
        self.images: Dict[str, Any] = {}

    def text(self) -> str:
        """A whole scene file."""

        def named(parts: Dict[str, str]) -> str:
            return "{" + ", ".join(f"{quoted(name)}: {text}" for name, text in parts.items()) + "}"

        sections = {"camera": self.camera, **self.settings}
        if self.environment is not None:
            sections["environment"] = self.environment
        if self.textures:
            sections["textures"] = named(self.textures)
        sections["materials"] = named(self.materials)
        sections["objects"] = "[" + ", ".join(self.objects) + "]"
        sections["lights"] = "[" + ", ".join(self.lights) + "]"
        return "(" + ", ".join(f"{name}: {text}" for name, text in sections.items()) + ")"


def image_array(array: Any) -> Any:
    """Width, height, channels and bytes of an image: whole numbers are sRGB of 8 bits, others are linear."""
    pixels = np.asarray(array)
    if pixels.ndim == 2:
        pixels = pixels[:, :, np.newaxis]
    if pixels.ndim != 3:
        raise InputError(f"an image is height × width × channels, but this has the shape {np.shape(array)}")
    if pixels.dtype == np.uint8:
        bytes_ = np.ascontiguousarray(pixels)
    else:
        bytes_ = np.ascontiguousarray(pixels, dtype=np.float32)
        if bytes_.shape[2] == 1:
            bytes_ = np.repeat(bytes_, 3, axis=2)
    height, width, channels = bytes_.shape
    return (width, height, channels, bytes_.tobytes())
