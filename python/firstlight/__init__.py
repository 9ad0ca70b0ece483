"""firstlight: an interactive, progressive path tracer for the CPU.

    import firstlight as fl
    image = fl.open("cornell").render(width=320, height=320, spp=64)
    image.save("cornell.png")

Units are metres and degrees, colours are linear Rec. 709, Y is up. Start reading at `Scene`.
"""

from . import materials
from ._errors import Error, InputError, MemoryError
from ._firstlight import __version__
from ._image import Image, Layers
from ._parts import Camera, Environment, Material, Texture, checker, clear_sky, environment, gradient, texture, vertex_colors
from ._scene import Instances, Object, Scene, builtin_scenes, open, render_many
from .materials import *  # noqa: F403

__all__ = [
    "Camera",
    "Environment",
    "Error",
    "Image",
    "InputError",
    "Instances",
    "Layers",
    "Material",
    "MemoryError",
    "Object",
    "Scene",
    "Texture",
    "__version__",
    "builtin_scenes",
    "checker",
    "clear_sky",
    "environment",
    "gradient",
    "open",
    "render_many",
    "texture",
    "vertex_colors",
    *materials.__all__,
]
