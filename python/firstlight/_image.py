"""Images: pixels and layers as arrays, error, files."""

from __future__ import annotations

import os
from typing import Any, Dict, Iterator, List, Mapping, Optional, Tuple, Union

import numpy as np

from ._errors import InputError

# The layers that an image can have: the shape of a pixel, and its type.
LAYERS: Dict[str, Tuple[int, Any]] = {
    "albedo": (3, np.float32),
    "normal": (3, np.float32),
    "position": (3, np.float32),
    "depth": (1, np.float32),
    "coverage": (1, np.float32),
    "object": (1, np.int32),
    "material": (1, np.int32),
    "error": (1, np.float32),
    "samples": (1, np.int32),
}

# Those that need no surfaces.
OF_FILM = ("error", "samples")


def wanted_layers(layers: Union[bool, str, List[str], None]) -> List[str]:
    """The layers that `layers=…` asks for: `True` is all of them."""
    if layers is None or layers is False:
        return []
    if layers is True:
        return list(LAYERS)
    wanted = [layers] if isinstance(layers, str) else list(layers)
    for name in wanted:
        if name not in LAYERS:
            raise InputError(f"there is no layer `{name}` (known: {', '.join(LAYERS)})")
    return wanted


def array_of(native: Any, data: Any, kind: Any, channels: int) -> np.ndarray:
    """Bytes of an image as an array."""
    shape = (native.height, native.width) + ((channels,) if channels > 1 else ())
    return np.frombuffer(data, dtype=kind).reshape(shape)


class Layers(Mapping[str, np.ndarray]):
    """The layers of an image by name, each an array; made when they are first asked for."""

    def __init__(self, native: Any, names: List[str]) -> None:
        # Not the image, which has this: a circle would keep its memory until Python looks for circles.
        self._native = native
        # The error is known from two samples per pixel on.
        self._names = [name for name in names if name != "error" or native.error is not None]
        self._arrays: Dict[str, np.ndarray] = {}

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._names:
            raise KeyError(name)
        if name not in self._arrays:
            channels, kind = LAYERS[name]
            self._arrays[name] = array_of(self._native, self._native.layer(name), kind, channels)
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return f"Layers({', '.join(self._names)})"


class Image:
    """A rendered image. Notebooks show it; `numpy()` has its pixels, `layers` the rest."""

    def __init__(self, native: Any, layers: List[str], interrupted: bool = False) -> None:
        self._native = native
        self.width: int = native.width
        self.height: int = native.height
        #: The smallest number of samples that any pixel has.
        self.spp: int = native.spp
        #: Seconds of rendering.
        self.seconds: float = native.seconds
        #: Rays traced.
        self.rays: int = native.rays
        #: Whether Ctrl+C ended it: it has the samples until then.
        self.interrupted = interrupted
        #: Objects that could not be rendered, each with the reason.
        self.warnings: List[str] = native.warnings
        #: Layers by name: albedo, normal, position, depth, coverage, object, material, error, samples.
        self.layers = Layers(native, layers)

    def _array(self, data: Any, kind: Any, channels: int) -> np.ndarray:
        return array_of(self._native, data, kind, channels)

    def numpy(self) -> np.ndarray:
        """Mean radiance, linear Rec. 709, not clamped: `float32`, height × width × 3. Not denoised."""
        return self._array(self._native.pixels(), np.float32, 3)

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        pixels = self.numpy()
        return pixels if dtype is None else pixels.astype(dtype)

    @property
    def shape(self) -> Tuple[int, int, int]:
        """Height, width, 3."""
        return (self.height, self.width, 3)

    @property
    def denoised(self) -> Optional[np.ndarray]:
        """The same without most of its noise; `None` unless it was rendered with `denoise=True`."""
        data = self._native.denoised()
        return None if data is None else self._array(data, np.float32, 3)

    @property
    def error(self) -> Optional[float]:
        """Estimated relative error of the whole image: 0.01 is 1 %. `None` with too few samples."""
        return self._native.error and self._native.error[0]

    @property
    def error_interval(self) -> Optional[Tuple[float, float]]:
        """Bounds that contain the true error with a probability of about 95 %."""
        return self._native.error and self._native.error[1:]

    @property
    def denoised_error(self) -> Optional[float]:
        """Estimated relative error of the denoised image."""
        return self._native.denoised_error and self._native.denoised_error[0]

    @property
    def denoised_error_interval(self) -> Optional[Tuple[float, float]]:
        """Bounds of that error, as `error_interval`."""
        return self._native.denoised_error and self._native.denoised_error[1:]

    @property
    def object_names(self) -> List[str]:
        """Names of the objects: `layers["object"]` has their indices, −1 where there is none."""
        return self._native.layer_names()[0]

    @property
    def material_names(self) -> List[str]:
        """Names of the materials: `layers["material"]` has their indices, −1 where there is none."""
        return self._native.layer_names()[1]

    def rgba(self) -> np.ndarray:
        """The image for a display, with exposure and tone curve: `uint8`, sRGB, height × width × 4."""
        return self._array(self._native.rgba(), np.uint8, 4)

    def png(self) -> bytes:
        """The same as the bytes of a PNG file."""
        return self._native.png()

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Saves a PNG or JPEG for a display, or an EXR with linear radiance and all layers. An image that was rendered
        with `denoise=True` is saved denoised. PNG and EXR open as the scene again, unless meshes came from arrays."""
        self._native.save(os.fspath(path))

    def _repr_png_(self) -> bytes:
        return self.png()

    def __repr__(self) -> str:
        error = "" if self.error is None else f", error {100 * self.error:.2g} %"
        return f"<Image {self.width} × {self.height}, {self.spp} spp{error}>"
