"""Draw the pictures of docs/pages/recording-to-simulator.md: `MUJOCO_GL=egl python docs/figures/simulator.py`.

The sample bag, its chain, and the chain in MuJoCo at three times. Needs a GL library that MuJoCo can render with.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import mujoco
import numpy as np
from figures import SAMPLES, beside, captioned, drawn, fit, save

import doo3d
from doo3d.inputs import open_capture

WIDTH, HEIGHT = 380, 240  # px, of the frame and the chain over it
VIEW_WIDTH, VIEW_HEIGHT = 250, 240  # px, of a view of the simulation
TIMES = (0.0, 0.25, 3.0)  # s
POSE = [0, 0, 0.7, 1, 0, 0, 0]  # the camera 0.7 m above the table, looking down
LOOK_AT, DISTANCE, AZIMUTH, ELEVATION = (-0.15, 0.0, -0.38), 1.35, 115, -18  # m, m, degrees, degrees


def views(model: mujoco.MjModel) -> list[np.ndarray]:
    """Return a view of the simulation at each of TIMES."""
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = LOOK_AT, DISTANCE, AZIMUTH, ELEVATION
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.5, 0.6
    model.vis.global_.offwidth, model.vis.global_.offheight = 4 * VIEW_WIDTH, 4 * VIEW_HEIGHT
    panels = []
    with mujoco.Renderer(model, 4 * VIEW_HEIGHT, 4 * VIEW_WIDTH) as renderer:
        for time in TIMES:
            while data.time < time:
                mujoco.mj_step(model, data)
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            picture = renderer.render()
            light = np.where((picture.sum(axis=2) == 0)[:, :, None], np.uint8(245), picture)
            panels.append(captioned(fit(light, VIEW_WIDTH, VIEW_HEIGHT), f"{time:g} s"))
    return panels


def main() -> None:
    frame = open_capture(SAMPLES / "bags" / "crossing").frames[0].load().data
    detection = doo3d.detect(frame, doo3d.load_config("default", {"merge.chains": 1}))
    panels = [
        captioned(fit(image, WIDTH, HEIGHT), text)
        for image, text in ((np.asarray(frame.color), "color image of the bag"), (drawn(frame, detection), "chain"))
    ]
    save(beside(*panels), "simulator", "detected")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cable.xml"
        doo3d.export(detection, "mjcf", path, pose=POSE, fixed="first", bending=2e-4)
        save(beside(*views(mujoco.MjModel.from_xml_path(str(path)))), "simulator", "mujoco")


if __name__ == "__main__":
    main()
