#!/usr/bin/env python3
"""Turns a scene in the neutral JSON form of the reference set into a firstlight scene file.

    scripts/neutral_to_scene.py SCENE.json [-o SCENE.ron]

Every field is either carried over or refused with its name: a scene that converts is the same scene, and firstlight
takes it. A refusal is one line on the error output with exit status 1, and nothing is written. Paths of meshes and
textures are written relative to the new file. Needs Python 3.8 and nothing else.
"""

import argparse
import json
import math
import os
import struct
import sys
import zlib


class Refused(Exception):
    """Something in the file that is wrong or that cannot be said, with the place where it stands."""


# ---- Single values: each takes the place where a value stands and the value, and gives the text of the scene file. ----

LARGEST = 1e12  # Metres that firstlight takes, and what it takes for a length that is not there.
SMALLEST = 1e-12
LARGEST_LIGHT = 3.4e38  # Radiance is kept in 32-bit floats.


def quantity(where, value):
    try:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise Refused(f"{where}: expected a finite number, found {brief(value)}")
    except OverflowError:
        raise Refused(f"{where}: the number is too large") from None
    return value


def number(holds, rule):
    """A reader of numbers that `holds` takes; `rule` says which in words."""
    def read(where, value):
        if not holds(quantity(where, value)):
            raise Refused(f"{where} is {brief(value)}, but must be {rule}")
        return repr(value if abs(value) < 2**53 else float(value))
    return read


def vector(one, n=3):
    """A reader of lists of `n` values, each of them as `one` says."""
    def read(where, value):
        if not isinstance(value, list) or len(value) != n:
            raise Refused(f"{where}: expected a list of {n} numbers, found {brief(value)}")
        return "(" + ", ".join(one(where, x) for x in value) + ")"
    return read


def whole(where, value, high):
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= high:
        raise Refused(f"{where}: expected a whole number from 1 to {high}, found {brief(value)}")
    return str(value)


def string(where, value):
    """Text on one line."""
    if not isinstance(value, str):
        raise Refused(f"{where}: expected text, found {brief(value)}")
    if any(ord(c) < 32 or 0xD800 <= ord(c) < 0xE000 for c in value):
        raise Refused(f"{where}: {value!a} has a character that cannot stand in a name")
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'


def truth(where, value):
    if not isinstance(value, bool):
        raise Refused(f"{where}: expected true or false, found {brief(value)}")
    return value


any_number = number(lambda x: -LARGEST <= x <= LARGEST, "within 1e12")
point = vector(any_number)
size = number(lambda x: SMALLEST <= x <= LARGEST, "above 0 (1e-12 to 1e12 m)")
share = number(lambda x: 0 <= x <= 1, "between 0 and 1")
shares = vector(share)
light = vector(number(lambda x: 0 <= x <= LARGEST_LIGHT, "0 or more, and finite in 32 bits"))


def brief(value):
    said = ascii(value)
    return said if len(said) <= 60 else said[:57] + "..."


def length(a):
    return math.sqrt(sum(x * x for x in a))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


# ---- Objects of the file: which fields they have. ----

def fields(where, value, required, optional=()):
    """A JSON object with these fields; anything missing or unknown is refused."""
    if not isinstance(value, dict):
        raise Refused(f"{where}: expected an object, found {brief(value)}")
    for name in required:
        if name not in value:
            raise Refused(f"{where}: `{name}` is missing")
    for name in value:
        if name not in required and name not in optional:
            known = ", ".join(f"`{name}`" for name in (*required, *optional))
            raise Refused(f"{where}: unknown field `{brief(name)[1:-1]}` (known: {known})")
    return value


TEXTURES = {"checker": (("a", "b", "squares"), ()), "image": (("file",), ())}
MATERIALS = {
    "diffuse": (("albedo",), ()),
    "mirror": (("reflectance",), ()),
    "metal": (("alpha", "reflectance"), ()),
    "glass": (("ior",), ()),
    "blend": (("weight", "a", "b"), ()),
    "emissive": (("radiance",), ()),
}
OBJECTS = {
    "sphere": (("center", "radius", "material"), ()),
    "spheres": (("centers", "radii", "material"), ()),
    "quad": (("corner", "edge_u", "edge_v", "material"), ()),
    "mesh": (("obj", "material"), ("scale", "rotate_y", "translate", "matrix", "smooth")),
    "instances": (("obj", "matrices", "material"), ("smooth",)),
}


