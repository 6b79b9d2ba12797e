"""Hair against hair in the paper's scenes: what the grid changes in Figures 1 (wind), 6 and 11, and what it costs."""
import numpy as np

from .density import volume
from .fig11_grooming import CUT, STILL, UNCUT, apart

GRID = {"/effects/hair_hair": {"grid": {}}}
SHELTER = {"/effects/hair_hair": {"grid": {"shelter": {}}}}
VOXEL = 0.003  # [m]
COUNTED = 10  # volumes are of every tenth frame


def make(figures):
    numbers = {"voxel_m": VOXEL}
    for scene, variants in {
        "wind": {"off": {}, "grid": GRID, "grid, shelter": SHELTER},
        "wig": {"off": {}, "grid": GRID, "grid, shelter": SHELTER},
    }.items():
        numbers[scene] = {name: in_wind(run(figures, scene, name, each)) for name, each in variants.items()}
    numbers["grooming"] = {name: grooming(figures, name, each) for name, each in {"off": {}, "grid": GRID}.items()}
    figures.record(numbers)


def run(figures, scene, name, settings):
    return figures.run(scene, f"{scene}_{name.replace(', ', '_')}", settings)


def in_wind(one):
    direction = np.array(one.scene["effects"]["wind"]["keys"][-1]["velocity"], float)
    direction /= np.linalg.norm(direction)
    frames = one.frames[::COUNTED]
    steady = [frame for frame, time in zip(one.frames, one.times) if time > 1]
    downwind = [np.median((one.position(f) - one.carried_rest(f))[one.tips] @ direction) for f in steady]
    volumes = {frame: volume(one, frame, VOXEL) for frame in frames}
    return {
        "tips_downwind_m": {"median": np.mean(downwind), "least": min(downwind), "most": max(downwind)},
        "volume_l": {frame: 1e3 * each for frame, each in volumes.items()},
        "least_volume_over_first": min(volumes.values()) / volumes[frames[0]],
    } | cost(one)


def grooming(figures, name, settings):
    both = {"cut": settings, "uncut": settings | UNCUT}
    cut, uncut = (run(figures, "grooming", f"{name}_{of}", each) for of, each in both.items())
    still = [run(figures, "grooming", f"{name}_still_{of}", each | STILL) for of, each in both.items()]
    frames = [CUT, 44, 62, 80]
    return {
        "in_wind_m": {frame: apart(cut, uncut, frame) for frame in frames},
        "in_still_air_m": {frame: apart(*still, frame) for frame in frames},
        "uncut_volume_l": {frame: 1e3 * volume(uncut, frame, VOXEL) for frame in [1, *frames]},
    } | cost(cut)


def cost(one):
    return {
        "core_ms_per_frame": one.core_milliseconds,
        "grid_iterations_a_frame_worst": one.worst("grid_iterations"),
        "grid_residual_worst": one.worst("grid_residual"),
        "edge_strain_free": one.worst("edge_strain_free"),
        "edge_strain_moved": one.worst("edge_strain_moved"),
        "push_out_max_m": one.worst("push_out_max"),
        "speed_max": one.worst("speed_max"),
    }
