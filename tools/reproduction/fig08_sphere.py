"""Figure 8: a hollow sphere closes over flaring hair; all strands simulated, and skinned to 128 guides."""
import numpy as np

from . import pictures

FRAMES = [1, 16, 26, 44, 54, 90]
COUNTED = range(16, 74, 3)  # frames in which the sphere is in the hair
GUIDES = 128
SPHERE = 1  # solid; 0 is the head
VIEW = (15, 30)
INNER, OUTER = 0.102, 0.11  # radii of the walls [m], as tools/make-paper-assets makes them


def make(figures):
    run = figures.run("sphere")
    count = 13 if figures.quick else GUIDES
    skinned = figures.run("sphere", f"{GUIDES}_guides", {"/groom/interpolate": {"count": count}})
    camera = pictures.shared_camera([(run, frame) for frame in FRAMES[1:]], VIEW, figures.size(250))
    near = pictures.shared_camera([], VIEW, figures.size(250), points=sphere(run, 26)[0])
    rows = [
        pictures.strip(run, FRAMES[:3] + FRAMES[4:5], camera, "frame", **figures.look),
        pictures.strip(run, FRAMES[1:5], near, "all strands, frame", **figures.look),
        pictures.strip(skinned, FRAMES[1:5], near, f"{GUIDES} guides, frame", **figures.look),
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))

    back = np.linalg.norm(run.position(run.frames[-1]) - run.cache.rest_position, axis=1)
    figures.record(
        {"health": run.health(COUNTED)}
        | {"particles_in_the_hollow": {frame: caught(run, frame) for frame in FRAMES}}
        | {"away_from_rest_at_the_end_m": {"median": np.median(back), "p99": np.percentile(back, 99)}}
        | {"in_the_wall_most": {"all strands": in_the_wall(run), f"{GUIDES} guides": in_the_wall(skinned)}}
    )


def in_the_wall(run):
    """Most particles of any counted frame that are more than 0.1 mm inside the wall."""
    return max(int(run.inside(frame, 1e-4, SPHERE).sum()) for frame in COUNTED)


def sphere(run, frame):
    """(vertices, triangles) of the sphere."""
    return run.surfaces(frame)[SPHERE]


def caught(run, frame):
    """Particles in the hollow."""
    return int((from_centre(run, frame) < INNER).sum())


def from_centre(run, frame):
    """[particles] distance from the sphere's centre. The last two vertices of its mesh are the poles of the outer and
    of the inner wall, on the axis on the far side of the opening: the centre is a radius before them."""
    outer, inner = sphere(run, frame)[0][-2:].astype(float)
    centre = inner + INNER * (inner - outer) / np.linalg.norm(inner - outer)
    return np.linalg.norm(run.position(frame) - centre, axis=1)