def kind_of(where, value, kinds):
    """The `type` of an object, after its fields have been looked at."""
    if not isinstance(value, dict):
        raise Refused(f"{where}: expected an object, found {brief(value)}")
    kind = value.get("type")
    if not isinstance(kind, str) or kind not in kinds:
        raise Refused(f"{where}.type: {brief(kind)} is unknown (known: {', '.join(kinds)})")
    required, optional = kinds[kind]
    fields(where, value, ("type", *required), optional)
    return kind


def no_doubles(pairs):
    seen = {}
    for name, value in pairs:
        if name in seen:
            raise Refused(f"field `{brief(name)[1:-1]}` stands twice in one object")
        seen[name] = value
    return seen


def no_constant(name):
    raise Refused(f"{name} is not a number of JSON")


# ---- Files that the scene points at. ----

def check_png(where, path):
    """The form asks for 8-bit sRGB PNGs. Grey, RGB and palettes have 8 bits a sample; opacity counts nowhere."""
    with open(path, "rb") as file:
        data = file.read()
    if not data.startswith(b"\x89PNG\r\n\x1a\n"):
        raise Refused(f"{where}: {path} is not a PNG")
    at, kinds = 8, []
    while at < len(data) and b"IEND" not in kinds:
        head, body = data[at:at + 8], data[at + 8:at + 12 + int.from_bytes(data[at:at + 4], "big")]
        kinds.append(head[4:])
        if len(body) != int.from_bytes(head[:4], "big") + 4 or zlib.crc32(head[4:] + body[:-4]) != int.from_bytes(body[-4:], "big"):
            raise Refused(f"{where}: {path} is damaged or cut short")
        if len(kinds) == 1:
            header = body[:-4]
        at += 8 + len(body)
    if kinds[:1] != [b"IHDR"] or len(header) != 13 or b"IDAT" not in kinds or b"IEND" not in kinds:
        raise Refused(f"{where}: {path} is damaged or cut short")
    width, height, bits, color = struct.unpack(">IIBB", header[:10])
    palette = color == 3
    if bits != 8 and not palette:
        raise Refused(f"{where}: {path} has {bits} bits a sample, but must have 8")
    if not (1 <= width <= 32768 and 1 <= height <= 32768 and width * height <= 1 << 27):
        raise Refused(f"{where}: {path} has {width} x {height} pixels, but firstlight takes 32768 a side and 2^27 in all")


def check_obj(where, path):
    """Whether there is a face at all; what it says beyond positions and faces counts nowhere."""
    with open(path, "rb") as file:
        if not any(line.split()[:1] == [b"f"] for line in file):
            raise Refused(f"{where}: {path} has no faces")


# ---- The scene. ----

