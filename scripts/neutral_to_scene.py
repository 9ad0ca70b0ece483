#!/usr/bin/env python3
"""Turns a scene in the neutral JSON form of the reference set into a firstlight scene file.

    scripts/neutral_to_scene.py SCENE.json [-o SCENE.ron]

Every field is either carried over or refused with its name: a scene that converts is the same scene. Paths of meshes
and textures are written relative to the new file. Needs Python 3.8 and nothing else.
"""

import argparse
import json
import math
import os
import sys


class Refused(Exception):
    """Something in the file that the scene format cannot say, with the place where it stands."""


def fields(where, value, required, optional=()):
    """The named fields of a JSON object; anything missing or unknown is refused."""
    if not isinstance(value, dict):
        raise Refused(f"{where}: expected an object, found {value!r}")
    missing = [name for name in required if name not in value]
    unknown = [name for name in value if name not in required and name not in optional]
    if missing:
        raise Refused(f"{where}: `{missing[0]}` is missing")
    if unknown:
        known = ", ".join(f"`{name}`" for name in (*required, *optional))
        raise Refused(f"{where}: unknown field `{unknown[0]}` (known: {known})")
    return value


def number(where, value):
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise Refused(f"{where}: expected a finite number, found {value!r}")
    return repr(value)


def vector(where, value, n=3):
    if not isinstance(value, list) or len(value) != n:
        raise Refused(f"{where}: expected {n} numbers, found {value!r}")
    return "(" + ", ".join(number(where, x) for x in value) + ")"


def whole(where, value):
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise Refused(f"{where}: expected a whole number from 1 on, found {value!r}")
    return repr(value)


def kind_of(where, value):
    if not isinstance(value, dict):
        raise Refused(f"{where}: expected an object, found {value!r}")
    return value.get("type")


def text(value):
    return json.dumps(value, ensure_ascii=False)


