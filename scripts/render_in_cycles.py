#!/usr/bin/env python3
"""Renders a scene in the neutral JSON form with Blender's Cycles on the CPU, for scripts/compare_peers.py --cycles.

    python3 -m venv cycles && cycles/bin/pip install bpy "numpy<2"
    cycles/bin/python scripts/render_in_cycles.py SCENE.json --spp 64 --threads 2 --out FOLDER

For 1, 4, 16 ... samples a pixel it leaves FOLDER/SPP.exr and prints one line: samples, CPU seconds, wall seconds of
rendering, the second of two renders with scene and trees kept. Path tracing without denoising, clamping, adaptive
sampling or blurred caustics, with Cycles' own choice of samples and its light tree. Cycles has no exact spheres: they
are meshes of 82,000 smooth triangles, or lamps of its own where they glow.
"""

import argparse
import json
import math
import os
import sys
import time

import bpy
import numpy as np
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from compare_peers import placed_mesh  # noqa: E402


def rgba(value):
    value = [value] * 3 if isinstance(value, (int, float)) else list(value)
    return (*value, 1.0)


def turned(point):
    """Y up to Z up."""
    x, y, z = point
    return (x, -z, y)


class Scene:
    def __init__(self, scene, folder, threads):
        self.scene, self.folder = scene, folder
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.made = {}
        self.settings(threads)
        self.camera()
        world = bpy.data.worlds.new("world")
        bpy.context.scene.world = world
        world.use_nodes = True
        background = world.node_tree.nodes["Background"]
        background.inputs["Color"].default_value = rgba(scene.get("environment") or 0.0)
        for value in scene["objects"]:
            self.add(value)

    def settings(self, threads):
        camera, target = self.scene["camera"], bpy.context.scene
        target.render.engine = "CYCLES"
        target.render.threads_mode, target.render.threads = "FIXED", threads
        target.render.resolution_x, target.render.resolution_y = camera["width"], camera["height"]
        target.render.resolution_percentage = 100
        target.render.use_persistent_data = True
        target.render.image_settings.file_format = "OPEN_EXR"
        target.render.image_settings.color_depth = "32"
        target.view_settings.view_transform = "Raw"
        cycles = target.cycles
        cycles.device = "CPU"
        cycles.use_adaptive_sampling = False
        cycles.use_denoising = False
        cycles.pixel_filter_type = "BOX"
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        cycles.blur_glossy = 0.0
        cycles.light_sampling_threshold = 0.0
        cycles.caustics_reflective = cycles.caustics_refractive = True
        bounces = min(1024, max(0, (self.scene.get("max_depth") or 1025) - 1))
        for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_max_bounces"):
            setattr(cycles, name, bounces)

    def camera(self):
        value = self.scene["camera"]
        data = bpy.data.cameras.new("camera")
        data.sensor_fit = "VERTICAL"
        data.angle = math.radians(value["vfov"])
        data.clip_start, data.clip_end = 1e-4, 1e7
        radius = value.get("aperture_radius") or 0.0
        if radius:
            data.dof.use_dof = True
            data.dof.focus_distance = value["focus_distance"]
            # The radius is the focal length over twice the f-stop, and Blender's lengths are millimetres.
            data.dof.aperture_fstop = data.lens / (2000.0 * radius)
        eye, target, up = (np.array(value[name], float) for name in ("origin", "look_at", "up"))
        back = (eye - target) / np.linalg.norm(eye - target)
        right = np.cross(up, back)
        right /= np.linalg.norm(right)
        matrix = np.eye(4)
        for k, axis in enumerate((right, np.cross(back, right), back, eye)):
            matrix[:3, k] = turned(axis)
        thing = bpy.data.objects.new("camera", data)
        bpy.context.collection.objects.link(thing)
        thing.matrix_world = Matrix(matrix.tolist())
        bpy.context.scene.camera = thing

    def material(self, name):
        if name not in self.made:
            material = bpy.data.materials.new(name)
            material.use_nodes = True
            nodes = material.node_tree.nodes
            nodes.clear()
            output = nodes.new("ShaderNodeOutputMaterial")
            material.node_tree.links.new(self.shader(material, name), output.inputs["Surface"])
            if self.scene["materials"][name]["type"] == "emissive":
                material.cycles.emission_sampling = "FRONT"
            self.made[name] = material
        return self.made[name]

    def color(self, material, value, socket):
        if not isinstance(value, dict):
            socket.default_value = rgba(value)
            return
        nodes, links = material.node_tree.nodes, material.node_tree.links
        texture = self.scene["textures"][value["texture"]]
        where = nodes.new("ShaderNodeUVMap")
        if texture["type"] == "checker":
            nu, nv = texture["squares"]
            stretch = nodes.new("ShaderNodeVectorMath")
            stretch.operation = "MULTIPLY_ADD"
            # Blender's checker counts whole numbers of all three coordinates: 0.5 keeps clear of the third's edge.
            stretch.inputs[1].default_value, stretch.inputs[2].default_value = (nu, nv, 0.0), (0.0, 0.0, 0.5)
            links.new(where.outputs["UV"], stretch.inputs[0])
            node = nodes.new("ShaderNodeTexChecker")
            node.inputs["Scale"].default_value = 1.0
            # It gives the first colour to odd sums.
            node.inputs["Color1"].default_value = rgba(texture["b"])
            node.inputs["Color2"].default_value = rgba(texture["a"])
            links.new(stretch.outputs["Vector"], node.inputs["Vector"])
        else:
            node = nodes.new("ShaderNodeTexImage")
            node.image = bpy.data.images.load(os.path.join(self.folder, texture["file"]))
            node.interpolation = "Closest"
            links.new(where.outputs["UV"], node.inputs["Vector"])
        links.new(node.outputs["Color"], socket)

    def shader(self, material, name):
        value = self.scene["materials"][name]
        nodes, links, kind = material.node_tree.nodes, material.node_tree.links, value["type"]
        if kind == "diffuse":
            node = nodes.new("ShaderNodeBsdfDiffuse")
            self.color(material, value["albedo"], node.inputs["Color"])
            return node.outputs[0]
        if kind in ("mirror", "metal"):
            node = nodes.new("ShaderNodeBsdfAnisotropic")
            node.distribution = "GGX"
            # Cycles squares the roughness.
            node.inputs["Roughness"].default_value = math.sqrt(value.get("alpha", 0.0))
            self.color(material, value["reflectance"], node.inputs["Color"])
            return node.outputs[0]
        if kind == "glass":
            node = nodes.new("ShaderNodeBsdfGlass")
            node.inputs["Roughness"].default_value = 0.0
            node.inputs["IOR"].default_value = value["ior"]
            node.inputs["Color"].default_value = (1, 1, 1, 1)
            return node.outputs[0]
        if kind == "blend":
            node = nodes.new("ShaderNodeMixShader")
            node.inputs[0].default_value = value["weight"]
            links.new(self.shader(material, value["a"]), node.inputs[1])
            links.new(self.shader(material, value["b"]), node.inputs[2])
            return node.outputs[0]
        if kind == "emissive":
            node = nodes.new("ShaderNodeEmission")
            self.color(material, value["radiance"], node.inputs["Color"])
            side, front = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeMath")
            front.operation = "SUBTRACT"
            front.inputs[0].default_value = 1.0
            links.new(side.outputs["Backfacing"], front.inputs[1])
            links.new(front.outputs[0], node.inputs["Strength"])
            return node.outputs[0]
        raise ValueError(f"material {name}: kind {kind} is not supported here")

    def mesh(self, name, positions, faces, material, uvs=None, smooth=False):
        data = bpy.data.meshes.new(name)
        data.from_pydata([turned(p) for p in positions], [], [list(face) for face in faces])
        if uvs is not None:
            layer = data.uv_layers.new(name="UVMap")
            for loop in data.loops:
                layer.data[loop.index].uv = uvs[loop.vertex_index]
        data.polygons.foreach_set("use_smooth", [smooth] * len(data.polygons))
        data.materials.append(self.material(material))
        data.update()
        thing = bpy.data.objects.new(name, data)
        bpy.context.collection.objects.link(thing)
        return thing

    def ball(self, center, radius, material):
        value = self.scene["materials"][material]
        if value["type"] == "emissive" and not isinstance(value["radiance"], dict):
            light = bpy.data.lights.new("ball", "POINT")
            light.use_soft_falloff = False
            light.shadow_soft_size = radius
            radiance = rgba(value["radiance"])[:3]
            most = max(radiance)
            light.color = [c / most for c in radiance]
            # The power of a ball that sends this radiance to all sides: π · 4 π r².
            light.energy = most * 4.0 * math.pi**2 * radius**2
            light.cycles.max_bounces = 1024
            thing = bpy.data.objects.new("ball", light)
            thing.location = turned(center)
            thing.visible_camera = True
            bpy.context.collection.objects.link(thing)
            return
        if "ball" not in self.made:
            bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=7, radius=1.0)
            unit = bpy.context.object
            self.made["ball"] = unit.data
            bpy.data.objects.remove(unit)
        data = self.made["ball"].copy()
        data.polygons.foreach_set("use_smooth", [True] * len(data.polygons))
        data.materials.append(self.material(material))
        thing = bpy.data.objects.new("ball", data)
        thing.location, thing.scale = turned(center), (radius,) * 3
        bpy.context.collection.objects.link(thing)

    def add(self, value):
        kind, material = value["type"], value["material"]
        if kind == "sphere":
            self.ball(value["center"], value["radius"], material)
        elif kind == "spheres":
            radii = value["radii"]
            for i in range(len(value["centers"]) // 3):
                radius = radii[i] if isinstance(radii, list) else radii
                self.ball(value["centers"][3 * i:3 * i + 3], radius, material)
        elif kind == "quad":
            c, u, v = (np.array(value[name], float) for name in ("corner", "edge_u", "edge_v"))
            self.mesh("quad", [c, c + u, c + u + v, c + v], [(0, 1, 2, 3)], material, [(0, 0), (1, 0), (1, 1), (0, 1)])
        elif kind == "mesh":
            positions, faces = placed_mesh(value, self.folder)
            self.mesh("mesh", positions, faces, material, smooth=value.get("smooth", False))
        else:
            raise ValueError(f"objects of kind {kind} are not supported here")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", required=True)
    args = parser.parse_args()
    with open(args.scene, encoding="utf-8") as file:
        Scene(json.load(file), os.path.dirname(os.path.abspath(args.scene)), args.threads)
    target, spp = bpy.context.scene, 1
    while spp <= args.spp:
        target.cycles.samples = spp
        for attempt in range(2):
            target.cycles.seed = 17 + attempt
            target.render.filepath = os.path.join(args.out, f"{spp}.exr")
            wall, cpu = time.perf_counter(), time.process_time()
            bpy.ops.render.render(write_still=False)
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        bpy.data.images["Render Result"].save_render(target.render.filepath)
        print(f"step {spp} {cpu} {wall}", flush=True)
        spp *= 4


if __name__ == "__main__":
    main()