class Converter:
    MAX_PARTS = 8  # Plain materials of one blend, as firstlight counts them.

    def __init__(self, scene, source, target):
        self.source = os.path.dirname(os.path.abspath(source))
        self.target = os.path.dirname(os.path.realpath(target))
        self.scene = fields(
            "scene", scene, ("camera", "materials", "objects"),
            ("name", "about", "filter", "environment", "textures", "max_depth", "ref"),
        )
        self.tables = {}
        for field, kind, said in (("textures", dict, "an object"), ("materials", dict, "an object"), ("objects", list, "a list")):
            self.tables[field] = self.scene.get(field, {})
            if not isinstance(self.tables[field], kind):
                raise Refused(f"{field}: expected {said}, found {brief(self.tables[field])}")
        self.parts_of = {}  # Material name -> the plain materials that it comes to.

    def convert(self):
        scene = self.scene
        if scene.get("filter", "box") != "box":
            raise Refused(f"filter: only \"box\" is defined, found {brief(scene['filter'])}")
        self.reference(scene.get("ref", {}))
        out = ["("]
        for field in ("name", "about"):
            comment = scene.get(field, "")
            if not isinstance(comment, str):
                raise Refused(f"{field}: expected text, found {brief(comment)}")
            out += [f"    // {line}" for line in comment.splitlines()]
        out += self.camera(scene["camera"])
        if scene.get("max_depth") is not None:
            depth = scene["max_depth"]
            # No path has more segments than a 32-bit count can say.
            out.append(f"    max_depth: {min(int(whole('max_depth', depth, 2**63)), 2**32 - 1)},")
        if scene.get("environment") is not None:
            out.append(f"    environment: constant({light('environment', scene['environment'])}),")
        textures = [self.texture(name, value) for name, value in self.tables["textures"].items()]
        out += ["    textures: {", *textures, "    },"] if textures else []
        out += ["    materials: {"]
        out += [self.material(name, value) for name, value in self.tables["materials"].items()]
        for name in self.tables["materials"]:
            self.parts(name)
        out += ["    },", "    objects: ["]
        out += [self.object(f"objects[{i}]", value) for i, value in enumerate(self.tables["objects"])]
        return "\n".join([*out, "    ],", ")", ""])

    def reference(self, value):
        """How the reference was made says nothing of the scene, but must be what the form knows."""
        # The form says "integrator, minimum spp" and leaves open how the second is spelt.
        spellings = ("spp", "min_spp", "spp_min", "minimum_spp")
        for name, said in fields("ref", value, (), ("integrator", *spellings)).items():
            if name == "integrator":
                string("ref.integrator", said)
            else:
                whole(f"ref.{name}", said, 2**63)

    def camera(self, value):
        names = ("origin", "look_at", "up", "vfov", "width", "height", "aperture_radius", "focus_distance")
        camera = fields("camera", value, names[:6], names[6:])
        read = {
            "origin": point, "look_at": point, "up": point,
            "vfov": number(lambda x: 0 < x < 180, "above 0 and below 180 degrees"),
            "aperture_radius": number(lambda x: 0 <= x <= LARGEST, "0 or more"), "focus_distance": size,
        }
        said = {name: read[name](f"camera.{name}", camera[name]) for name in read if camera.get(name) is not None}
        for name in names[:4]:
            if name not in said:
                raise Refused(f"camera.{name}: expected a value, found null")
        width, height = (whole(f"camera.{name}", camera[name], 65536) for name in ("width", "height"))
        if camera["width"] * camera["height"] > 1 << 28:
            raise Refused(f"camera.width: {width} x {height} pixels are more than the 2^28 that firstlight takes")
        view = [to - start for start, to in zip(camera["origin"], camera["look_at"])]
        if length(view) < SMALLEST:
            raise Refused("camera.look_at: is the same point as `origin`")
        if length(camera["up"]) < SMALLEST:
            raise Refused("camera.up: has no length")
        if length(cross(view, camera["up"])) <= 1e-9 * length(view) * length(camera["up"]):
            raise Refused("camera.up: is parallel to the view")
        lines = [
            "    camera: (",
            f"        eye: {said['origin']},",
            f"        look_at: {said['look_at']},",
            f"        up: {said['up']},",
            f"        vfov: {said['vfov']},",
        ]
        if camera.get("aperture_radius"):
            if "focus_distance" not in said:
                raise Refused("camera.focus_distance: an aperture needs one")
            lines.append(f"        lens_radius: {said['aperture_radius']},")
            lines.append(f"        focus_distance: {said['focus_distance']},")
        return [*lines, "    ),", f"    film: (width: {width}, height: {height}),"]

    def path(self, where, name, check):
        string(where, name)
        full = os.path.join(self.source, name)
        if not os.path.isfile(full):
            raise Refused(f"{where}: no file {full}")
        check(where, full)
        return string(where, os.path.relpath(os.path.realpath(full), self.target).replace(os.sep, "/"))

    def texture(self, name, value):
        where = f"textures.{name}"
        if kind_of(where, value, TEXTURES) == "image":
            # Clamped: rounding just outside of 0..1 must not fetch a texel of the opposite side.
            return f"        {string(where, name)}: image(file: {self.path(where + '.file', value['file'], check_png)}, " \
                   "smooth: false, wrap: clamp),"
        colors = ", ".join(f"{c}: {shares(f'{where}.{c}', value[c])}" for c in "ab")
        squares = vector(lambda where, n: whole(where, n, 2**31), 2)(f"{where}.squares", value["squares"])
        return f"        {string(where, name)}: checker({colors}, squares: {squares}),"

    def known(self, where, name, table):
        """A name that the scene has a texture or a material for."""
        if not isinstance(name, str) or name not in self.tables[table]:
            raise Refused(f"{where}: {table[:-1]} {brief(name)} is not defined")
        return string(where, name)

    def material(self, name, value):
        where = f"materials.{name}"
        kind = kind_of(where, value, MATERIALS)
        say = {
            "albedo": self.albedo,
            "reflectance": shares,
            "radiance": light,
            "alpha": number(lambda x: 0 < x <= 1, "above 0, and at most 1"),
            "ior": number(lambda x: 0 < x <= LARGEST, "above 0"),
            "weight": share,
            "a": lambda where, part: self.known(where, part, "materials"),
            "b": lambda where, part: self.known(where, part, "materials"),
        }
        said = [f"{field}: {say[field](f'{where}.{field}', value[field])}" for field in MATERIALS[kind][0]]
        said += ["fresnel: constant", "compensate: false"] if kind == "metal" else []
        return f"        {string(where, name)}: {kind}({', '.join(said)}),"

    def albedo(self, where, value):
        """A colour, or the name of a texture."""
        if not isinstance(value, dict):
            return shares(where, value)
        name = fields(where, value, ("texture",))["texture"]
        return self.known(where + ".texture", name, "textures")

    def parts(self, name, around=()):
        """The plain materials of a material, one or those of a blend; all materials have been read."""
        if name in around:
            raise Refused(f"materials.{name}: is a part of itself")
        if name not in self.parts_of:
            value = self.tables["materials"][name]
            found = [value]
            if value["type"] == "blend":
                if len(around) >= self.MAX_PARTS:
                    raise Refused(f"materials.{around[0]}: blends more than {self.MAX_PARTS} plain materials")
                found = [part for key in "ab" for part in self.parts(value[key], (*around, name))]
            if len(found) > self.MAX_PARTS:
                raise Refused(f"materials.{name}: blends more than {self.MAX_PARTS} plain materials")
            if len(found) > 1 and sum(part["type"] == "emissive" for part in found) > 1:
                raise Refused(f"materials.{name}: blends more than one emissive material")
            self.parts_of[name] = found
        return self.parts_of[name]

    # ---- Objects. ----

    def object(self, where, value):
        kind = kind_of(where, value, OBJECTS)
        material = self.known(f"{where}.material", value["material"], "materials")
        is_textured = any(isinstance(part.get("albedo"), dict) for part in self.parts(value["material"]))
        if kind != "quad" and is_textured:
            raise Refused(f"{where}.material: a {kind} has no surface coordinates for the texture of {material}")
        if kind == "instances":
            return "\n".join(f"        mesh({said}, material: {material})," for said in self.instances(where, value))
        said = getattr(self, kind)(where, value)
        return f"        {kind}({said}, material: {material}),"

    def sphere(self, where, part):
        return f"center: {point(where + '.center', part['center'])}, radius: {size(where + '.radius', part['radius'])}"

    def spheres(self, where, part):
        flat, radii = part["centers"], part["radii"]
        if not isinstance(flat, list) or not flat or len(flat) % 3:
            raise Refused(f"{where}.centers: expected x, y, z of each ball in one list")
        if not isinstance(radii, list) or len(radii) != len(flat) // 3:
            raise Refused(f"{where}.radii: expected a list of {len(flat) // 3} radii, one for each ball")
        centers = ", ".join(point(where + ".centers", flat[i:i + 3]) for i in range(0, len(flat), 3))
        return f"centers: [{centers}], radii: each([{', '.join(size(where + '.radii', r) for r in radii)}])"

    def quad(self, where, part):
        said = [f"{field}: {point(f'{where}.{field}', part[field])}" for field in ("corner", "edge_u", "edge_v")]
        u, v = part["edge_u"], part["edge_v"]
        for field, edge in (("edge_u", u), ("edge_v", v)):
            if length(edge) < SMALLEST:
                raise Refused(f"{where}.{field}: has no length, so the quad has no area")
        angle = math.degrees(math.atan2(length(cross(u, v)), dot(u, v)))
        # Edges that were written with four decimals are off by a few hundredths of a degree.
        if abs(angle - 90) > 0.05:
            raise Refused(f"{where}.edge_v: edges must be at right angles, but stand at {angle:.2f} degrees")
        return ", ".join(said)

    def mesh_source(self, where, part):
        shading = "smooth" if truth(where + ".smooth", part.get("smooth", False)) else "flat"
        return f"source: obj({self.path(where + '.obj', part['obj'], check_obj)}), shading: {shading}"

    def instances(self, where, part):
        """One mesh for each matrix: meshes of the same source share their tree."""
        matrices = part["matrices"]
        if not isinstance(matrices, list) or not matrices:
            raise Refused(f"{where}.matrices: expected a list of matrices, found {brief(matrices)}")
        source = self.mesh_source(where, part)
        places = (self.matrix(f"{where}.matrices[{i}]", matrix) for i, matrix in enumerate(matrices))
        return [f"{source}, transform: (matrix: {place})" for place in places]

    def mesh(self, where, part):
        said = self.mesh_source(where, part)
        given = {name: part[name] for name in ("scale", "rotate_y", "translate", "matrix") if part.get(name) is not None}
        if "matrix" in given:
            if len(given) > 1:
                raise Refused(f"{where}.matrix: stands alone, without scale, rotate_y or translate")
            return f"{said}, transform: (matrix: {self.matrix(where + '.matrix', given['matrix'])})"
        steps = []
        for name, value in given.items():
            at = f"{where}.{name}"
            if name == "scale":
                factors = value if isinstance(value, list) else [value]
                steps.append(f"scale: {point(at, value) if isinstance(value, list) else any_number(at, value)}")
                if min(abs(factor) for factor in factors) < SMALLEST:
                    raise Refused(f"{at}: 0 squeezes the mesh flat")
            elif name == "rotate_y":
                steps.append(f"rotate: (0, {any_number(at, value)}, 0)")
            else:
                steps.append(f"translate: {point(at, value)}")
        return f"{said}, transform: ({', '.join(steps)})" if steps else said

    def matrix(self, where, value):
        """Rows of an affine map: 3 or 4 rows of 4, nested or flat; a fourth row must be 0 0 0 1."""
        if not isinstance(value, list) or len(value) not in (3, 4, 12, 16):
            raise Refused(f"{where}: expected 3 or 4 rows of 4 numbers, found {brief(value)}")
        rows = value if len(value) < 12 else [value[i:i + 4] for i in range(0, len(value), 4)]
        said = [vector(any_number, 4)(where, row) for row in rows]
        if len(rows) == 4 and rows[3] != [0, 0, 0, 1]:
            raise Refused(f"{where}: the last row must be 0 0 0 1, translation stands in the last column")
        columns = [[row[k] for row in rows[:3]] for k in range(3)]
        lengths = [length(column) for column in columns]
        # Against the volume of a box of these edges: a map that turns and scales keeps all of it.
        volume = abs(dot(columns[0], cross(columns[1], columns[2])))
        if min(lengths) < SMALLEST or volume <= 1e-9 * lengths[0] * lengths[1] * lengths[2]:
            raise Refused(f"{where}: squeezes the mesh flat")
        return "(" + ", ".join(said[:3]) + ")"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", help="scene in neutral JSON form")
    parser.add_argument("-o", "--output", help="scene file to write (default: beside the input, with .ron)")
    args = parser.parse_args()
    output = args.output or os.path.splitext(args.scene)[0] + ".ron"
    try:
        if os.path.realpath(output) == os.path.realpath(args.scene):
            raise Refused("the new file would replace it: name another with -o")
        with open(args.scene, encoding="utf-8-sig") as file:
            scene = json.load(file, object_pairs_hook=no_doubles, parse_constant=no_constant)
        converted = Converter(scene, args.scene, output).convert().encode("utf-8")
        write_whole(output, converted)
    except RecursionError:
        print(f"error: {args.scene}: is nested too deeply", file=sys.stderr)
        return 1
    # Text that is not UTF-8 and numbers of too many digits are value errors too.
    except (OSError, ValueError, Refused) as error:
        print(f"error: {args.scene}: {error}", file=sys.stderr)
        return 1
    return 0


def write_whole(path, data):
    """All of the file or nothing of it."""
    try:
        with open(path + ".tmp", "wb") as file:
            file.write(data)
        os.replace(path + ".tmp", path)
    except OSError:
        if os.path.isfile(path + ".tmp"):
            os.remove(path + ".tmp")
        raise


if __name__ == "__main__":
    sys.exit(main())
