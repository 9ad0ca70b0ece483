"""Errors are exceptions with the messages of the program."""

import inspect

import numpy as np
import pytest
from conftest import grid

import firstlight as fl
from firstlight import _stubs


def message(call):
    with pytest.raises(fl.InputError) as caught:
        call()
    assert isinstance(caught.value, ValueError)
    return str(caught.value)


def test_materials_are_checked_by_the_table():
    assert message(lambda: fl.glass(ior=-1)) == "`ior` is -1, but must be finite and positive: 1.5 is glass"
    assert message(lambda: fl.glass(iro=1.4)).startswith("unknown field `iro` of `glass` (did you mean `ior`?)")
    assert "albedo" in message(lambda: fl.diffuse())
    assert "between 0 and 1" in message(lambda: fl.diffuse(albedo=2))
    assert "schlick" in message(lambda: fl.metal(reflectance=0.9, alpha=0.1, fresnel="schlik"))
    assert message(lambda: fl.diffuse(albedo=object())).startswith("`albedo` is <object")


def test_names_are_suggested(sheet):
    assert message(lambda: sheet.set("rad.albedo", 1)) == "nothing is named `rad` (did you mean `red`?)"
    assert message(lambda: sheet.set("red.albdo", 1)).startswith(
        "`red` has no property `albdo` (did you mean `albedo`?)"
    )
    assert "did you mean `red`?" in message(lambda: sheet.sphere(material="rad"))
    assert "did you mean `red`?" in message(lambda: sheet.mesh(*grid(3), material="rad"))
    assert "did you mean `red`?" in message(lambda: sheet.set("rad", fl.mirror()))
    assert message(lambda: sheet.set("red.albedo", (2, 0, 0))).endswith("lie between 0 and 1: it is a share of light")
    assert message(lambda: sheet.set("red", 1)).startswith("`red` names no property")
    with pytest.raises(KeyError):
        sheet["no such object"]


def test_arrays_are_checked(sheet):
    vertices, faces = grid(3)
    assert message(lambda: sheet.mesh(vertices, faces + 5)) == "triangle 1 uses vertex 9, but there are 9"
    assert message(lambda: sheet.mesh(vertices, np.empty((0, 3), dtype=int))) == "the mesh has no triangles"
    assert message(lambda: sheet.mesh(vertices[:, :2], faces)) == "`vertices` has the shape (9, 2), but must be n × 3"
    assert "NaN" in message(lambda: sheet.mesh(vertices * np.nan, faces))
    assert (
        message(lambda: sheet.mesh(vertices, faces, normals=np.ones((9, 3))))
        == "the normal of vertex 0 is not of length 1"
    )
    assert "texture coordinates" in message(lambda: sheet.mesh(vertices, faces, uv=np.zeros((3, 2))))
    assert "flattens" in message(lambda: sheet.mesh(vertices, faces, transform=np.zeros((4, 4))))
    assert message(lambda: sheet.spheres([[0, 0, 0]], -1)) == "sphere 0 needs a finite centre and a positive radius"
    assert "4 × 4" in message(lambda: sheet["ball"].place(np.eye(2)))


def test_scenes_and_options_are_checked(tmp_path):
    assert "no-such" in message(lambda: fl.open("no-such"))
    (tmp_path / "scene.ron").write_text("(camera: (eye: (0, 0, 1), look_at: (0, 0, 0)), film: (width: 0, height: 4))")
    assert "scene.ron:1:" in message(lambda: fl.open(tmp_path / "scene.ron"))
    assert message(lambda: fl.Scene().render()) == "the scene has no camera: add one"
    scene = fl.open("cornell")
    assert "`seconds` is -1" in message(lambda: scene.render(seconds=-1))
    assert "there is no layer `dept` (known:" in message(lambda: scene.render(layers=["dept"]))
    assert "`integrator`" in message(lambda: scene.render(integrator="pth"))
    assert "width" in message(lambda: scene.render(0, 4))
    assert "look_at" in message(lambda: fl.Camera(eye=(0, 0, 0), look_at=(0, 0, 0)))
    assert "vfov" in message(lambda: setattr(scene.camera, "vfov", 400))


def test_a_removed_object_is_told(sheet):
    ball = sheet["ball"]
    ball.remove()
    assert message(lambda: ball.place((0, 0, 0))) == "the object no longer exists"


def test_functions_and_stubs_are_those_of_the_table():
    assert list(inspect.signature(fl.glass).parameters) == ["ior", "absorption", "dispersion"]
    assert inspect.signature(fl.glass).parameters["ior"].default == 1.5
    assert "index of refraction" in fl.glass.__doc__
    assert _stubs.path().read_text(encoding="utf-8") == _stubs.stub(), "run `python -m firstlight._stubs`"
