"""Figure 11: hair is cut in frame 25, then wind blows: cutting the picture alone beside cutting the simulated hair."""
import numpy as np

from . import pictures

CUT = 25
FRAMES = [CUT, 44, 62, 80]
STILL = {"/effects/wind": None}
UNCUT = {"/effects/grooming": None}


def make(figures):
    cut = figures.run("grooming")
    uncut = figures.run("grooming", "uncut", UNCUT)
    camera = pictures.shared_camera([(uncut, frame) for frame in FRAMES], (20, 8), figures.size(250))
    rows = [
        pictures.strip(uncut, [CUT - 1, *FRAMES[1:]], camera, "uncut, frame", **figures.look),
        [geometry_alone(cut, uncut, frame, camera, **figures.look) for frame in FRAMES],
        pictures.strip(cut, FRAMES, camera, "cut, frame", **figures.look),
    ]
    pictures.save(pictures.sheet(rows), figures.path(".png"))

    numbers = {"health": cut.health(FRAMES), "living_share": cut.living(CUT).mean()}
    numbers["in_wind_m"] = {frame: apart(cut, uncut, frame) for frame in FRAMES}
    pair = [figures.run("grooming", f"still_{name}", STILL | more) for name, more in (("cut", {}), ("uncut", UNCUT))]
    numbers["in_still_air_m"] = {frame: apart(*pair, frame) for frame in FRAMES}
    figures.record(numbers)


def geometry_alone(cut, uncut, frame, camera, **look):
    """The uncut hair of a frame, drawn as far as the cut leaves it."""
    image = pictures.render(uncut, frame, camera, living=cut.living(frame), **look)
    return pictures.titled(image, f"geometry cut, frame {frame}")


def last_whole(cut, frame):
    """[cut strands] the last particle before the segment that the cut shortened; not of strands cut to their roots."""
    left = np.add.reduceat(cut.living(frame).astype(int), cut.roots)
    shortened = (left < cut.counts) & (left > 2)
    return cut.roots[shortened] + left[shortened] - 2


def apart(cut, uncut, frame):
    """Between the cut hair's ends and the same points of the hair that was not cut: distance, and how far higher."""
    ends = last_whole(cut, frame)
    across = (cut.position(frame) - uncut.position(frame))[ends]
    distance = np.linalg.norm(across, axis=1)
    return {"median": np.median(distance), "p95": np.percentile(distance, 95), "higher_median": np.median(across[:, 1])}
