import matplotlib
import numpy as np
import pytest

import firstlight as fl

matplotlib.use("agg")


def grid(n):
    """A wavy sheet of 2 (n − 1)² triangles about the origin, in the plane of x and z."""
    x, z = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    vertices = np.stack([x, 0.1 * np.sin(5 * x) * np.cos(4 * z), z], axis=-1).reshape(-1, 3)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    faces = np.concatenate(
        [np.stack([corner, corner + n, corner + 1], axis=1), np.stack([corner + 1, corner + n, corner + n + 1], axis=1)]
    )
    return vertices, faces


@pytest.fixture
def sheet():
    """A scene of one mesh and one sphere under a grey environment."""
    scene = fl.Scene()
    scene.environment = 1.0
    scene.camera = fl.Camera(eye=(0, 2, 3), look_at=(0, 0, 0), vfov=40)
    scene.material("red", fl.diffuse(albedo=(0.8, 0.1, 0.1)))
    scene.mesh(*grid(12), material="red", name="sheet")
    scene.sphere(center=(0, 0.6, 0), radius=0.3, material=fl.mirror(), name="ball")
    return scene
