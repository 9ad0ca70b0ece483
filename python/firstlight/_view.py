"""The widget of notebooks: orbit, pull focus, converge.

A thread of its own renders the scene again and again, each time with twice as many samples, and starts again when the
camera moves: coarse first, so that it follows the hand. The page gets images and sends moves. Needs `anywidget`.
"""

from __future__ import annotations

import queue
import threading
from typing import Any, Dict, List, Optional, Tuple

import anywidget
import numpy as np
import traitlets

PAGE = """
function render({ model, el }) {
  const image = document.createElement("img");
  const status = document.createElement("div");
  image.draggable = false;
  image.tabIndex = 0;
  Object.assign(image.style, { width: `${model.get("width")}px`, maxWidth: "100%", touchAction: "none", cursor: "grab" });
  Object.assign(status.style, { font: "12px sans-serif", opacity: 0.7 });
  el.append(image, status);

  let url = null;
  const show = () => {
    const frame = model.get("frame");
    if (!frame || !frame.byteLength) return;
    const next = URL.createObjectURL(new Blob([frame], { type: "image/png" }));
    image.src = next;
    if (url) URL.revokeObjectURL(url);
    url = next;
  };
  const tell = () => { status.textContent = model.get("status"); };
  model.on("change:frame", show);
  model.on("change:status", tell);
  show();
  tell();

  // Fractions of the image, from its upper left corner.
  const place = (event) => {
    const box = image.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  };
  let last = null;
  image.addEventListener("pointerdown", (event) => {
    const [x, y] = place(event);
    if (event.shiftKey) {
      model.send({ kind: "focus", x, y });
    } else {
      last = [x, y];
      image.setPointerCapture(event.pointerId);
    }
    event.preventDefault();
  });
  image.addEventListener("pointermove", (event) => {
    if (!last) return;
    const [x, y] = place(event);
    model.send({ kind: "orbit", x: x - last[0], y: y - last[1] });
    last = [x, y];
  });
  image.addEventListener("pointerup", () => { last = null; });
  image.addEventListener("wheel", (event) => {
    model.send({ kind: "zoom", by: Math.sign(event.deltaY) });
    event.preventDefault();
  }, { passive: false });
  image.addEventListener("dblclick", () => model.send({ kind: "home" }));
  return () => { if (url) URL.revokeObjectURL(url); };
}
export default { render };
"""


class Viewer(anywidget.AnyWidget):
    """Shows a scene: drag to orbit, wheel to come nearer, Shift+click to focus, double click to go back."""

    _esm = PAGE
    width = traitlets.Int(640).tag(sync=True)
    height = traitlets.Int(360).tag(sync=True)
    frame = traitlets.Bytes(b"").tag(sync=True)
    status = traitlets.Unicode("").tag(sync=True)

    def __init__(self, scene: Any, width: int, height: int, spp: int) -> None:
        super().__init__(width=width, height=height)
        self.scene, self._spp = scene, spp
        self._home: Dict[str, Any] = dict(scene.camera)
        self._moves: "queue.Queue[Optional[Dict[str, Any]]]" = queue.Queue()
        self.on_msg(lambda _widget, move, _buffers: self.move(**move))
        self._thread = threading.Thread(target=self._work, name="firstlight viewer", daemon=True)
        self._thread.start()

    def move(self, **move: Any) -> None:
        """What the page sends: `kind` is orbit, zoom, focus or home."""
        self._moves.put(move)

    def close(self) -> None:
        """Ends the thread, and removes the widget."""
        self._moves.put(None)
        super().close()

    def _work(self) -> None:
        """Renders until the widget is closed."""
        step = 0
        while True:
            done = 1 << step > self._spp
            moves = self._next_moves(wait=done)
            if moves is None:
                return
            try:
                if moves:
                    self._apply(moves)
                    step = 0
                self._show(step)
                step += 1
            except Exception as error:
                self.status = f"{error}"
                step = 64

    def _next_moves(self, wait: bool) -> Optional[List[Dict[str, Any]]]:
        """All moves so far; `None` at the end."""
        moves = []
        while True:
            try:
                move = self._moves.get(block=wait and not moves)
            except queue.Empty:
                return moves
            if move is None:
                return None
            moves.append(move)

    def _show(self, step: int) -> None:
        """Shows an image of 2^step samples per pixel; the first one is coarse."""
        divider = 4 if step == 0 else 1
        size = (max(1, self.width // divider), max(1, self.height // divider))
        image = self.scene.render(*size, spp=1 << step, denoise=True, progress=lambda *_: self._moves.empty())
        if step > 0 and not self._moves.empty():
            return
        self.frame = image.png()
        error = image.denoised_error
        self.status = f"{image.spp} samples per pixel" + ("" if error is None else f", error {100 * error:.2g} %")

    def _apply(self, moves: List[Dict[str, Any]]) -> None:
        """Moves the camera, once for all moves."""
        camera = self.scene.camera
        eye = np.array(camera.eye, dtype=float)
        forward, right, up, distance = axes(dict(camera))
        target = eye + distance * forward
        for move in moves:
            if move["kind"] == "home":
                self.scene.camera = type(camera)(**self._home)
                return
            if move["kind"] == "focus":
                depth = self.scene.render(self.width, self.height, spp=1, layers=["depth"]).layers["depth"]
                row, column = int(move["y"] * self.height), int(move["x"] * self.width)
                found = depth[min(max(row, 0), self.height - 1), min(max(column, 0), self.width - 1)]
                if np.isfinite(found):
                    self.scene.set("camera.focus_distance", float(found))
                return
            if move["kind"] == "zoom":
                eye = target + (eye - target) * 1.15 ** move["by"]
            elif move["kind"] == "orbit":
                eye = target + orbit(eye - target, up, move["x"] * np.pi, move["y"] * np.pi)
        focus = camera.focus_distance
        camera.look_at(target, eye=eye, up=up)
        if focus is not None:
            # The focal plane stays where it is looked at from the same distance.
            scale = np.linalg.norm(eye - target) / distance
            self.scene.set("camera.focus_distance", float(focus * scale))


def axes(camera: Dict[str, Any]) -> Tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """View direction, right, up as given, and the distance of the point about which the view orbits."""
    eye, up = np.array(camera["eye"], dtype=float), np.array(camera.get("up", (0, 1, 0)), dtype=float)
    if camera.get("look_at") is not None:
        offset = np.array(camera["look_at"], dtype=float) - eye
    else:
        forward = np.array(camera["forward"], dtype=float)
        offset = forward / np.linalg.norm(forward) * camera.get("pivot_distance", 1.0)
    distance = float(np.linalg.norm(offset))
    forward = offset / distance
    right = np.cross(forward, up)
    return forward, right / np.linalg.norm(right), up / np.linalg.norm(up), distance


def orbit(offset: np.ndarray, up: np.ndarray, yaw: float, pitch: float) -> np.ndarray:
    """An offset from the target turned about the up direction and tilted, radians; it stays clear of the poles."""
    distance = np.linalg.norm(offset)
    height = np.arcsin(np.clip(offset @ up / distance, -1, 1)) + pitch
    height = float(np.clip(height, -1.5, 1.5))
    level = offset - (offset @ up) * up
    level = level / np.linalg.norm(level)
    side = np.cross(up, level)
    level = np.cos(yaw) * level - np.sin(yaw) * side
    return distance * (np.cos(height) * level + np.sin(height) * up)
