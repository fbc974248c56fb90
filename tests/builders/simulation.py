"""Exported models in MuJoCo."""

import mujoco
import numpy as np


def mujoco_state(path):
    """Return a model and its state before the first step."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def joints_of(data, chain, name="chain0"):
    """Return the joints (N + 1, 3) m at which a model has those of a chain."""
    return np.array([data.site(f"{name}_{k}").xpos for k in range(len(chain.joints))])
