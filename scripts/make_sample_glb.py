#!/usr/bin/env python3
"""Writes assets/models/surfaces.glb: one ball for each surface of glTF 2.0 that firstlight models.

Shapes and textures are formulas. Needs nothing but Python. Usage: scripts/make_sample_glb.py [FILE]
"""
import json
import math
import struct
import sys
import zlib

SIZE = 256


def png(width, height, pixels, channels):
    """An 8-bit PNG of `channels` 3 or 4; `pixels(x, y)` gives a tuple of 0..1."""
    rows = b""
    for y in range(height):
        row = [round(255 * min(max(c, 0), 1)) for x in range(width) for c in pixels(x, y)]
        rows += b"\0" + bytes(row)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9))
            + chunk(b"IEND", b""))


def tiles(x, y):
    """Distance from the nearest joint between tiles, 0..1, and the number of the tile."""
    u, v = 4 * x / SIZE, 4 * y / SIZE
    return 2 * min(u % 1, 1 - u % 1, v % 1, 1 - v % 1), int(u) + 4 * int(v)


def tile_color(x, y):
    edge, number = tiles(x, y)
    shade = 0.75 + 0.25 * math.sin(12.9898 * number)
    return (0.32, 0.3, 0.29) if edge < 0.06 else (0.78 * shade, 0.72 * shade, 0.64 * shade)


def tile_height(x, y):
    edge, number = tiles(x % SIZE, y % SIZE)
    return min(edge / 0.12, 1) + 0.06 * math.sin(7 * number)


def normals(height, scale):
    def pixel(x, y):
        dx = scale * (height(x + 1, y) - height(x - 1, y)) / 2
        dy = scale * (height(x, y + 1) - height(x, y - 1)) / 2
        length = math.sqrt(dx * dx + dy * dy + 1)
        # Rows run down, and green points up.
        return 0.5 - 0.5 * dx / length, 0.5 + 0.5 * dy / length, 0.5 + 0.5 / length
    return pixel


def tile_roughness(x, y):
    edge, _ = tiles(x, y)
    return 1.0, 0.9 if edge < 0.06 else 0.25 + 0.1 * math.sin(x / 9) * math.sin(y / 7), 0.0


def hammered(x, y):
    return math.sin(x * math.tau / 16) * math.sin(y * math.tau / 16)


def basket(x, y):
    """A weave with holes between its bands."""
    u, v = x / 16, y / 16
    across, along = abs(math.sin(math.pi * u)), abs(math.sin(math.pi * v))
    there = 1.0 if max(across, along) > 0.62 else 0.0
    shade = 0.6 + 0.4 * (across if int(u + v) % 2 else along)
    return 0.72 * shade, 0.5 * shade, 0.25 * shade, there


def glow(x, y):
    t = 0.5 + 0.5 * math.sin(math.tau * (x / SIZE * 6 + 0.35 * math.sin(math.tau * y / SIZE * 4)))
    s = t ** 6
    return 1.0 * s, 0.45 * s, 0.12 * s


