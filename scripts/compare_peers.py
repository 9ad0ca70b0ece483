#!/usr/bin/env python3
"""Seconds to equal error: firstlight against Mitsuba 3 and Cycles on the same scenes, machine, threads and run.

    pip install mitsuba numpy                 # Mitsuba's LLVM mode needs libLLVM: apt-get install libllvm19
    cargo build --release --no-default-features --features cli --target-dir target/headless
    scripts/compare_peers.py --program target/headless/release/firstlight cornell.json veach_mis.json

Scenes are in the neutral JSON form of scripts/neutral_to_scene.py (scripts/mesh_scenes.py writes some); beside each lies a
converged picture with the same name and the ending .exr. Both renderers take samples by the pixel with a box filter,
without denoising or clamping. Mitsuba runs its path integrator with the multijitter sampler in LLVM mode, or in scalar
mode where that is faster, each number of samples as a render of its own after one that does not count because it
compiles. firstlight's times are those of `firstlight report`, with adaptive sampling and the choice of techniques, tree
and loading left out. Seconds are CPU seconds / threads, so that other work on the machine counts little; wall time is
printed beside them. Both take `--repeat` turns with seeds of their own: time and relMSE of a step are medians, and the
range of the ratios of single turns is printed. `--cycles PYTHON` adds Blender's Cycles (see render_in_cycles.py). Exit
status 1 when something went wrong.
"""

import argparse
import csv
import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
import time

import numpy as np


