"""Scenes from arrays and files, and what their images show."""

import numpy as np
import pytest
from conftest import grid

import firstlight as fl

SMALL = dict(width=32, height=24, spp=2, adaptive=False)


def furnace(albedo):
    """The mean radiance of a diffuse sphere that fills the image, in an environment of radiance 1."""
    scene = fl.Scene()
    scene.environment = 1
    scene.sphere(radius=1, material=fl.diffuse(albedo=albedo))
    scene.camera = fl.Camera(eye=(0, 0, 3), look_at=(0, 0, 0), vfov=10)
    return scene.render(16, 16, spp=64).numpy().mean(axis=(0, 1))


def test_a_sphere_in_an_even_environment_has_the_radiance_of_its_albedo():
    assert np.allclose(furnace((0.5, 0.25, 0.75)), (0.5, 0.25, 0.75), rtol=0.02)


def test_layers_agree_with_geometry():
    scene = fl.Scene()
    scene.environment = 1
    scene.camera = fl.Camera(eye=(0, 5, 0), look_at=(0, 0, 0), up=(0, 0, -1), vfov=30)
    vertices = np.array([[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], dtype=np.float32)
    scene.mesh(vertices, [[0, 1, 2], [0, 2, 3]], material=fl.diffuse(albedo=(0.2, 0.4, 0.6)), name="floor")
    image = scene.render(**SMALL, layers=True)
    assert set(image.layers) >= {"albedo", "normal", "position", "depth", "coverage", "object", "material", "samples"}
    assert np.allclose(image.layers["depth"], 5, atol=1e-4)
    assert np.allclose(image.layers["normal"], (0, 1, 0), atol=1e-5)
    assert np.allclose(image.layers["albedo"], (0.2, 0.4, 0.6), atol=1e-5)
    assert np.allclose(image.layers["position"][..., 1], 0, atol=1e-4)
    assert image.layers["depth"].shape == (24, 32) and image.layers["object"].dtype == np.int32
    assert image.object_names == ["floor"] and (image.layers["object"] == 0).all()
    assert (image.layers["samples"] == 2).all()


def test_ids_tell_objects_apart(sheet):
    image = sheet.render(**SMALL, layers=["object"])
    ids = image.layers["object"]
    assert sorted(image.object_names) == ["ball", "sheet"]
    assert {image.object_names[i] for i in np.unique(ids) if i >= 0} == {"ball", "sheet"}
    assert image.object_names[ids[9, 16]] == "ball" and (ids[0] == -1).any()
    with pytest.raises(KeyError):
        image.layers["depth"]


def test_what_is_set_is_seen_and_nothing_else_changes(sheet):
    before = sheet.render(**SMALL).numpy()
    assert (sheet.render(**SMALL).numpy() == before).all(), "the same scene gives the same image"
    sheet.set("red.albedo", (0.1, 0.1, 0.8))
    blue = sheet.render(**SMALL).numpy()
    assert blue.mean(axis=(0, 1))[2] > before.mean(axis=(0, 1))[2]
    sheet.set("red", fl.diffuse(albedo=(0.8, 0.1, 0.1)))
    assert (sheet.render(**SMALL).numpy() == before).all(), "what is set back is as before"
    sheet.set("camera.vfov", 60)
    assert sheet.camera.vfov == 60
    assert (sheet.render(**SMALL).numpy() != before).any()


def test_an_image_does_not_tell_how_the_scene_came_about():
    def scene(x):
        made = fl.Scene()
        made.environment = 1
        made.camera = fl.Camera(eye=(0, 2, 3), look_at=(0, 0, 0))
        thing = made.mesh(*grid(8), name="sheet", transform=(x, 0, 0))
        return made, thing

    moved, thing = scene(0.5)
    moved.render(**SMALL)
    thing.place((0.25, 0, 0))
    fresh, _ = scene(0.25)
    assert (moved.render(**SMALL).numpy() == fresh.render(**SMALL).numpy()).all()
    vertices, _ = grid(8)
    thing.reshape(vertices=vertices * 0.5)
    assert (moved.render(**SMALL).numpy() != fresh.render(**SMALL).numpy()).any()


def test_instances_are_placed_from_one_array(sheet):
    ball = sheet["ball"]
    copies = sheet.instances(ball, np.array([[-0.6, 0.5, 0], [0.6, 0.5, 0]]))
    assert len(copies) == 2
    n = len(set(np.unique(sheet.render(**SMALL, layers=["object"]).layers["object"])))
    assert n == 5, "background, sheet and three spheres"
    matrices = np.tile(np.eye(4), (2, 1, 1))
    matrices[:, 0, 3] = 100
    copies.place(matrices)
    assert len(set(np.unique(sheet.render(**SMALL, layers=["object"]).layers["object"]))) == 3


def test_textures_come_from_arrays():
    scene = fl.Scene()
    scene.environment = 1
    scene.camera = fl.Camera(eye=(0.5, 0.5, 2), look_at=(0.5, 0.5, 0), orthographic_height=1)
    pixels = np.zeros((2, 2, 3), dtype=np.float32)
    pixels[0, 0] = (1, 0, 0)
    pixels[1, 1] = (0, 0, 1)
    scene.quad((0, 0, 0), (1, 0, 0), (0, 1, 0), material=fl.diffuse(albedo=fl.texture(pixels, smooth=False)))
    albedo = scene.render(16, 16, spp=1, layers=["albedo"], filter="box").layers["albedo"]
    assert np.allclose(albedo[2, 2], (1, 0, 0)) and np.allclose(albedo[13, 13], (0, 0, 1))
    assert np.allclose(albedo[2, 13], 0)


def test_an_environment_comes_from_an_array():
    scene = fl.Scene()
    sky = np.zeros((8, 16, 3), dtype=np.float32)
    sky[:4] = (0, 0, 2)
    scene.environment = sky
    scene.camera = fl.Camera(eye=(0, 0, 0), look_at=(0, 1, -1), vfov=10)
    assert np.allclose(scene.render(4, 4, spp=1).numpy(), (0, 0, 2))


def test_blends_and_slots_use_materials_by_value():
    scene = fl.Scene()
    scene.environment = 1
    scene.camera = fl.Camera(eye=(0, 5, 0), look_at=(0, 0, 0), up=(0, 0, -1))
    red, green = fl.diffuse(albedo=(1, 0, 0)), fl.diffuse(albedo=(0, 1, 0))
    half = fl.blend(weight=0.5, a=red, b=green)
    vertices = [[-9, 0, -9], [-9, 0, 9], [0, 0, 9], [0, 0, -9], [9, 0, 9], [9, 0, -9]]
    faces = [[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5]]
    scene.mesh(vertices, faces, material=[half, green], slots=[0, 0, 1, 1])
    albedo = scene.render(16, 16, spp=1, layers=["albedo"]).layers["albedo"]
    assert np.allclose(albedo[8, 2], (0.5, 0.5, 0), atol=0.01) and np.allclose(albedo[8, 13], (0, 1, 0), atol=0.01)
    assert scene.materials == ["diffuse", "diffuse 2", "blend"]


def test_render_many_is_one_image_per_camera():
    scene = fl.open("cornell")
    cameras = [scene.camera.replace(vfov=vfov) for vfov in (20, 40)]
    images = list(fl.render_many(scene, cameras, width=16, height=16, spp=1))
    assert len(images) == 2 and (images[0].numpy() != images[1].numpy()).any()


def test_a_camera_is_changed_in_place(sheet):
    sheet.camera.look_at((0, 0.5, 0), eye=(1, 2, 3))
    assert np.allclose(sheet.camera.eye, (1, 2, 3)) and np.allclose(sheet.camera.target, (0, 0.5, 0))
    sheet.camera.lens_radius = 0.1
    assert sheet.camera.lens_radius == 0.1
    assert sheet.camera.replace(lens_radius=None).lens_radius is None
