"""Materials, textures, environments and cameras: values that a scene takes."""

from __future__ import annotations

import itertools
import json
import os
from typing import Any, Dict, Iterator, Mapping, Optional, Tuple

import numpy as np

from . import _firstlight
from ._errors import InputError
from ._text import Parts, image_array, struct, value

_numbers = itertools.count(1)


class Texture:
    """A texture, in place of a colour or a number of a material: see `checker`, `texture` and `vertex_colors`."""

    def __init__(self, kind: str, fields: Mapping[str, Any], image: Any = None) -> None:
        self._name = f"texture {next(_numbers)}"
        self._image = None if image is None else (f"{self._name}.array", image_array(image))
        if self._image is not None:
            fields = {"file": self._image[0], **fields}
        self._text = struct(kind, fields)
        parts = Parts()
        self._add_to(parts)
        _firstlight.check(parts.text(), parts.images)

    def _add_to(self, parts: Parts) -> str:
        parts.textures[self._name] = self._text
        if self._image is not None:
            parts.images[self._image[0]] = self._image[1]
        return self._name

    def __repr__(self) -> str:
        return f"Texture({self._text})"


def checker(a: Any = 0.8, b: Any = 0.2, **fields: Any) -> Texture:
    """A checkerboard of two colours; `squares`, `offset` and `rotate` as in scene files."""
    return Texture("checker", {"a": a, "b": b, **fields})


def texture(image: Any, **fields: Any) -> Texture:
    """An image as a texture.

    - `image`: a path, or an array of height × width × channels: `uint8` is sRGB (or linear, with `encoding="linear"`),
      any other type linear.
    - `fields`: as in scene files: `repeat`, `offset`, `rotate`, `wrap`, `smooth`, `encoding`, `channel`, `tint`, …
    """
    if isinstance(image, (str, os.PathLike)):
        return Texture("image", {"file": os.path.abspath(os.fspath(image)), **fields})
    return Texture("image", fields, image)


def vertex_colors(**fields: Any) -> Texture:
    """The vertex colours of a mesh."""
    return Texture("vertex_colors", fields)


class Material:
    """How a surface scatters light; one function per kind makes them: `diffuse`, `glass`, `principled`, ….

    A material is a value: it can be given to many objects and scenes. Wrong names and numbers raise `InputError`.
    """

    def __init__(self, kind: str, **values: Any) -> None:
        self.kind = kind
        self.values: Dict[str, Any] = {name: given for name, given in values.items() if given is not None}
        parts = Parts()
        self._add_to(parts, "it", _Names().of)
        _firstlight.check(parts.text(), parts.images)

    def _add_to(self, parts: Parts, name: str, name_of: Any) -> None:
        """Adds its text; `name_of` gives the name of another material, and adds that one."""
        fields = {}
        for field, given in self.values.items():
            if isinstance(given, Texture):
                given = given._add_to(parts)
            elif isinstance(given, Material):
                given = name_of(parts, given)
            fields[field] = given
        parts.materials[name] = struct(self.kind, fields)

    def replace(self, **values: Any) -> "Material":
        """The same material with other values."""
        return Material(self.kind, **{**self.values, **values})

    def __repr__(self) -> str:
        given = ", ".join(f"{name}={value!r}" for name, value in self.values.items())
        return f"{self.kind}({given})"

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)


class _Names:
    """Names for the parts of a blend that is only checked."""

    def of(self, parts: Parts, material: Material) -> str:
        name = f"part {id(material)}"
        if name not in parts.materials:
            material._add_to(parts, name, self.of)
        return name


class Environment:
    """Light from infinitely far away: see `gradient` and `environment`."""

    def __init__(self, text: str, images: Optional[Dict[str, Any]] = None) -> None:
        self._text, self._images = text, images or {}
        parts = Parts()
        self._add_to(parts)
        _firstlight.check(parts.text(), parts.images)

    def _add_to(self, parts: Parts) -> None:
        parts.environment = self._text
        parts.images.update(self._images)

    @classmethod
    def of(cls, given: Any) -> "Environment":
        """What a scene takes for one: a radiance, an array, the path of an image, or an environment."""
        if isinstance(given, cls):
            return given
        if given is None:
            return cls("black")
        if isinstance(given, (str, os.PathLike)) or np.ndim(given) >= 2:
            return environment(given)
        return cls(f"constant({value('constant', given)})")

    def __repr__(self) -> str:
        return f"Environment({self._text})"