class Converter:
    def __init__(self, scene, source, target):
        self.scene = scene
        self.source = os.path.dirname(os.path.abspath(source))
        self.target = os.path.dirname(os.path.abspath(target))
        # Textures need surface coordinates, which only quads have in this form.
        self.textured = set()

    def path(self, where, name):
        full = os.path.join(self.source, name)
        if not os.path.isfile(full):
            raise Refused(f"{where}: no file {full}")
        return text(os.path.relpath(full, self.target))

    def convert(self):
        scene = fields(
            "scene", self.scene, ("camera", "materials", "objects"),
            ("name", "about", "filter", "environment", "textures", "max_depth", "ref"),
        )
        if scene.get("filter", "box") != "box":
            raise Refused(f"filter: only \"box\" is defined, found {scene['filter']!r}")
        out = ["("]
        for comment in (scene.get("name"), scene.get("about")):
            out += [f"    // {line}" for line in str(comment or "").splitlines()]
        out += self.camera(scene["camera"])
        depth = scene.get("max_depth")
        if depth is not None:
            out.append(f"    max_depth: {whole('max_depth', depth)},")
        if scene.get("environment") is not None:
            out.append(f"    environment: constant({vector('environment', scene['environment'])}),")
        for field, kind in (("textures", dict), ("materials", dict), ("objects", list)):
            if not isinstance(scene.get(field) or kind(), kind):
                raise Refused(f"{field}: expected {'an object' if kind is dict else 'a list'}, found {scene[field]!r}")
        textures = [self.texture(name, value) for name, value in (scene.get("textures") or {}).items()]
        out += ["    textures: {", *textures, "    },"] if textures else []
        out += ["    materials: {"]
        out += [self.material(name, value) for name, value in scene["materials"].items()]
        out += ["    },", "    objects: ["]
        out += [self.object(f"objects[{i}]", value) for i, value in enumerate(scene["objects"])]
        return "\n".join([*out, "    ],", ")", ""])

    def camera(self, value):
        names = ("origin", "look_at", "up", "vfov", "width", "height", "aperture_radius", "focus_distance")
        camera = fields("camera", value, names[:6], names[6:])
        lines = [
            "    camera: (",
            f"        eye: {vector('camera.origin', camera['origin'])},",
            f"        look_at: {vector('camera.look_at', camera['look_at'])},",
            f"        up: {vector('camera.up', camera['up'])},",
            f"        vfov: {number('camera.vfov', camera['vfov'])},",
        ]
        if camera.get("aperture_radius", 0):
            if "focus_distance" not in camera:
                raise Refused("camera: an aperture needs a `focus_distance`")
            lines.append(f"        lens_radius: {number('camera.aperture_radius', camera['aperture_radius'])},")
            lines.append(f"        focus_distance: {number('camera.focus_distance', camera['focus_distance'])},")
        width, height = whole("camera.width", camera["width"]), whole("camera.height", camera["height"])
        return [*lines, "    ),", f"    film: (width: {width}, height: {height}),"]

    def texture(self, name, value):
        where = f"textures.{name}"
        kind = kind_of(where, value)
        if kind == "checker":
            checker = fields(where, value, ("type", "a", "b", "squares"))
            colors = ", ".join(f"{c}: {vector(f'{where}.{c}', checker[c])}" for c in "ab")
            squares = vector(f"{where}.squares", checker["squares"], 2)
            return f"        {text(name)}: checker({colors}, squares: {squares}),"
        if kind == "image":
            image = fields(where, value, ("type", "file"))
            return f"        {text(name)}: image(file: {self.path(where, image['file'])}, smooth: false),"
        raise Refused(f"{where}: unknown type {kind!r} (known: \"checker\", \"image\")")

    def paint(self, where, value, material):
        """A colour, or the name of a texture."""
        if not isinstance(value, dict):
            return vector(where, value)
        name = fields(where, value, ("texture",))["texture"]
        if name not in (self.scene.get("textures") or {}):
            raise Refused(f"{where}: texture {name!r} is not defined")
        self.textured.add(material)
        return text(name)

    def material(self, name, value):
        where = f"materials.{name}"
        kind = kind_of(where, value)
        if kind in ("diffuse", "mirror", "emissive"):
            color = {"diffuse": "albedo", "mirror": "reflectance", "emissive": "radiance"}[kind]
            given = fields(where, value, ("type", color))[color]
            said = f"{kind}({color}: {self.paint(f'{where}.{color}', given, name)})"
        elif kind == "metal":
            metal = fields(where, value, ("type", "alpha", "reflectance"))
            reflectance = self.paint(where + ".reflectance", metal["reflectance"], name)
            alpha = number(where + ".alpha", metal["alpha"])
            said = f"metal(alpha: {alpha}, reflectance: {reflectance}, fresnel: constant, compensate: false)"
        elif kind == "glass":
            said = f"glass(ior: {number(where + '.ior', fields(where, value, ('type', 'ior'))['ior'])})"
        elif kind == "blend":
            blend = fields(where, value, ("type", "weight", "a", "b"))
            for part in (blend["a"], blend["b"]):
                if part not in self.scene["materials"]:
                    raise Refused(f"{where}: material {part!r} is not defined")
            if self.holds(name, blend["a"]) or self.holds(name, blend["b"]):
                raise Refused(f"{where}: is a part of itself")
            weight = number(where + ".weight", blend["weight"])
            said = f"blend(weight: {weight}, a: {text(blend['a'])}, b: {text(blend['b'])})"
        else:
            raise Refused(f"{where}: unknown type {kind!r}")
        return f"        {text(name)}: {said},"

    def holds(self, name, part, seen=()):
        """Whether a material is this part, or one of the parts that it is blended of."""
        value = self.scene["materials"].get(part)
        if part == name or part in seen or not isinstance(value, dict):
            return part == name
        return any(self.holds(name, value.get(key), (*seen, part)) for key in "ab" if isinstance(value.get(key), str))

    def uses_texture(self, name):
        value = self.scene["materials"][name]
        parts = [value["a"], value["b"]] if value.get("type") == "blend" else []
        return name in self.textured or any(self.uses_texture(part) for part in parts)

    def object(self, where, value):
        kind = kind_of(where, value)
        names = {
            "sphere": ("type", "center", "radius", "material"),
            "spheres": ("type", "centers", "radii", "material"),
            "quad": ("type", "corner", "edge_u", "edge_v", "material"),
            "mesh": ("type", "obj", "material"),
        }
        if kind not in names:
            raise Refused(f"{where}: unknown type {kind!r} (known: {', '.join(names)})")
        placed = ("scale", "rotate_y", "translate", "matrix", "smooth")
        part = fields(where, value, names[kind], placed if kind == "mesh" else ())
        material = part["material"]
        if material not in self.scene["materials"]:
            raise Refused(f"{where}: material {material!r} is not defined")
        if kind != "quad" and self.uses_texture(material):
            raise Refused(f"{where}: a {kind} has no surface coordinates for the texture of {material!r}")
        if kind == "sphere":
            center, radius = vector(where + ".center", part["center"]), number(where + ".radius", part["radius"])
            said = f"sphere(center: {center}, radius: {radius}"
        elif kind == "spheres":
            said = self.spheres(where, part)
        elif kind == "quad":
            edges = ", ".join(f"{edge}: {vector(f'{where}.{edge}', part[edge])}" for edge in ("edge_u", "edge_v"))
            said = f"quad(corner: {vector(where + '.corner', part['corner'])}, {edges}"
        else:
            said = self.mesh(where, part)
        return f"        {said}, material: {text(material)}),"

    def spheres(self, where, part):
        flat, radii = part["centers"], part["radii"]
        if not isinstance(flat, list) or len(flat) % 3:
            raise Refused(f"{where}.centers: expected x, y, z of each ball in one list")
        if isinstance(radii, list) and len(radii) != len(flat) // 3:
            raise Refused(f"{where}.radii: {len(radii)} radii for {len(flat) // 3} balls")
        centers = ", ".join(vector(where + ".centers", flat[i:i + 3]) for i in range(0, len(flat), 3))
        if isinstance(radii, list):
            said = f"each([{', '.join(number(where + '.radii', r) for r in radii)}])"
        else:
            said = f"all({number(where + '.radii', radii)})"
        return f"spheres(centers: [{centers}], radii: {said}"

    def mesh(self, where, part):
        shading = "smooth" if part.get("smooth", False) else "flat"
        said = f"mesh(source: obj({self.path(where, part['obj'])}), shading: {shading}"
        if part.get("matrix") is not None:
            if any(part.get(name) is not None for name in ("scale", "rotate_y", "translate")):
                raise Refused(f"{where}: `matrix` stands alone, without scale, rotate_y or translate")
            return f"{said}, transform: (matrix: {self.matrix(where, part['matrix'])})"
        steps = []
        scale = part.get("scale")
        if scale is not None:
            said_scale = vector(where + ".scale", scale) if isinstance(scale, list) else number(where + ".scale", scale)
            steps.append(f"scale: {said_scale}")
        if part.get("rotate_y"):
            steps.append(f"rotate: (0, {number(where + '.rotate_y', part['rotate_y'])}, 0)")
        if part.get("translate") is not None:
            steps.append(f"translate: {vector(where + '.translate', part['translate'])}")
        return f"{said}, transform: ({', '.join(steps)})" if steps else said

    def matrix(self, where, value):
        """Rows of an affine map: 3 or 4 rows of 4, nested or flat; a fourth row must be 0 0 0 1."""
        nested = bool(value) and isinstance(value[0], list)
        rows = value if nested else [value[i:i + 4] for i in range(0, len(value), 4)]
        if len(rows) not in (3, 4) or any(len(row) != 4 for row in rows):
            raise Refused(f"{where}.matrix: expected 3 or 4 rows of 4 numbers")
        if len(rows) == 4 and [float(x) for x in rows[3]] != [0.0, 0.0, 0.0, 1.0]:
            raise Refused(f"{where}.matrix: the last row must be 0 0 0 1, translation stands in the last column")
        return "(" + ", ".join(vector(f"{where}.matrix", row, 4) for row in rows[:3]) + ")"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", help="scene in neutral JSON form")
    parser.add_argument("-o", "--output", help="scene file to write (default: beside the input, with .ron)")
    args = parser.parse_args()
    output = args.output or os.path.splitext(args.scene)[0] + ".ron"
    try:
        with open(args.scene, encoding="utf-8") as file:
            scene = json.load(file)
        converted = Converter(scene, args.scene, output).convert()
        with open(output + ".tmp", "w", encoding="utf-8") as file:
            file.write(converted)
        os.replace(output + ".tmp", output)
    except (OSError, json.JSONDecodeError, Refused) as error:
        print(f"error: {args.scene}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