def load_converter():
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), "neutral_to_scene.py")
    spec = importlib.util.spec_from_file_location("neutral_to_scene", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rel_mse(picture, reference):
    picture, reference = picture.astype(np.float64), reference.astype(np.float64)
    return float(np.mean((picture - reference) ** 2 / (reference**2 + 0.01)))


class MitsubaScene:
    """A neutral scene as Mitsuba's dictionary."""

    def __init__(self, mi, scene, folder, merges=False):
        self.mi, self.scene, self.folder, self.merges = mi, scene, folder, merges
        # BSDFs by material: thousands of objects share one.
        self.made = {}

    def dictionary(self, sampler):
        camera = self.scene["camera"]
        transform = self.mi.ScalarTransform4f
        sensor = {
            "type": "perspective",
            "fov_axis": "y",
            "fov": camera["vfov"],
            "near_clip": 1e-3,
            "far_clip": 1e6,
            "to_world": transform().look_at(origin=camera["origin"], target=camera["look_at"], up=camera["up"]),
            "film": {
                "type": "hdrfilm", "width": camera["width"], "height": camera["height"], "pixel_format": "rgb",
                "component_format": "float32", "rfilter": {"type": "box"},
            },
            "sampler": {"type": sampler},
        }
        if camera.get("aperture_radius", 0):
            sensor["type"] = "thinlens"
            sensor["aperture_radius"] = camera["aperture_radius"]
            sensor["focus_distance"] = camera["focus_distance"]
        out = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": self.scene.get("max_depth") or -1},
            "sensor": sensor,
        }
        if self.scene.get("environment") is not None:
            out["environment"] = {"type": "constant", "radiance": self.rgb(self.scene["environment"])}
        for i, value in enumerate(self.scene["objects"]):
            for k, shape in enumerate(self.shapes(value)):
                name = f"object_{i}_{k}"
                out[name] = self.dressed(shape, value["material"])
                if value["type"] == "instances" and not self.merges:
                    out[name] = group = self.mi.load_dict({"type": "shapegroup", "inside": out[name]})
                    for n, matrix in enumerate(value["matrices"]):
                        to_world = self.mi.ScalarTransform4f(matrix_of(matrix))
                        out[f"{name}_{n}"] = {"type": "instance", "to_world": to_world, "group": group}
        return out

    @staticmethod
    def rgb(value):
        return {"type": "rgb", "value": [value] * 3 if isinstance(value, (int, float)) else list(value)}

    def paint(self, value):
        if not isinstance(value, dict):
            return self.rgb(value)
        texture = self.scene["textures"][value["texture"]]
        if texture["type"] == "checker":
            nu, nv = texture["squares"]
            # Mitsuba's pattern has two squares a side.
            scale = self.mi.ScalarTransform4f().scale([0.5 * nu, 0.5 * nv, 1.0])
            colors = {"color0": self.rgb(texture["a"]), "color1": self.rgb(texture["b"])}
            return {"type": "checkerboard", "to_uv": scale, **colors}
        path = os.path.join(self.folder, texture["file"])
        return {"type": "bitmap", "filename": path, "filter_type": "nearest", "raw": False}

    def bsdf(self, name):
        """Without the wrapper that makes both sides alike; the second answer is whether light passes through."""
        value = self.scene["materials"][name]
        kind = value["type"]
        if kind == "diffuse":
            return {"type": "diffuse", "reflectance": self.paint(value["albedo"])}, False
        if kind == "mirror":
            reflectance = self.paint(value["reflectance"])
            return {"type": "conductor", "material": "none", "specular_reflectance": reflectance}, False
        if kind == "metal":
            metal = {
                "type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": value["alpha"],
                "specular_reflectance": self.paint(value["reflectance"]),
            }
            return metal, False
        if kind == "glass":
            return {"type": "dielectric", "int_ior": value["ior"], "ext_ior": 1.0}, True
        if kind == "blend":
            (a, clear_a), (b, clear_b) = self.bsdf(value["a"]), self.bsdf(value["b"])
            return {"type": "blendbsdf", "weight": value["weight"], "a": a, "b": b}, clear_a or clear_b
        raise ValueError(f"material {name}: a part of kind {kind} is not supported here")

    def parts(self, material):
        """BSDF and emitter of the shapes of a material."""
        value = self.scene["materials"][material]
        if material not in self.made:
            is_emissive = value["type"] == "emissive"
            bsdf, is_clear = ({"type": "diffuse", "reflectance": self.rgb(0.0)}, True) if is_emissive else self.bsdf(material)
            self.made[material] = self.mi.load_dict(bsdf if is_clear else {"type": "twosided", "inside": bsdf})
        parts = {"bsdf": self.made[material]}
        if value["type"] == "emissive":
            parts["emitter"] = {"type": "area", "radiance": self.paint(value["radiance"])}
        return parts

    def dressed(self, shape, material):
        parts = self.parts(material)
        if "mesh" not in shape:
            return {**shape, **parts}
        properties = self.mi.Properties()
        properties["mesh_bsdf"] = parts["bsdf"]
        if "emitter" in parts:
            properties["mesh_emitter"] = self.mi.load_dict(parts["emitter"])
        positions, faces, normals = shape["mesh"]
        mesh = self.mi.Mesh("mesh", len(positions), len(faces), props=properties, has_vertex_normals=normals is not None)
        parameters = self.mi.traverse(mesh)
        parameters["vertex_positions"] = positions.ravel()
        parameters["faces"] = faces.ravel()
        if normals is not None:
            parameters["vertex_normals"] = normals.ravel()
        parameters.update()
        return mesh

    def shapes(self, value):
        kind = value["type"]
        if kind == "sphere":
            yield {"type": "sphere", "center": value["center"], "radius": value["radius"]}
        elif kind == "spheres":
            radii = value["radii"]
            centers = [value["centers"][i:i + 3] for i in range(0, len(value["centers"]), 3)]
            for i, center in enumerate(centers):
                radius = radii[i] if isinstance(radii, list) else radii
                yield {"type": "sphere", "center": center, "radius": radius}
        elif kind == "quad":
            corner, u, v = (np.array(value[name], dtype=float) for name in ("corner", "edge_u", "edge_v"))
            normal = np.cross(u, v)
            matrix = np.eye(4)
            matrix[:3, 0], matrix[:3, 1] = 0.5 * u, 0.5 * v
            matrix[:3, 2] = normal / np.linalg.norm(normal)
            matrix[:3, 3] = corner + 0.5 * u + 0.5 * v
            yield {"type": "rectangle", "to_world": self.mi.ScalarTransform4f(matrix)}
        elif kind == "instances" and self.merges:
            matrices = [matrix_of(matrix) for matrix in value["matrices"]]
            yield {"mesh": merged(self.mesh(value), matrices)}
        elif kind in ("mesh", "instances"):
            yield {"mesh": self.mesh(value)}
        else:
            raise ValueError(f"objects of kind {kind} are not supported here")

    def mesh(self, value):
        """Placed positions, faces, and normals by area where it is smooth."""
        positions, faces = placed_mesh(value, self.folder)
        normals = None
        if value.get("smooth", False):
            a, b, c = (positions[faces[:, k]] for k in range(3))
            cross = np.cross(b - a, c - a)
            normals = np.zeros_like(positions)
            for k in range(3):
                np.add.at(normals, faces[:, k], cross)
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
            normals = normals.astype(np.float32)
        return positions.astype(np.float32), faces.astype(np.uint32), normals


