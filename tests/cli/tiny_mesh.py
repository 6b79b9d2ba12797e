"""The tiny scene with a hair mesh for its hair: a cap of quads on the head, extruded."""
import json

import numpy as np

from tiny import RADIUS, write_scene

ACROSS, LAYERS, HEIGHT = 5, 4, 0.09  # vertices each way, layers with the scalp's, of the hair [m]


def hair_mesh():
    """A hair mesh in Ringlet's JSON: its columns lean to +x, as hair does that lies."""
    at = np.linspace(-0.6, 0.6, ACROSS)
    z, x = np.meshgrid(at, at, indexing="ij")
    directions = np.stack([x, np.ones_like(x), z], -1).reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lean = np.array([0.4, 0.0, 0.0])
    layers = [(RADIUS * directions + k / (LAYERS - 1) * HEIGHT * (directions + lean)).tolist() for k in range(LAYERS)]
    faces = []
    for i in range(ACROSS - 1):
        for j in range(ACROSS - 1):
            here = i * ACROSS + j
            faces.append([here, here + ACROSS, here + ACROSS + 1, here + 1])
    return {"format": "ringlet-hair-mesh", "version": 1, "units": {"length": "m", "up": "y"}, "faces": faces, "layers": layers}


def write_mesh_scene(directory, change=lambda scene: None, mesh=None):
    """Writes `tiny.json` and what it names; `change` edits the scene before."""
    (directory / "hair.json").write_text(json.dumps(mesh or hair_mesh()))

    def with_mesh(scene):
        scene["groom"] = {"hair_mesh": {"file": "hair.json", "strands": 200, "particles": 8}}
        scene["model"] = {"type": "hair_mesh"}
        del scene["effects"]["inextensible"]
        change(scene)

    return write_scene(directory, with_mesh)
