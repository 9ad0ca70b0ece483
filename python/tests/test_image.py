"""Images: files, errors, progress, interruption, memory."""

import gc
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import grid

import firstlight as fl


def program(*words, cwd):
    return subprocess.run([sys.executable, "-m", "firstlight", *words], cwd=cwd, capture_output=True, text=True)


def test_the_program_makes_the_same_bytes(tmp_path):
    done = program(
        "render", "cornell", "-o", "program.exr", "--size", "40x30", "--spp", "8", "--seed", "7", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    fl.open("cornell").render(40, 30, spp=8, seed=7).save(tmp_path / "python.exr")
    assert (tmp_path / "python.exr").read_bytes() == (tmp_path / "program.exr").read_bytes()
    # Any number of threads.
    image = fl.open("cornell").render(40, 30, spp=8, seed=7, threads=3)
    assert (image.numpy() == fl.open("cornell").render(40, 30, spp=8, seed=7, threads=1).numpy()).all()


def test_the_command_tells_its_status(tmp_path):
    done = program("render", "no-such-scene", cwd=tmp_path)
    assert done.returncode == 2 and "no-such-scene" in done.stderr
    assert program("--version", cwd=tmp_path).stdout.strip() == f"firstlight {fl.__version__}"


def test_files_open_again_as_the_scene(tmp_path):
    image = fl.open("cornell").render(16, 12, spp=1)
    for name in ["a.png", "a.exr"]:
        image.save(tmp_path / name)
        again = fl.open(tmp_path / name).render(16, 12, spp=1)
        assert (again.numpy() == image.numpy()).all()
    with pytest.raises(fl.Error, match="txt"):
        image.save(tmp_path / "a.txt")
    assert image.png().startswith(b"\x89PNG") and image._repr_png_() == image.png()
    assert image.rgba().shape == (12, 16, 4)


def test_the_error_is_a_number_with_an_interval():
    image = fl.open("cornell").render(32, 32, spp=64, layers=["error"], denoise=True)
    low, high = image.error_interval
    assert 0 < low <= image.error <= high
    assert image.layers["error"].shape == (32, 32) and image.layers["error"].mean() > 0
    assert image.denoised.shape == (32, 32, 3) and image.denoised_error > 0
    assert fl.open("cornell").render(8, 8, spp=1, layers=["error"]).layers == {}


def test_it_stops_at_the_target():
    scene = fl.open("cornell")
    assert scene.render(32, 32, error=0.2).error <= 0.2
    start = time.monotonic()
    scene.render(32, 32, seconds=0.3)
    assert time.monotonic() - start < 20


def test_progress_is_told_and_ends_the_rendering():
    calls = []

    def progress(spp, seconds, error):
        calls.append(spp)
        return len(calls) < 3

    image = fl.open("cornell").render(32, 32, spp=1 << 20, progress=progress)
    assert len(calls) == 3 and image.spp < 1 << 20 and not image.interrupted

    def fails(*_):
        raise RuntimeError("from the callback")

    with pytest.raises(RuntimeError, match="from the callback"):
        fl.open("cornell").render(32, 32, spp=1 << 20, progress=fails)


@pytest.mark.skipif(os.name == "nt", reason="signals are sent as on Unix")
def test_ctrl_c_keeps_what_there_is():
    scene = fl.open("cornell")
    scene.render(16, 16, spp=1)

    def later():
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()

    # A job in the background ignores the signal from its start.
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    later()
    image = scene.render(16, 16, spp=1 << 28)
    assert image.interrupted and 0 < image.spp < 1 << 28 and scene.image is image
    later()
    with pytest.raises(KeyboardInterrupt):
        scene.render(16, 16, spp=1 << 28)
    signal.signal(signal.SIGINT, handler)


def test_other_threads_run_meanwhile():
    counted = [0]
    done = threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    fl.open("cornell").render(32, 32, seconds=0.5, threads=1)
    done.set()
    thread.join()
    assert counted[0] > 20


def pixel_sum_of(name):
    return float(fl.open(name).render(16, 16, spp=2).numpy().sum())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked on Unix alone")
def test_a_forked_process_renders():
    expected = pixel_sum_of("cornell")
    # As the workers of a loader of data.
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(pixel_sum_of, ("cornell",)).get(60) == expected


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="memory is read as on Linux")
def test_memory_does_not_grow(request):
    def megabytes():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6

    # What is no longer used goes at once, not when Python looks for circles.
    gc.disable()
    request.addfinalizer(gc.enable)
    scene = fl.Scene()
    scene.environment = 1
    scene.camera = fl.Camera(eye=(0, 2, 3), look_at=(0, 0, 0))
    vertices, faces = grid(24)
    sheet = scene.mesh(vertices, faces, name="sheet")
    at = {}
    for i in range(601):
        sheet.reshape(vertices=vertices * (1 + 0.001 * i))
        scene.camera.look_at((0, 0, 0), eye=(np.sin(i), 2, 3))
        scene.set("diffuse.albedo", 0.3 + 0.001 * i)
        scene.render(8, 8, spp=1, layers=True)
        at[i] = megabytes()
    # A mesh with its tree, kept each time, would be 20 MB.
    assert at[600] - at[300] < 10, f"{at[300]:.0f} MB, then {at[600]:.0f} MB"
