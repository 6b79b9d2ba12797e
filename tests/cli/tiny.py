"""A tiny scene for the command line's tests, and its groom in each format's own bytes."""
import copy
import json
import struct

import h5py
import numpy as np

from conftest import run
from small_cache import ball

RADIUS = 0.1  # of the head [m]
STRANDS, PARTICLES, LENGTH = 300, 9, 0.15
LAST = 4

SCENE = {
    "name": "tiny",
    "frames": {"first": 1, "last": LAST, "fps": 24},
    "head": {
        "mesh": "head.obj",
        "animation": {"keys": [{"frame": 1}, {"frame": 5, "translate": [0.1, 0, 0], "rotate": [0, 0.5, 0, 0.8]}]},
    },
    "groom": {"file": "groom.data", "attach": "nearest"},
    "model": {"substeps": 4},
    "effects": {
        "gravity": [0, -9.81, 0],
        "inextensible": {},
        "solids": [{"source": "head", "friction": 0.3, "resolution": 32}],
    },
}


def strands(count=STRANDS):
    """[count, PARTICLES, 3] float32: slanted straight strands from the upper half of the head."""
    random = np.random.default_rng(3)
    normal = random.normal(size=(count, 1, 3))
    normal[..., 1] = np.abs(normal[..., 1])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    slant = normal + 0.3 * random.normal(size=normal.shape)
    along = np.linspace(0, LENGTH, PARTICLES)[None, :, None]
    return (RADIUS * normal + along * slant / np.linalg.norm(slant, axis=-1, keepdims=True)).astype("<f4")


def hair_bytes(points, strand_count=None, point_count=None):
    """Cem Yuksel's HAIR: every strand of the header's default segments."""
    count, particles = points.shape[:2]
    header = struct.pack(
        "<4sIIIIfffff88s", b"HAIR", strand_count or count, point_count or count * particles, 2, particles - 1,
        5e-5, 0, 0, 0, 0, b"",
    )
    return header + points.tobytes()


def data_bytes(points, strand_count=None, vertex_count=None):
    """USC-HairSalon."""
    each = [struct.pack("<i", vertex_count or len(strand)) + strand.tobytes() for strand in points]
    return struct.pack("<i", strand_count or len(points)) + b"".join(each)


def tfx_bytes(points, version, strand_count=None, offset=None):
    """TressFX 3 or 4."""
    count, particles = points.shape[:2]
    words = 74 if version == 3 else 40
    header = bytearray(4 * words)
    struct.pack_into("<fII", header, 0, version, strand_count or count, particles)
    struct.pack_into("<I", header, 4 * (36 if version == 3 else 3), offset or 4 * words)
    if version == 4:
        points = np.concatenate([points, np.ones_like(points[..., :1])], -1)
    return bytes(header) + points.tobytes()


def write_mesh(path, vertices, triangles):
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in vertices]
    path.write_text("\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]) + "\n")


def write_scene(directory, change=lambda scene: None, groom=None):
    """Writes `tiny.json` with its head and groom; `change` edits the scene before."""
    write_mesh(directory / "head.obj", *ball())
    (directory / "groom.data").write_bytes(data_bytes(strands()) if groom is None else groom)
    scene = copy.deepcopy(SCENE)
    change(scene)
    (directory / "tiny.json").write_text(json.dumps(scene, indent=2))
    return directory / "tiny.json"


def frame_bytes(directory):
    """The bytes of every frame file by its name."""
    return {path.name: path.read_bytes() for path in sorted(directory.glob("tiny.[0-9]*.h5"))}


def steps(program, scene, out, *options):
    """Runs the scene; the bytes of its frames."""
    result = run(program, "run", scene, "-o", out, "--progress", "none", *options)
    assert result.returncode == 0, result.stderr
    return frame_bytes(out)


def figures(out, name):
    """[frames] a figure of the solver."""
    with h5py.File(out / "tiny.h5") as cache:
        return cache["figures"][name][:]