def gradient(zenith: Any, horizon: Any, ground: Any) -> Environment:
    """An environment of three radiances: above, at the horizon, and below."""
    return Environment(struct("gradient", {"zenith": zenith, "horizon": horizon, "ground": ground}))


def clear_sky(**fields: Any) -> Environment:
    """A clear sky with the sun: `elevation`, `azimuth`, `turbidity`, `ground`, …, as in scene files."""
    return Environment(struct("sky", fields))


def environment(image: Any, **fields: Any) -> Environment:
    """An equirectangular image as environment.

    - `image`: a path, or an array of height × width × 3 (linear, unless `uint8`); the top row is +Y, the middle
      column −Z.
    - `fields`: `scale`, `rotate`, …, as in scene files.
    """
    if isinstance(image, (str, os.PathLike)):
        return Environment(struct("image", {"file": os.path.abspath(os.fspath(image)), **fields}))
    name = "environment.array"
    return Environment(struct("image", {"file": name, **fields}), {name: image_array(image)})


class Camera:
    """A camera: where it is, where it looks, and its lens. Fields are those of scene files, in metres and degrees.

    `fl.Camera(eye=(0, 1, 4), look_at=(0, 0, 0), vfov=40)`. The camera of a scene is changed in place: assigning a
    field, or `look_at(…)`, changes what the next image shows.
    """

    _FIELDS = (
        "eye", "forward", "pivot_distance", "up", "vfov", "orthographic_height", "lens_radius", "f_stop",
        "focus_distance", "depth_of_field", "blades", "blade_rotation",
    )  # fmt: skip

    _fields: Dict[str, Any]

    def __init__(self, eye: Any = (0, 0, 1), look_at: Any = None, **fields: Any) -> None:
        if look_at is None and fields.get("forward") is None:
            look_at = (0, 0, 0)
        self._put({"eye": eye, "look_at": look_at, **fields})

    @classmethod
    def _of_scene(cls, scene: Any, text: str) -> "Camera":
        camera = cls.__new__(cls)
        object.__setattr__(camera, "_fields", json.loads(text))
        object.__setattr__(camera, "_scene", scene)
        return camera

    _scene: Any = None

    def _put(self, fields: Dict[str, Any]) -> None:
        """Checks the fields and takes them over, in the scene too if the camera belongs to one."""
        fields = {name: given for name, given in fields.items() if given is not None}
        parts = Parts()
        parts.camera = struct("", fields)
        if self._scene is not None:
            self._scene._native.put_camera(parts.text())
        else:
            _firstlight.check(parts.text(), {})
        object.__setattr__(self, "_fields", fields)

    def look_at(self, target: Any, eye: Any = None, up: Any = None) -> "Camera":
        """Turns the camera to a point; moves it if `eye` is given. Its focus follows."""
        changed = {"look_at": target, "eye": eye, "up": up}
        kept = {name: given for name, given in self._fields.items() if name not in ("forward", "pivot_distance")}
        kept.pop("focus_distance", None)
        self._put({**kept, **{name: given for name, given in changed.items() if given is not None}})
        return self

    @property
    def target(self) -> np.ndarray:
        """The point in the middle of the image about which a view orbits."""
        if self._fields.get("look_at") is not None:
            return np.array(self._fields["look_at"], dtype=np.float64)
        forward = np.array(self._fields["forward"], dtype=np.float64)
        distance = self._fields.get("pivot_distance", 1.0) / np.linalg.norm(forward)
        return np.array(self._fields["eye"], dtype=np.float64) + distance * forward

    def replace(self, **fields: Any) -> "Camera":
        """Another camera that differs in some fields."""
        return Camera(**{**self._fields, **fields})

    def __getattr__(self, name: str) -> Any:
        if name in self._FIELDS:
            return self._fields.get(name)
        raise AttributeError(name)

    def __setattr__(self, name: str, given: Any) -> None:
        if name not in self._FIELDS:
            raise InputError(f"a camera has no field `{name}` (known: {', '.join(self._FIELDS)})")
        fields = {**self._fields, name: given}
        if name == "forward":
            fields.pop("look_at", None)
        if name == "f_stop":
            fields.pop("lens_radius", None)
        if name in ("lens_radius", "f_stop"):
            fields.pop("depth_of_field", None)
        self._put(fields)

    def __iter__(self) -> Iterator[Tuple[str, Any]]:
        return iter(self._fields.items())

    def __repr__(self) -> str:
        return "Camera(" + ", ".join(f"{name}={given!r}" for name, given in self._fields.items()) + ")"