class Builder:
    def __init__(self):
        self.binary = b""
        self.json = {"asset": {"version": "2.0", "generator": "firstlight scripts/make_sample_glb.py"}}

    def add(self, kind, item):
        self.json.setdefault(kind, []).append(item)
        return len(self.json[kind]) - 1

    def view(self, data):
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = self.add("bufferViews", {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return view

    def accessor(self, values, kind, component=5126):
        n = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[kind]
        flat = [x for value in values for x in (value if n > 1 else (value,))]
        code = {5126: "f", 5123: "H"}[component]
        item = {"bufferView": self.view(struct.pack(f"<{len(flat)}{code}", *flat)), "componentType": component,
                "count": len(values), "type": kind}
        if n == 3:
            stored = [struct.unpack("<f", struct.pack("<f", x))[0] for x in flat]
            item["min"] = [min(stored[k::3]) for k in range(3)]
            item["max"] = [max(stored[k::3]) for k in range(3)]
        return self.add("accessors", item)

    def texture(self, name, pixels, channels=3):
        source = self.add("images", {"name": name, "mimeType": "image/png",
                                     "bufferView": self.view(png(SIZE, SIZE, pixels, channels))})
        return {"index": self.add("textures", {"name": name, "source": source, "sampler": 0})}

    def write(self, path):
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = self.binary + b"\0" * (-len(self.binary) % 4)
        with open(path, "wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary)))
            file.write(struct.pack("<I4s", len(text), b"JSON") + text)
            file.write(struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def ball(builder, across=48, down=24):
    """A sphere of radius 0.45, whose texture runs four times around it and twice down."""
    positions, normal, uvs, tangents, indices = [], [], [], [], []
    for j in range(down + 1):
        theta = math.pi * j / down
        for i in range(across + 1):
            phi = math.tau * i / across
            n = (math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi))
            positions.append(tuple(0.45 * x for x in n))
            normal.append(n)
            uvs.append((4 * i / across, 2 * j / down))
            tangents.append((math.cos(phi), 0.0, -math.sin(phi), 1.0))
    for j in range(down):
        for i in range(across):
            a, b = j * (across + 1) + i, (j + 1) * (across + 1) + i
            if j > 0:
                indices += [a, b, a + 1]
            if j < down - 1:
                indices += [a + 1, b, b + 1]
    return {"attributes": {"POSITION": builder.accessor(positions, "VEC3"), "NORMAL": builder.accessor(normal, "VEC3"),
                           "TEXCOORD_0": builder.accessor(uvs, "VEC2"), "TANGENT": builder.accessor(tangents, "VEC4")},
            "indices": builder.accessor(indices, "SCALAR", 5123)}


def quad(builder, half_x, half_z, repeat):
    """In the plane of X and Z, facing up."""
    positions = [(-half_x, 0, -half_z), (half_x, 0, -half_z), (half_x, 0, half_z), (-half_x, 0, half_z)]
    uvs = [(0, 0), (repeat, 0), (repeat, repeat), (0, repeat)]
    return {"attributes": {"POSITION": builder.accessor(positions, "VEC3"),
                           "NORMAL": builder.accessor([(0, 1, 0)] * 4, "VEC3"),
                           "TEXCOORD_0": builder.accessor(uvs, "VEC2")},
            "indices": builder.accessor([0, 2, 1, 0, 3, 2], "SCALAR", 5123)}


def material(name, color, metallic=0.0, roughness=0.5, extensions=None, **rest):
    item = {"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": metallic,
                                                   "roughnessFactor": roughness}, **rest}
    if extensions:
        item["extensions"] = {f"KHR_materials_{key}": value for key, value in extensions.items()}
    return item


def main():
    builder = Builder()
    builder.add("samplers", {"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497})
    dents = builder.texture("hammered normals", normals(hammered, 2.0))
    floor = material("tiles", (1, 1, 1), roughness=1.0)
    floor["pbrMetallicRoughness"]["baseColorTexture"] = builder.texture("tile colours", tile_color)
    floor["pbrMetallicRoughness"]["metallicRoughnessTexture"] = builder.texture("tile roughness", tile_roughness)
    floor["normalTexture"] = builder.texture("tile normals", normals(tile_height, 3.0))
    woven = material("basket", (1, 1, 1), roughness=0.7, alphaMode="MASK", alphaCutoff=0.5, doubleSided=True)
    woven["pbrMetallicRoughness"]["baseColorTexture"] = builder.texture("weave", basket, 4)
    shining = material("ember", (0.02, 0.02, 0.02), roughness=0.6, emissiveFactor=[1, 1, 1],
                       extensions={"emissive_strength": {"emissiveStrength": 6}})
    shining["emissiveTexture"] = builder.texture("glow", glow)
    veil = material("veil", (0.9, 0.35, 0.3), roughness=0.4, alphaMode="BLEND", doubleSided=True)
    veil["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.4
    clear = {"transmission": {"transmissionFactor": 1}, "ior": {"ior": 1.5}}
    honey = {**clear, "volume": {"thicknessFactor": 0.9, "attenuationDistance": 0.5,
                                 "attenuationColor": [0.95, 0.6, 0.12]}}
    sea = {**clear, "volume": {"thicknessFactor": 0.9, "attenuationDistance": 0.8,
                               "attenuationColor": [0.35, 0.8, 0.75]}}
    balls = [
        material("plastic", (0.05, 0.16, 0.55), roughness=0.12),
        material("clay", (0.62, 0.32, 0.2), roughness=0.9),
        material("gold", (1.0, 0.77, 0.34), metallic=1.0, roughness=0.18),
        material("hammered copper", (0.95, 0.6, 0.5), metallic=1.0, roughness=0.25, normalTexture=dents),
        material("brushed steel", (0.6, 0.6, 0.62), metallic=1.0, roughness=0.35,
                 extensions={"anisotropy": {"anisotropyStrength": 0.9}}),
        material("car paint", (0.45, 0.01, 0.02), metallic=0.5, roughness=0.45,
                 extensions={"clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.03}}),
        material("velvet", (0.12, 0.01, 0.07), roughness=0.95,
                 extensions={"sheen": {"sheenColorFactor": [0.9, 0.5, 0.75], "sheenRoughnessFactor": 0.4}}),
        material("honey", (1, 1, 1), roughness=0.0, extensions=honey),
        material("frosted glass", (1, 1, 1), roughness=0.35, extensions=sea),
        material("bubble", (0.95, 0.97, 1.0), roughness=0.0, extensions=clear),
        woven,
        veil,
        shining,
        material("pearl", (0.8, 0.78, 0.75), roughness=0.3,
                 extensions={"specular": {"specularFactor": 1, "specularColorFactor": [1.0, 0.6, 0.9]},
                             "ior": {"ior": 1.8}}),
    ]
    shape, nodes = ball(builder), []

    def node(name, mesh=None, **rest):
        item = {"name": name, **rest}
        if mesh is not None:
            item["mesh"] = mesh
        nodes.append(builder.add("nodes", item))

    ground = builder.add("materials", floor)
    node("floor", builder.add("meshes", {"name": "floor", "primitives": [
        {**quad(builder, 6.0, 6.0, 6.0), "material": ground}]}))
    for k, item in enumerate(balls):
        mesh = builder.add("meshes", {"name": item["name"], "primitives": [
            {**shape, "material": builder.add("materials", item)}]})
        row, column = divmod(k, 5)
        width = min(5, len(balls) - 5 * row)
        node(item["name"], mesh, translation=[1.1 * (column - (width - 1) / 2), 0.45 + 0.0 * row, 1.15 - 1.15 * row])
    lamp = builder.add("materials", material("lamp", (0, 0, 0), emissiveFactor=[1, 0.95, 0.88], doubleSided=False,
                                             extensions={"emissive_strength": {"emissiveStrength": 14}}))
    panel = builder.add("meshes", {"name": "lamp", "primitives": [
        {**quad(builder, 1.2, 0.8, 1.0), "material": lamp}]})
    turn = math.radians(155)
    node("key light", panel, translation=[-1.6, 4.2, 1.8], rotation=[math.sin(turn / 2), 0, 0, math.cos(turn / 2)])
    wide = builder.add("meshes", {"name": "sky", "primitives": [
        {**quad(builder, 6.0, 6.0, 1.0), "material": builder.add("materials", material(
            "sky", (0, 0, 0), emissiveFactor=[0.35, 0.45, 0.6]))}]})
    node("sky", wide, translation=[0, 8, 0], rotation=[1, 0, 0, 0])
    builder.json["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"name": "spot", "type": "spot", "color": [1, 0.85, 0.7], "intensity": 40,
         "spot": {"innerConeAngle": 0.12, "outerConeAngle": 0.3}}]}}
    node("spot", translation=[3.5, 4.0, 2.5], rotation=aim((3.5, 4.0, 2.5), (0.6, 0.3, -0.6)),
         extensions={"KHR_lights_punctual": {"light": 0}})
    eye, to = (0.0, 3.1, 5.6), (0.0, 0.3, 0.0)
    camera = builder.add("cameras", {"name": "whole", "type": "perspective", "perspective": {
        "yfov": math.radians(34), "znear": 0.1, "aspectRatio": 16 / 9}})
    node("whole", camera=camera, translation=list(eye), rotation=aim(eye, to))
    near_eye, near_to = (-1.9, 1.1, 3.3), (-0.6, 0.4, 0.4)
    near = builder.add("cameras", {"name": "near", "type": "perspective", "perspective": {
        "yfov": math.radians(30), "znear": 0.1}})
    node("near", camera=near, translation=list(near_eye), rotation=aim(near_eye, near_to))
    # The brushed ball turns once in two seconds.
    turning = next(i for i, item in enumerate(builder.json["nodes"]) if item["name"] == "basket")
    times = builder.accessor([0.0, 0.5, 1.0, 1.5, 2.0], "SCALAR")
    builder.json["accessors"][times].update(min=[0.0], max=[2.0])
    halves = [math.pi * k / 4 for k in range(5)]
    turns = builder.accessor([(0.0, math.sin(a), 0.0, math.cos(a)) for a in halves], "VEC4")
    builder.add("animations", {"name": "turn", "samplers": [{"input": times, "output": turns}], "channels": [
        {"sampler": 0, "target": {"node": turning, "path": "rotation"}}]})
    builder.json["scenes"] = [{"name": "surfaces", "nodes": nodes}]
    builder.json["scene"] = 0
    used = {key for item in builder.json["materials"] for key in item.get("extensions", {})}
    builder.json["extensionsUsed"] = sorted(used | {"KHR_lights_punctual"})
    builder.write(sys.argv[1] if len(sys.argv) > 1 else "assets/models/surfaces.glb")


def aim(eye, to):
    """The rotation that turns -Z to a point, +Y staying up."""
    back = [a - b for a, b in zip(eye, to)]
    length = math.sqrt(sum(x * x for x in back))
    back = [x / length for x in back]
    yaw, pitch = math.atan2(back[0], back[2]), -math.asin(back[1])
    cy, sy, cp, sp = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    return [cy * sp, sy * cp, -sy * sp, cy * cp]


if __name__ == "__main__":
    main()
