"""Scenes: opened from files or built from arrays, changed and rendered again."""

from __future__ import annotations

import os
import time
import warnings as _warnings
from typing import Any, Callable, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _firstlight
from ._errors import Error, InputError
from ._image import OF_FILM, Image, wanted_layers
from ._parts import Camera, Environment, Material
from ._text import Parts, struct

#: The material of objects that are given none.
GREY = Material("diffuse", albedo=0.5)

_last_interrupt = float("-inf")


def open(
    source: Union[str, "os.PathLike[str]"],
    *,
    up: Optional[str] = None,
    camera: Optional[str] = None,
    at: Optional[float] = None,
    variant: Optional[str] = None,
    environment: Union[str, "os.PathLike[str]", None] = None,
) -> "Scene":
    """Opens a model, a scene file, an image that firstlight saved, or a built-in scene by its name.

    - `up`: "y" or "z", the up axis of a model; guessed if not given.
    - `camera`, `at`, `variant`: camera, time in seconds and variant of a scene that has several.
    - `environment`: path of an image that replaces the environment.
    """
    native = _firstlight.Scene.open(
        os.fspath(source), up, camera, at, variant, None if environment is None else os.fspath(environment)
    )
    scene = Scene(_native=native)
    for warning in native.warnings():
        _warnings.warn(warning, stacklevel=2)
    return scene


def builtin_scenes() -> Dict[str, str]:
    """Names of the built-in scenes, each with what it shows."""
    return dict(_firstlight.builtin_scenes())


def _doubles(given: Any, shape: Tuple[int, ...], what: str) -> np.ndarray:
    """An array of this shape, in which −1 is any number."""
    array = np.ascontiguousarray(given, dtype=np.float64)
    fits = array.ndim == len(shape) and all(want in (-1, has) for want, has in zip(shape, array.shape))
    if not fits:
        wanted = " × ".join("n" if want == -1 else str(want) for want in shape)
        raise InputError(f"`{what}` has the shape {array.shape}, but must be {wanted}")
    return array