def merged(mesh, matrices):
    """One mesh of many copies."""
    positions, faces, normals = mesh
    n = np.arange(len(matrices), dtype=np.uint32)[:, None, None] * np.uint32(len(positions))
    moved = np.concatenate([positions @ matrix[:3, :3].T + matrix[:3, 3] for matrix in matrices])
    if normals is not None:
        normals = np.concatenate([normals @ np.linalg.inv(matrix[:3, :3]) for matrix in matrices])
        normals = (normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)).astype(np.float32)
    return moved.astype(np.float32), (faces[None] + n).reshape(-1, 3), normals


def best_variant(scene, merges=False):
    """LLVM mode compiles for each shape at each render, which takes longer than rendering where there are thousands."""
    sizes = {"spheres": lambda of: len(of["centers"]) // 3, "instances": lambda of: 1 if merges else len(of["matrices"])}
    n_shapes = sum(sizes.get(value["type"], lambda of: 1)(value) for value in scene["objects"])
    return "scalar_rgb" if n_shapes > 1000 else "llvm_ad_rgb"


def placed_mesh(value, folder):
    """Positions in the world, and triangles."""
    positions, faces = read_obj(os.path.join(folder, value["obj"]))
    if value.get("matrix") is not None:
        matrix = matrix_of(value["matrix"])
        return positions @ matrix[:3, :3].T + matrix[:3, 3], faces
    angle = math.radians(value.get("rotate_y") or 0.0)
    turn = np.array([[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]])
    scale = value.get("scale")
    positions = positions * (1.0 if scale is None else np.array(scale, dtype=float)) @ turn.T
    return positions + np.array(value.get("translate") or [0, 0, 0], dtype=float), faces


def matrix_of(rows):
    """4 × 4, of 3 or 4 rows of 4, nested or flat."""
    matrix = np.eye(4)
    matrix[:3] = np.array(rows, dtype=float).reshape(-1, 4)[:3]
    return matrix


def read_obj(path):
    """Positions and triangles alone; polygons as fans."""
    positions, faces = [], []
    with open(path, encoding="utf-8", errors="replace") as file:
        for line in file:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                positions.append([float(x) for x in words[1:4]])
            elif words[0] == "f":
                corners = [int(word.split("/")[0]) for word in words[1:]]
                corners = [i - 1 if i > 0 else len(positions) + i for i in corners]
                faces += [[corners[0], b, c] for b, c in zip(corners[1:], corners[2:])]
    return np.array(positions), np.array(faces)


class MitsubaRenderer:
    """A scene in Mitsuba, that has been rendered once so that nothing is left to compile."""

    def __init__(self, args, scene, folder):
        import drjit as dr
        import mitsuba as mi

        self.args, self.mi = args, mi
        mi.set_log_level(mi.LogLevel.Error)
        dr.set_thread_count(args.threads)
        self.loaded = mi.load_dict(MitsubaScene(mi, scene, folder, args.merge_instances).dictionary(args.sampler))
        for spp in self.steps():
            self.render(spp, 16)

    def steps(self):
        return [4**k for k in range(32) if 4**k <= self.args.spp]

    def render(self, spp, seed):
        return np.array(self.mi.render(self.loaded, spp=spp, seed=seed))

    def curve(self, reference, turn):
        curve = []
        for spp in self.steps():
            wall, cpu = time.perf_counter(), time.process_time()
            picture = self.render(spp, 17 + turn)
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
            curve.append((spp, cpu / self.args.threads, wall, rel_mse(picture, reference)))
        return curve


def cycles_curve(args, source, reference):
    import mitsuba as mi

    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "render_in_cycles.py")
    with tempfile.TemporaryDirectory() as folder:
        command = [args.cycles, script, source, "--spp", str(args.spp), "--threads", str(args.threads), "--out", folder]
        out = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
        curve = []
        for line in out.splitlines():
            if not line.startswith("step "):
                continue
            spp, cpu, wall = line.split()[1:]
            bitmap = mi.Bitmap(os.path.join(folder, f"{spp}.exr"))
            picture = np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
            curve.append((int(spp), float(cpu) / args.threads, float(wall), rel_mse(picture, reference)))
        return curve


