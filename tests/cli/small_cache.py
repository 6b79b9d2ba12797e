"""A small cache by the letter of schemas/cache.md, written with h5py alone."""
import h5py
import numpy as np

STRANDS, PARTICLES = 300, 12
RADIUS = 0.1  # of the ball [m]


def ball(rings=16, sectors=24):
    """(vertices, triangles) of a ball."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, sectors, endpoint=False), indexing="ij")
    vertices = RADIUS * np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1)
    index = np.arange((rings + 1) * sectors).reshape(rings + 1, sectors)
    a, b = index[:-1], np.roll(index, -1, 1)[:-1]
    c, d = index[1:], np.roll(index, -1, 1)[1:]
    return vertices.reshape(-1, 3), np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)]).reshape(-1, 3)


def strands():
    """[strands, particles, 3]: curls from the upper half of the ball outwards."""
    random = np.random.default_rng(7)
    normal = random.normal(size=(STRANDS, 1, 3))
    normal[..., 1] = np.abs(normal[..., 1])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    along = np.linspace(0, 0.12, PARTICLES)[None, :, None]
    turn = 120 * along + random.uniform(0, 6.28, (STRANDS, 1, 1))
    curl = 0.006 * np.concatenate([np.cos(turn), 0 * turn, np.sin(turn)], -1) * (along > 0)
    return normal * (RADIUS + along) + curl


def write_small_cache(directory):
    position = strands().reshape(-1, 3).astype("f4")
    vertices, triangles = ball()
    with h5py.File(directory / "ball.h5", "w") as file:
        file.attrs.update(format="ringlet-cache", format_version=1, content="master", name="ball", up="y", fps=24.0)
        file["strands/offsets"] = np.arange(STRANDS + 1, dtype="i8") * PARTICLES
        file["strands/rest_position"] = position
        file["strands/width"] = np.full(len(position), 0.0008, "f4")
        file["surfaces/0/triangles"] = triangles.astype("i4")
    for frame in (1, 2, 3):
        write_frame(directory / f"ball.{frame:04d}.h5", position + [0.02 * (frame - 1), 0, 0], vertices)


def write_frame(path, position, vertices):
    with h5py.File(path, "w") as file:
        file.attrs.update(format="ringlet-cache", format_version=1, content="frame", frame=int(path.name.split(".")[1]))
        file["position"] = position.astype("f4")
        file["surfaces/0/vertices"] = vertices.astype("f4")