def _matrices(given: Any) -> bytes:
    """Transforms as bytes: 4 × 4 or 3 × 4 matrices, or translations; one or many."""
    array = np.asarray(given, dtype=np.float64)
    if array.shape == (3,) or (array.ndim == 2 and array.shape[1:] == (3,)):
        moved = np.tile(np.eye(3, 4), (array.size // 3, 1, 1))
        moved[:, :, 3] = array.reshape(-1, 3)
        return moved.tobytes()
    if array.ndim not in (2, 3) or array.shape[-1] != 4 or array.shape[-2] not in (3, 4):
        raise InputError(
            f"a transform is 4 × 4, 3 × 4 or a translation of 3 numbers, but this has the shape {array.shape}"
        )
    return np.ascontiguousarray(array[..., :3, :]).tobytes()


class Object:
    """An object or a light of a scene."""

    def __init__(self, scene: "Scene", entity: int, name: Optional[str] = None, mesh: Any = None) -> None:
        self._scene, self._entity, self.name = scene, entity, name
        self._mesh: Dict[str, Any] = mesh or {}

    def place(self, transform: Any) -> None:
        """Moves it: a 4 × 4 or 3 × 4 matrix from object space to the world, or a translation."""
        self._scene._native.place([self._entity], _matrices(transform))

    def set(self, field: str, given: Any) -> None:
        """Sets a property, such as `radius` or `intensity`; see `Scene.set`."""
        if self.name is None:
            raise InputError("an object without a name has no properties: give it one")
        self._scene.set(f"{self.name}.{field}", given)

    def dress(self, *materials: Union[Material, str]) -> None:
        """Gives it other materials, one per slot of its mesh."""
        self._scene._native.set_slots(self._entity, self._scene._entities_of(materials))

    def reshape(self, **arrays: Any) -> None:
        """Replaces arrays of a mesh: `vertices`, `faces`, `normals`, `uv`, `colors`, `slots`."""
        if not self._mesh:
            raise InputError("only a mesh that was made of arrays can be reshaped")
        mesh = {**self._mesh, **arrays}
        if "vertices" in arrays and "normals" not in arrays:
            mesh["normals"] = None
        self._scene._native.put_mesh(self._entity, _mesh(**mesh))
        self._mesh = mesh

    def remove(self) -> None:
        """Removes it from the scene."""
        self._scene._native.remove([self._entity])

    def __repr__(self) -> str:
        return f"<Object {self.name or self._entity}>"


class Instances:
    """Many objects of one shape, which share its tree."""

    def __init__(self, scene: "Scene", entities: List[int]) -> None:
        self._scene, self._entities = scene, entities

    def __len__(self) -> int:
        return len(self._entities)

    def place(self, transforms: Any) -> None:
        """Moves all of them: n × 4 × 4, n × 3 × 4, or n translations."""
        self._scene._native.place(self._entities, _matrices(transforms))

    def remove(self) -> None:
        """Removes all of them from the scene."""
        self._scene._native.remove(self._entities)


def _mesh(vertices: Any, faces: Any, normals: Any, uv: Any, colors: Any, slots: Any) -> Tuple[bytes, ...]:
    """The arrays of a mesh as bytes."""
    positions = _doubles(vertices, (-1, 3), "vertices")
    triangles = np.asarray(faces)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        raise InputError(f"`faces` has the shape {triangles.shape}, but must be n × 3 whole numbers")
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(positions)):
        at = int(np.argmax(((triangles < 0) | (triangles >= len(positions))).any(axis=1)))
        index = next(int(i) for i in triangles[at] if not 0 <= i < len(positions))
        raise InputError(f"triangle {at} uses vertex {index}, but there are {len(positions)}")

    def floats(given: Any, n: int, what: str) -> bytes:
        return b"" if given is None else _doubles(given, (-1, n), what).astype(np.float32).tobytes()

    if colors is not None and np.shape(colors)[-1] == 3:
        colors = np.concatenate([np.asarray(colors, dtype=np.float64), np.ones((len(colors), 1))], axis=1)
    return (
        positions.tobytes(),
        np.ascontiguousarray(triangles, dtype=np.uint32).tobytes(),
        floats(normals, 3, "normals"),
        floats(uv, 2, "uv"),
        floats(colors, 4, "colors"),
        b"" if slots is None else np.ascontiguousarray(slots, dtype=np.uint16).tobytes(),
    )


class Scene:
    """A scene: objects, materials, lights, an environment and a camera. `Scene()` is empty; `fl.open` opens one.

    It can be changed at any time; the next image rebuilds only what depends on the change.
    """

    def __init__(self, *, _native: Any = None) -> None:
        self._native = _native or _firstlight.Scene()
        self._names: Dict[Material, str] = {}
        #: The last image that was rendered.
        self.image: Optional[Image] = None

    # Names.

    @property
    def materials(self) -> List[str]:
        """Names of the materials."""
        return [name for name, _ in self._native.names()[0]]

    @property
    def objects(self) -> List[str]:
        """Names of the objects that have one."""
        return [name for name, _ in self._native.names()[1]]

    @property
    def lights(self) -> List[str]:
        """Names of the lights that are no objects and have one."""
        return [name for name, _ in self._native.names()[2]]

    def __getitem__(self, name: str) -> Object:
        """The object or light of a name."""
        _, objects, lights = self._native.names()
        for known, entity in objects + lights:
            if known == name:
                return Object(self, entity, name)
        raise KeyError(name)

    # Materials.

    def material(self, name: str, material: Material) -> Material:
        """Adds a material under a name, for `set("name.property", …)`; objects take it by its name or itself."""
        if name in self.materials:
            raise InputError(f"there is a material `{name}` already: set(`{name}`, …) replaces it")
        self._names[material] = name
        self._add(self._parts_of([material]))
        return material

    def _name_of(self, parts: Parts, material: Union[Material, str]) -> str:
        """The name of a material, whose text is in `parts` from then on."""
        if isinstance(material, str):
            # One of the scene, whose values count. If there is none, the engine says so.
            known = self.materials
            names = [material] if material in known else known
            for name in names:
                parts.materials.setdefault(name, struct("diffuse", {"albedo": 0}))
            return material
        if material not in self._names:
            taken, number, name = set(self.materials) | set(self._names.values()), 1, material.kind
            while name in taken:
                number, name = number + 1, f"{material.kind} {number + 1}"
            self._names[material] = name
        name = self._names[material]
        if name not in parts.materials:
            material._add_to(parts, name, self._name_of)
        return name

    def _parts_of(self, materials: Iterable[Union[Material, str]]) -> Parts:
        parts = Parts()
        for material in materials:
            self._name_of(parts, material)
        return parts

    def _add(self, parts: Parts) -> Tuple[List[int], List[int], List[int]]:
        return self._native.add(parts.text(), parts.images)

    def _entities_of(self, materials: Iterable[Union[Material, str, None]]) -> List[int]:
        parts, names = Parts(), []
        for material in materials:
            names.append(self._name_of(parts, GREY if material is None else material))
        by_name = dict(zip(parts.materials, self._add(parts)[0]))
        missing = [name for name in names if name not in by_name]
        if missing:
            # The engine knows the most similar name.
            parts.objects.append(struct("sphere", {"radius": 1, "material": missing[0]}))
            self._add(parts)
        return [by_name[name] for name in names]

    # Objects.

    def _object(self, kind: str, name: Optional[str], material: Any, fields: Dict[str, Any]) -> Object:
        parts = Parts()
        material_name = self._name_of(parts, GREY if material is None else material)
        parts.objects.append(struct(kind, {"name": name, **fields, "material": material_name}))
        return Object(self, self._add(parts)[1][0], name)

    def sphere(
        self, center: Any = (0, 0, 0), radius: float = 1, material: Any = None, name: Optional[str] = None
    ) -> Object:
        """Adds a sphere."""
        return self._object("sphere", name, material, {"center": center, "radius": radius})

    def plane(
        self, point: Any = (0, 0, 0), normal: Any = (0, 1, 0), material: Any = None, name: Optional[str] = None
    ) -> Object:
        """Adds an infinite plane."""
        return self._object("plane", name, material, {"point": point, "normal": normal})

    def quad(self, corner: Any, edge_u: Any, edge_v: Any, material: Any = None, name: Optional[str] = None) -> Object:
        """Adds a parallelogram; its front, which emits light, is on the side of `edge_u` × `edge_v`."""
        return self._object("quad", name, material, {"corner": corner, "edge_u": edge_u, "edge_v": edge_v})

    def spheres(
        self, centers: Any, radii: Any, material: Any = None, transform: Any = None, name: Optional[str] = None
    ) -> Object:
        """Adds many spheres as one object: n × 3 centres; one radius, or one each."""
        centers = _doubles(centers, (-1, 3), "centers")
        radii = np.ascontiguousarray(np.broadcast_to(np.asarray(radii, dtype=np.float64), (len(centers),)))
        placement = b"" if transform is None else _matrices(transform)
        arrays = (centers.tobytes(), radii.tobytes())
        return Object(self, self._native.add_spheres(name, arrays, self._entities_of([material]), placement), name)

    def mesh(
        self,
        vertices: Any,
        faces: Any,
        normals: Any = None,
        uv: Any = None,
        colors: Any = None,
        material: Any = None,
        slots: Any = None,
        transform: Any = None,
        name: Optional[str] = None,
    ) -> Object:
        """Adds a triangle mesh.

        - `vertices`: n × 3, metres; `faces`: m × 3 indices, counter-clockwise seen from the front.
        - `normals`: n × 3 unit vectors; without, faces are flat. `uv`: n × 2. `colors`: n × 3 or n × 4, linear.
        - `material`: one, or a list of which `slots` names one per face.
        - `transform`: from object space to the world, 4 × 4, 3 × 4 or a translation.
        """
        arrays = {"vertices": vertices, "faces": faces, "normals": normals, "uv": uv, "colors": colors, "slots": slots}
        mesh = _mesh(**arrays)
        materials = material if isinstance(material, (list, tuple)) else [material]
        placement = b"" if transform is None else _matrices(transform)
        entity = self._native.add_mesh(name, mesh, self._entities_of(materials), placement)
        return Object(self, entity, name, arrays)

    def instances(self, of: Object, transforms: Any, material: Any = None) -> Instances:
        """Adds copies of an object, one per transform: n × 4 × 4, n × 3 × 4, or n translations. They share its tree."""
        materials = [] if material is None else self._entities_of([material])
        return Instances(self, self._native.add_copies(of._entity, _matrices(transforms), materials))

    # Lights.

    def _light(self, kind: str, name: Optional[str], fields: Dict[str, Any]) -> Object:
        parts = Parts()
        parts.lights.append(struct(kind, {"name": name, **fields}))
        return Object(self, self._add(parts)[2][0], name)

    def point_light(
        self, position: Any, intensity: Any, radius: Optional[float] = None, name: Optional[str] = None
    ) -> Object:
        """Adds a light that emits in all directions; `intensity` in W·sr⁻¹. With a radius of 0 it is a point."""
        return self._light("point", name, {"position": position, "intensity": intensity, "radius": radius})

    def spot_light(
        self,
        position: Any,
        direction: Any,
        intensity: Any,
        inner_angle: Optional[float] = None,
        outer_angle: Optional[float] = None,
        falloff: Optional[str] = None,
        name: Optional[str] = None,
    ) -> Object:
        """Adds a light that emits into a cone; `intensity` in W·sr⁻¹, angles from its axis."""
        fields = {"position": position, "direction": direction, "intensity": intensity, "falloff": falloff}
        return self._light("spot", name, {**fields, "inner_angle": inner_angle, "outer_angle": outer_angle})

    def directional_light(self, direction: Any, irradiance: Any, name: Optional[str] = None) -> Object:
        """Adds parallel light from infinitely far away; `irradiance` in W·m⁻²."""
        return self._light("directional", name, {"direction": direction, "irradiance": irradiance})

    # The rest.

    @property
    def camera(self) -> Optional[Camera]:
        """The camera; what is changed in it changes the scene. `None` if there is none."""
        text = self._native.camera()
        return None if text is None else Camera._of_scene(self, text)

    @camera.setter
    def camera(self, camera: Camera) -> None:
        parts = Parts()
        parts.camera = struct("", dict(camera))
        self._native.put_camera(parts.text())

    def _set_environment(self, given: Any) -> None:
        parts = Parts()
        Environment.of(given)._add_to(parts)
        self._native.put_environment(parts.text(), parts.images)

    #: A radiance, an array or a path of an image, or an `Environment`. It can be set only.
    environment = property(None, _set_environment)

    def set(self, name: str, given: Any) -> None:
        """Sets a property, `set("glass.ior", 1.4)`, or a whole material, `set("glass", fl.mirror())`.

        Properties are those of materials, of objects (`translate`, `rotate`, `scale`, `radius`), of lights and of
        `camera`, by their names in scene files.
        """
        if isinstance(given, Material):
            entities = dict(self._native.names()[0])
            if name not in entities:
                # The engine knows the most similar name.
                self._entities_of([name])
            parts, temporary = Parts(), f"what {name} becomes"
            given._add_to(parts, temporary, self._name_of)
            new = dict(zip(parts.materials, self._add(parts)[0]))[temporary]
            self._native.copy_material(new, entities[name])
            self._native.remove([new])
            return
        owner, dot, field = name.rpartition(".")
        if not dot:
            raise InputError(f"`{name}` names no property: write it as `name.property`, such as `glass.ior`")
        number = np.asarray(given, dtype=np.float64)
        if number.shape not in ((), (3,)):
            raise InputError(f"`{field}` is {given!r}, but must be a number or three")
        self._native.set(owner, field, np.broadcast_to(number, (3,)).tolist())

    def to_ron(self) -> str:
        """The scene as the text of a scene file. Arrays have no place in it."""
        return self._native.to_ron()

    # Images.

    def render(
        self,
        width: Optional[int] = None,
        height: Optional[int] = None,
        *,
        spp: Optional[int] = None,
        seconds: Optional[float] = None,
        error: Optional[float] = None,
        seed: Optional[int] = None,
        layers: Union[bool, str, Sequence[str]] = False,
        denoise: bool = False,
        integrator: Optional[str] = None,
        max_depth: Optional[int] = None,
        filter: Optional[str] = None,
        adaptive: Optional[bool] = None,
        exposure: float = 0.0,
        threads: Optional[int] = None,
        progress: Optional[Callable[[int, float, Optional[float]], Any]] = None,
    ) -> Image:
        """Renders an image; other threads of Python run meanwhile.

        - `width`, `height`: pixels; those of the scene if not given. One of them keeps its proportions.
        - `spp`, `seconds`, `error`: when to stop, at the first that is reached; 256 samples per pixel without any.
          `error` is the estimated relative error of the whole image, 0.01 for 1 %.
        - `seed`: another one gives other noise. Same scene and seed, same bytes, also by the program.
        - `layers`: `True`, or names: albedo, normal, position, depth, coverage, object, material, error, samples.
        - `denoise`: makes `image.denoised` as well.
        - `integrator`, `max_depth`, `filter`: as in scene files. `adaptive=False`: the same number of samples everywhere.
        - `exposure`: stops, for PNG and JPEG.
        - `progress`: called a few times per second with samples per pixel, seconds, and the error if it is known;
          `False` ends the rendering.

        Ctrl+C ends it, and the image has the samples until then: `image.interrupted`. A second one within two seconds
        raises `KeyboardInterrupt`, so that it ends a loop.
        """
        global _last_interrupt
        wanted = wanted_layers(layers)  # type: ignore[arg-type]
        options = {
            "size": self._size(width, height),
            "spp": spp,
            "seconds": seconds,
            "error": error,
            "seed": seed,
            "integrator": integrator,
            "max_depth": max_depth,
            "filter": filter,
            "adaptive": adaptive,
            "exposure": exposure,
            "threads": threads,
            "features": any(layer not in OF_FILM for layer in wanted),
            "denoise": denoise,
        }
        native, interrupted = self._native.render(options, progress)
        self.image = Image(native, wanted, interrupted)
        if interrupted:
            now = time.monotonic()
            last, _last_interrupt = _last_interrupt, now
            if now - last < 2:
                raise KeyboardInterrupt
        for warning in self.image.warnings:
            _warnings.warn(warning, stacklevel=2)
        return self.image

    def _size(self, width: Optional[int], height: Optional[int]) -> Optional[Tuple[int, int]]:
        if width is None and height is None:
            return None
        if width is None or height is None:
            own = self._native.size()
            if width is None:
                width = max(1, round(height * own[0] / own[1]))  # type: ignore[operator]
            else:
                height = max(1, round(width * own[1] / own[0]))
        return (width, height)  # type: ignore[return-value]

    def view(self, width: int = 640, height: int = 360, spp: int = 256) -> Any:
        """A widget for notebooks: drag to orbit, wheel to come nearer, Shift+click to focus, double click to go back.

        The image converges up to `spp` samples per pixel; the camera of the scene follows. Needs the package
        `anywidget`.
        """
        try:
            from ._view import Viewer
        except ModuleNotFoundError as error:
            raise Error(f"the widget needs the package {error.name}: pip install anywidget") from None
        return Viewer(self, width, height, spp)

    def __repr__(self) -> str:
        materials, objects, lights = self._native.names()
        return f"<Scene: {len(materials)} materials, {len(objects)} named objects, {len(lights)} named lights>"


def render_many(scene: Scene, cameras: Iterable[Camera], **options: Any) -> Iterator[Image]:
    """Renders a scene by each camera, with the options of `Scene.render`; keeps trees and threads.

    It ends after an image that Ctrl+C ended.
    """
    for camera in cameras:
        scene.camera = camera
        image = scene.render(**options)
        yield image
        if image.interrupted:
            return
