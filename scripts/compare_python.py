#!/usr/bin/env python3
"""Time from `import` to arrays, and per image in a loop of poses, beside Mitsuba 3 in one run.

    PYTHONPATH=target/python/package scripts/compare_python.py firstlight [N]
    PYTHONPATH=… scripts/compare_python.py scalar_rgb|llvm_ad_rgb [N]

A mesh of 10,000 triangles from numpy under an even environment, 256 × 256, 16 samples per pixel, with depth, normal and
ids; N poses of the camera. Prints seconds of the first image, import included, the median of the others, and the
growth of memory over them.
"""

import sys
import time

START = time.perf_counter()
WHICH, N = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 100

import numpy as np  # noqa: E402


def megabytes():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 / 1e6


def sheet(n=71):
    x, z = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    vertices = (
        np.stack([x, 0.1 * np.sin(5 * x) * np.cos(4 * z), z], axis=-1)
        .reshape(-1, 3)
        .astype(np.float32)
    )
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    lower, upper = (
        [corner, corner + n, corner + 1],
        [corner + 1, corner + n, corner + n + 1],
    )
    return vertices, np.concatenate(
        [np.stack(side, axis=1) for side in (lower, upper)]
    )[:10_000]


def pose(i):
    return (2 * np.sin(0.1 * i), 2.0, 2 * np.cos(0.1 * i) + 1)


def firstlight():
    import firstlight as fl

    scene = fl.Scene()
    scene.environment = 1
    scene.mesh(*sheet(), material=fl.diffuse(albedo=0.5))

    def image(i):
        scene.camera = fl.Camera(eye=pose(i), look_at=(0, 0, 0), vfov=40)
        image = scene.render(256, 256, spp=16, layers=["depth", "normal", "object"])
        return [image.numpy(), *image.layers.values()]

    return image


def mitsuba():
    import mitsuba as mi

    mi.set_variant(WHICH)
    vertices, faces = sheet()
    mesh = mi.Mesh("sheet", len(vertices), len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"], parameters["faces"] = (
        vertices.ravel(),
        faces.ravel().astype(np.uint32),
    )
    parameters.update()

    def sensor(i):
        to_world = mi.ScalarTransform4f().look_at(pose(i), (0, 0, 0), (0, 1, 0))
        film = {
            "type": "hdrfilm",
            "width": 256,
            "height": 256,
            "rfilter": {"type": "box"},
        }
        return {"type": "perspective", "fov": 40, "to_world": to_world, "film": film}

    integrator = {
        "type": "aov",
        "aovs": "d:depth,n:sh_normal,i:shape_index",
        "image": {"type": "path"},
    }
    parts = {
        "type": "scene",
        "integrator": integrator,
        "light": {"type": "constant"},
        "mesh": mesh,
    }
    scene = mi.load_dict(parts)

    def image(i):
        return [
            np.array(mi.render(scene, sensor=mi.load_dict(sensor(i)), spp=16, seed=i))
        ]

    return image


image = firstlight() if WHICH == "firstlight" else mitsuba()
image(0)
first = time.perf_counter() - START
times, memory = [], None
for i in range(1, N + 1):
    begin = time.perf_counter()
    image(i)
    times.append(time.perf_counter() - begin)
    if i == max(1, N // 10):
        memory = megabytes()
print(
    f"{WHICH}: first {first:.2f} s, then {np.median(times):.3f} s, memory +{megabytes() - memory:.1f} MB over {N} images"
)