def firstlight_curve(args, scene, source, reference_path, turn):
    converter = load_converter()
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "scene.ron")
        with open(target, "w", encoding="utf-8") as file:
            file.write(converter.Converter(scene, source, target).convert())
        subprocess.run(
            [args.program, "report", target, "--reference", reference_path, "--no-ablation", "--output", folder,
             "--threads", str(args.threads), "--spp", str(args.spp * args.further), "--seed", str(1 + turn)],
            check=True, stdout=subprocess.DEVNULL,
        )
        with open(os.path.join(folder, "steps.csv"), encoding="utf-8", newline="") as file:
            return [
                (int(row["spp"]), float(row["cpu_s"] or "nan") / args.threads, float(row["wall_s"]), float(row["relmse"]))
                for row in csv.DictReader(file)
                if not row["without"] and not row["denoiser"]
            ]


def seconds_to(curve, column, target):
    """Between steps along the line on logarithmic axes; beyond the last one at slope -1, marked."""
    points = [(row[column], row[3]) for row in curve]
    if points[0][1] <= target:
        return points[0][0], "<"
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e1 <= target:
            share = math.log(e0 / target) / math.log(e0 / e1)
            return t0 * (t1 / t0) ** share, ""
    t, e = points[-1]
    return t * e / target, ">"


def median(curves):
    """Step by step: (samples, CPU seconds per thread, wall seconds, relMSE)."""
    return [(steps[0][0], *(float(np.median([step[k] for step in steps])) for k in (1, 2, 3))) for steps in zip(*curves)]


def compare(args, source):
    with open(source, encoding="utf-8") as file:
        scene = json.load(file)
    import mitsuba as mi

    mi.set_variant(args.variant or best_variant(scene, args.merge_instances))
    folder = os.path.dirname(os.path.abspath(source))
    reference_path = os.path.splitext(os.path.abspath(source))[0] + ".exr"
    reference = np.array(mi.Bitmap(reference_path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    renderer = MitsubaRenderer(args, scene, folder)
    turns = {"mitsuba": [], "firstlight": []}
    for turn in range(args.repeat):
        turns["mitsuba"].append(renderer.curve(reference, turn))
        turns["firstlight"].append(firstlight_curve(args, scene, source, reference_path, turn))
    if args.cycles:
        turns["cycles"] = [cycles_curve(args, source, reference)] * args.repeat
    name = os.path.splitext(os.path.basename(source))[0]
    curves = {label: median(curves) for label, curves in turns.items()}
    for label, curve in curves.items():
        for spp, cpu, wall, error in curve:
            print(f"# {name:16} {label:10} {spp:6} spp  {cpu:9.4f} cpu/t s  {wall:9.4f} wall s  relMSE {error:.4g}")
    rows = []
    for label, curve in curves.items():
        if label == "firstlight":
            continue
        for k, (spp, cpu, wall, error) in enumerate(curve):
            own_cpu, mark = seconds_to(curves["firstlight"], 1, error)
            own_wall, _ = seconds_to(curves["firstlight"], 2, error)
            single = [seconds_to(own, 1, its[k][3])[0] / its[k][1] for own, its in zip(turns["firstlight"], turns[label])]
            rows.append(
                f"| {name} | {label} | {error:.3g} | {spp} | {cpu:.3f} | {mark}{own_cpu:.3f} | {own_cpu / cpu:.2f} "
                f"| {min(single):.2f}-{max(single):.2f} | {wall:.3f} | {own_wall:.3f} | {own_wall / wall:.2f} |"
            )
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", help="scenes in neutral JSON form, each with its .exr beside it")
    parser.add_argument("--program", default="target/release/firstlight")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--spp", type=int, default=256, help="most samples per pixel of the peer")
    parser.add_argument("--further", type=int, default=4, help="how many times as many samples firstlight takes")
    parser.add_argument("--repeat", type=int, default=1, help="turns; medians of them are compared")
    parser.add_argument("--variant", help="of Mitsuba (default: llvm_ad_rgb; scalar_rgb for more than 1,000 shapes)")
    parser.add_argument("--merge-instances", action="store_true", help="as one mesh in Mitsuba")
    parser.add_argument("--sampler", default="multijitter")
    parser.add_argument("--cycles", metavar="PYTHON", help="an interpreter that has the package bpy: measures Cycles as well")
    args = parser.parse_args()
    rows, failed = [], False
    for source in args.scenes:
        try:
            rows += compare(args, source)
        except (OSError, ValueError, KeyError, RuntimeError, subprocess.CalledProcessError) as error:
            print(f"error: {source}: {error}", file=sys.stderr)
            failed = True
    print("| scene | peer | relMSE | its spp | its cpu s / threads | firstlight | ratio | single turns | its wall s | firstlight | ratio |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    print("\n".join(rows))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
