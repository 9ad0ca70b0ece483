#!/usr/bin/env python3
"""Writes neutral scenes around a mesh for scripts/compare_peers.py, and converged references of them.

    pip install mitsuba numpy                 # Mitsuba's LLVM mode needs libLLVM: apt-get install libllvm19
    scripts/mesh_scenes.py MODEL.obj FOLDER --references
    scripts/compare_peers.py --spp 64 --repeat 5 FOLDER/*.json

MODEL is an OBJ file, or `knot`: a torus knot of `--triangles` triangles with grooves, by formula. The scenes:

    diffuse, glass, metal   the mesh on a plane under a quad light and a constant sky
    instances               10,000 small knots of 1,152 triangles, turned and scaled, on the plane
    balls                   a heap of 10,000 spheres: half diffuse, a quarter glass, a quarter mirror
    room                    the mesh in a closed room of grooved columns and a small light: with the mesh at least
                            230,000 triangles

Small knots and columns are flat: renderers disagree about smooth normals on coarse meshes.

A reference is the mean of two halves: one rendered by Mitsuba and one by firstlight, with seeds that compare_peers.py
does not use, so that it favours neither. Its own relMSE is estimated from the difference of the halves, a quarter of its
square, which a disagreement of the two renderers would raise: it must be well below the relMSE that is compared.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import time

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from compare_peers import MitsubaScene, best_variant, load_converter, read_obj, rel_mse  # noqa: E402

# Of the reference; those of compare_peers.py are below 1000.
SEED = 70_000
N_OBJECTS = 10_000
ROOM_TRIANGLES = 230_000


def write_obj(path, positions, faces):
    with open(path, "w", encoding="ascii") as file:
        file.writelines(f"v {x:.7g} {y:.7g} {z:.7g}\n" for x, y, z in positions)
        file.writelines(f"f {a} {b} {c}\n" for a, b, c in faces + 1)


def grid_faces(nu, nv, wraps):
    """Two triangles for each cell of nu × nv; rows of vertices run along v."""
    u, v = np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij")
    rows, columns = (nu, nv) if wraps else (nu + 1, nv + 1)

    def at(du, dv):
        return ((u + du) % rows * columns + (v + dv) % columns).ravel()

    a, b, c, d = at(0, 0), at(1, 0), at(1, 1), at(0, 1)
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def knot(n_triangles, groove=0.12):
    """A closed tube along a (2, 3) torus knot, with grooves that wind around it."""
    nv = max(6, round(math.sqrt(n_triangles / 2 / 12)))
    nu = round(n_triangles / 2 / nv)
    u, v = np.meshgrid(np.arange(nu) / nu, np.arange(nv) / nv, indexing="ij")

    def center(u):
        a = 2 * math.pi * u
        r = 2 + np.cos(3 * a)
        return np.stack([r * np.cos(2 * a), np.sin(3 * a), r * np.sin(2 * a)], -1)

    step = 1e-5
    along = center(u + step) - center(u - step)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    # Any direction that is never along the knot, made perpendicular to it.
    outwards = center(u) * np.array([1.0, 0.3, 1.0])
    outwards -= np.sum(outwards * along, -1, keepdims=True) * along
    outwards /= np.linalg.norm(outwards, axis=-1, keepdims=True)
    other = np.cross(along, outwards)
    radius = 0.5 * (1 + groove * np.cos(2 * math.pi * (4 * v + 15 * u)))
    a = 2 * math.pi * v
    ring = np.cos(a)[..., None] * outwards + np.sin(a)[..., None] * other
    return (center(u) + radius[..., None] * ring).reshape(-1, 3), grid_faces(nu, nv, True)[:, ::-1]


def columns(n_triangles, places, height):
    """Columns with grooves and a belly, from the floor up to `height`."""
    share = n_triangles / len(places) / 2
    nv = round(math.sqrt(share / 2))
    nu = round(share / nv)
    u, v = np.meshgrid(np.arange(nu + 1) / nu, np.arange(nv + 1) / nv, indexing="ij")
    a = 2 * math.pi * v
    radius = (0.28 + 0.06 * np.sin(math.pi * u)) * (1 + 0.05 * np.cos(16 * a + 6 * u) + 0.02 * np.sin(60 * u))
    one = np.stack([radius * np.sin(a), height * u, radius * np.cos(a)], -1).reshape(-1, 3)
    faces = grid_faces(nu, nv, False)[:, ::-1]
    parts = [(one + np.array([x, 0, z]), faces + i * len(one)) for i, (x, z) in enumerate(places)]
    return np.concatenate([p for p, _ in parts]), np.concatenate([f for _, f in parts])


class Scenes:
    def __init__(self, args):
        self.args, self.folder = args, args.folder
        self.rng = np.random.default_rng(5)
        os.makedirs(self.folder, exist_ok=True)
        if args.model == "knot":
            positions, faces = knot(args.triangles)
        else:
            positions, faces = read_obj(args.model)
        if args.up == "z":
            positions = positions[:, [1, 2, 0]]
        # The largest side is 2 m, and it floats a millimetre above the ground.
        low, high = positions.min(0), positions.max(0)
        middle = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
        self.size = (high - low) * 2 / (high - low).max()
        self.n_triangles = len(faces)
        write_obj(self.path("mesh.obj"), (positions - middle) * 2 / (high - low).max() + np.array([0, 1e-3, 0]), faces)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, size, objects, materials, environment, camera):
        origin, look_at, vfov = camera
        materials = {
            "ground": {"type": "diffuse", "albedo": [0.5, 0.5, 0.5]},
            "white": {"type": "diffuse", "albedo": [0.75, 0.72, 0.68]},
            "glass": {"type": "glass", "ior": 1.5},
            "metal": {"type": "metal", "alpha": 0.1, "reflectance": [0.9, 0.75, 0.5]},
            "mirror": {"type": "mirror", "reflectance": [0.9, 0.9, 0.9]},
            **materials,
        }
        scene = {
            "name": name,
            "camera": {
                "origin": origin, "look_at": look_at, "up": [0, 1, 0], "vfov": vfov, "width": size[0], "height": size[1],
            },
            "filter": "box", "environment": environment, "objects": objects, "max_depth": 256,
        }
        used = {value["material"] for value in objects}
        scene["materials"] = {name: value for name, value in materials.items() if name in used}
        with open(self.path(name + ".json"), "w", encoding="utf-8") as file:
            json.dump(scene, file)
        return self.path(name + ".json")

    def outdoors(self, name, size, objects, camera, materials=()):
        """On a plane of 24 m under a square light of 1.5 m and a sky."""
        stage = [
            {"type": "quad", "corner": [-12, 0, 12], "edge_u": [24, 0, 0], "edge_v": [0, 0, -24], "material": "ground"},
            {"type": "quad", "corner": [0.2, 4, -0.2], "edge_u": [1.5, 0, 0], "edge_v": [0, 0, 1.5], "material": "lamp"},
        ]
        materials = {"lamp": {"type": "emissive", "radiance": [14, 13, 11]}, **dict(materials)}
        return self.write(name, size, stage + objects, materials, [0.35, 0.45, 0.6], camera)

    def mesh(self, material, **placed):
        return {"type": "mesh", "obj": "mesh.obj", "smooth": not self.args.flat, "material": material, **placed}

    def of_mesh(self, material, size):
        height = float(self.size[1])
        camera = [1.5, 0.6 + 0.6 * height, 4.6], [0, 0.48 * height, 0], 32
        name = {"white": "diffuse"}.get(material, material)
        return self.outdoors(name, size, [self.mesh(material)], camera)

    def instances(self):
        positions, faces = knot(1152)
        write_obj(self.path("small.obj"), positions / 3.5, faces)
        side = round(math.sqrt(N_OBJECTS))
        matrices = [[], [], []]
        for i in range(N_OBJECTS):
            axis = self.rng.normal(size=3)
            turned = np.linalg.qr(np.stack([axis, *self.rng.normal(size=(2, 3))]).T)[0]
            turned *= np.linalg.det(turned)
            scale = self.rng.uniform(0.06, 0.13)
            x, z = ((np.array([i % side, i // side]) - (side - 1) / 2) * 0.16 + self.rng.uniform(-0.05, 0.05, 2)).tolist()
            matrix = np.concatenate([scale * turned, [[x], [0.12], [z]]], axis=1)
            matrices[i % 3].append([round(value, 7) for value in matrix.ravel().tolist()])
        materials = {"red": {"type": "diffuse", "albedo": [0.6, 0.15, 0.1]}}
        objects = [
            {"type": "instances", "obj": "small.obj", "smooth": False, "matrices": of, "material": material}
            for of, material in zip(matrices, ("white", "red", "metal"))
        ]
        return self.outdoors("instances", (256, 192), objects, ([2.5, 2.2, 4.5], [0, 0, 0], 35), materials.items())

    def balls(self):
        nx, ny = 25, 16
        spheres = {"white": ([], []), "blue": ([], []), "glass": ([], []), "mirror": ([], [])}
        for i in range(N_OBJECTS):
            cell = np.array([i % nx - nx / 2 + 0.5, i // nx % ny + 0.55, i // (nx * ny) - nx / 2 + 0.5])
            center = 0.1 * (cell + self.rng.uniform(-0.08, 0.08, 3))
            centers, radii = list(spheres.values())[self.rng.integers(4)]
            centers += [round(value, 6) for value in center.tolist()]
            radii.append(round(float(self.rng.uniform(0.025, 0.042)), 6))
        materials = {"blue": {"type": "diffuse", "albedo": [0.15, 0.3, 0.6]}}
        objects = [
            {"type": "spheres", "centers": centers, "radii": radii, "material": material}
            for material, (centers, radii) in spheres.items()
        ]
        return self.outdoors("balls", (192, 144), objects, ([2.6, 2.4, 4.6], [0, 0.65, 0], 36), materials.items())

    def room(self):
        """6 × 3 × 8 m; the light is 0.3 m wide."""
        width, height, depth = 6.0, 3.0, 8.0
        places = [(x, z) for z in (-3.0, -1.5, 0.0, 1.5) for x in (-2.1, 2.1)]
        write_obj(self.path("columns.obj"), *columns(max(ROOM_TRIANGLES - self.n_triangles, 60_000), places, height))
        x, z = width / 2, depth / 2
        walls = [
            ([-x, 0, z], [width, 0, 0], [0, 0, -depth], "ground"),
            ([-x, height, -z], [width, 0, 0], [0, 0, depth], "white"),
            ([-x, 0, -z], [width, 0, 0], [0, height, 0], "white"),
            ([x, 0, z], [-width, 0, 0], [0, height, 0], "white"),
            ([-x, 0, z], [0, 0, -depth], [0, height, 0], "red"),
            ([x, 0, -z], [0, 0, depth], [0, height, 0], "green"),
            ([-0.15, 2.6, -0.65], [0.3, 0, 0], [0, 0, 0.3], "lamp"),
        ]
        objects = [{"type": "quad", "corner": a, "edge_u": u, "edge_v": v, "material": of} for a, u, v, of in walls]
        objects.append({"type": "mesh", "obj": "columns.obj", "smooth": False, "material": "white"})
        objects.append(self.mesh("white", translate=[0, 0, -0.8]))
        materials = {
            "red": {"type": "diffuse", "albedo": [0.6, 0.2, 0.15]},
            "green": {"type": "diffuse", "albedo": [0.2, 0.5, 0.2]},
            "lamp": {"type": "emissive", "radiance": [120, 110, 90]},
        }
        return self.write("room", (192, 144), objects, materials, None, ([0.4, 1.6, 3.8], [0, 1.1, -1], 50))


def reference(args, source):
    """Renders both halves for half of the time each, and returns the relMSE of their mean."""
    import mitsuba as mi

    with open(source, encoding="utf-8") as file:
        scene = json.load(file)
    mi.set_variant(best_variant(scene))
    mi.set_log_level(mi.LogLevel.Error)
    loaded = mi.load_dict(MitsubaScene(mi, scene, args.folder).dictionary("multijitter"))
    end, total, n = time.monotonic() + args.seconds / 2, 0.0, 0
    while n < 2 or time.monotonic() < end:
        total = total + np.array(mi.render(loaded, spp=256, seed=SEED + n)).astype(np.float64)
        n += 1
    stem = os.path.splitext(source)[0]
    with open(stem + ".ron", "w", encoding="utf-8") as file:
        file.write(load_converter().Converter(scene, source, stem + ".ron").convert())
    half = stem + "-half.exr"
    subprocess.run(
        [args.program, "render", stem + ".ron", "-o", half, "--overwrite", "--quiet", "--seed", str(SEED),
         "--time", str(args.seconds / 2)],
        check=True, stdout=subprocess.DEVNULL,
    )
    own = np.array(mi.Bitmap(half).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)).astype(np.float64)
    mean = (own + total / n) / 2
    mi.Bitmap(mean.astype(np.float32)).write(stem + ".exr")
    tilt = float((own.mean() - (total / n).mean()) / mean.mean())
    return 256 * n, rel_mse(own, mean), tilt


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", help="OBJ file, or `knot`")
    parser.add_argument("folder")
    parser.add_argument("--triangles", type=int, default=300_000, help="of the knot")
    parser.add_argument("--up", choices=("y", "z"), default="y", help="up axis of the model")
    parser.add_argument("--flat", action="store_true", help="without smooth normals")
    parser.add_argument("--only", metavar="SCENE", nargs="+", help="these scenes")
    parser.add_argument("--references", action="store_true", help="render the references, too")
    parser.add_argument("--seconds", type=float, default=120.0, help="for each reference")
    parser.add_argument("--program", default="target/release/firstlight")
    args = parser.parse_args()
    try:
        scenes = Scenes(args)
        makers = {
            "diffuse": lambda: scenes.of_mesh("white", (256, 192)),
            "glass": lambda: scenes.of_mesh("glass", (192, 144)),
            "metal": lambda: scenes.of_mesh("metal", (256, 192)),
            "instances": scenes.instances, "balls": scenes.balls, "room": scenes.room,
        }
        for name in args.only or makers:
            source = makers[name]()
            print(source, flush=True)
            if args.references:
                spp, error, tilt = reference(args, source)
                print(f"  reference: {spp} spp by Mitsuba, its relMSE {error:.2g}, means differ by {100 * tilt:.3f} %", flush=True)
    except (OSError, ValueError, KeyError, RuntimeError, subprocess.CalledProcessError) as error:
        print(f"error: {error!r}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
