"""Figure 8: a hollow sphere with an opening closes over flaring hair, which is inside it and outside."""
import numpy as np

from . import pictures

FRAMES = [1, 16, 26, 44, 54, 90]
VIEW = (15, 30)
INNER, OUTER = 0.102, 0.11  # radii of the walls [m], as tools/make-paper-assets makes them


def make(figures):
    run = figures.run("sphere")
    camera = pictures.shared_camera([(run, frame) for frame in FRAMES[1:]], VIEW, figures.size(260))
    near = pictures.shared_camera([], VIEW, figures.size(260), points=sphere(run, 26)[0])
    far_row = pictures.strip(run, FRAMES[:3] + FRAMES[4:5], camera, "frame", **figures.look)
    near_row = pictures.strip(run, FRAMES[1:5], near, "near, frame", **figures.look)
    pictures.save(pictures.sheet([far_row, near_row]), figures.path(".png"))

    counts = {frame: caught(run, frame) for frame in FRAMES}
    back = np.linalg.norm(run.position(run.frames[-1]) - run.cache.rest_position, axis=1)
    figures.record(
        run.health(range(2, run.frames[-1] + 1, 4))
        | {"particles_in_the_cavity": counts}
        | {"away_from_rest_at_the_end_m": {"median": np.median(back), "p99": np.percentile(back, 99)}}
    )


def sphere(run, frame):
    """(vertices, triangles) of the sphere: the solid after the head."""
    return run.surfaces(frame)[1]


def caught(run, frame):
    """Particles in the hollow."""
    return int((from_centre(run, frame) < INNER).sum())


def from_centre(run, frame):
    """[particles] distance from the sphere's centre. The last two vertices of its mesh are the poles of the outer and of
    the inner wall, on the axis on the far side of the opening: the centre is a radius before them."""
    outer, inner = sphere(run, frame)[0][-2:].astype(float)
    centre = inner + INNER * (inner - outer) / np.linalg.norm(inner - outer)
    return np.linalg.norm(run.position(frame) - centre, axis=1)
