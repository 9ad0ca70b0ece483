"""The widget, without a page: what it shows, and what moves do."""

import time

import numpy as np
import pytest

import firstlight as fl

pytest.importorskip("anywidget")


def wait_for(condition):
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_it_converges_orbits_and_focuses():
    scene = fl.open("dof-balls")
    viewer = scene.view(32, 18, spp=4)
    wait_for(lambda: viewer.status.startswith("4 samples"))
    assert viewer.frame.startswith(b"\x89PNG")
    start = np.array(scene.camera.eye)
    viewer.move(kind="orbit", x=0.1, y=0.0)
    wait_for(lambda: not np.allclose(scene.camera.eye, start))
    target = np.array(scene.camera.target)
    assert np.isclose(np.linalg.norm(scene.camera.eye - target), np.linalg.norm(start - target))
    focus = scene.camera.focus_distance
    viewer.move(kind="focus", x=0.5, y=0.9)
    wait_for(lambda: scene.camera.focus_distance != focus)
    viewer.move(kind="home")
    wait_for(lambda: np.allclose(scene.camera.eye, start))
    viewer.close()
    viewer._thread.join(20)
    assert not viewer._thread.is_alive()
