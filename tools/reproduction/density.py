"""How dense hair is, from positions alone: its length in the cells of a lattice of our own, not the solver's; and its
volume, of the cells that it is in."""
import numpy as np

from .common import rigid_motion

LEAST = 4.0  # strands in a cell: with fewer at rest a cell may become as dense as this (docs/architecture.md, the grid)
CORNERS = [np.array([n & 1, n >> 1 & 1, n >> 2 & 1]) for n in range(8)]


def samples(run, position, spacing):
    """(places [n, 3], lengths [n]) of pieces of all segments, no longer than `spacing` at rest."""
    after = np.setdiff1d(np.arange(len(position)), run.roots)
    pieces = int(np.ceil(run.rest_lengths.max() / spacing))
    a, b = position[after - 1], position[after]
    share = (np.arange(pieces) + 0.5) / pieces
    places = a[:, None] + share[None, :, None] * (b - a)[:, None]
    return places.reshape(-1, 3), np.repeat(np.linalg.norm(b - a, axis=1) / pieces, pieces)


def keys(cells):
    """Cells, three whole numbers each, as one number each; they lie within 2^20 of the origin."""
    x, y, z = np.moveaxis(cells.astype(np.int64) + (1 << 20), -1, 0)
    return (x << 42) | (y << 21) | z


class Lattice:
    """Density in strands a cell: the hair's length in it over its edge, a sample shared by its eight nearest cells."""

    def __init__(self, run, position, cell):
        places, lengths = samples(run, position, 0.5 * cell)
        scaled = places / cell - 0.5
        base = np.floor(scaled)
        part = scaled - base
        near = np.stack([keys(base + corner) for corner in CORNERS], axis=1)
        share = np.stack([np.where(corner, part, 1 - part).prod(1) for corner in CORNERS], axis=1)
        self.weight = share * (lengths / cell)[:, None]
        cells, near = np.unique(near, return_inverse=True)
        self.near = near.reshape(self.weight.shape)
        self.density = self.spread(np.ones(len(places)))

    def spread(self, values):
        """The cells' sums of what the samples carry."""
        return np.bincount(self.near.ravel(), (self.weight * values[:, None]).ravel())

    def about_samples(self):
        """[samples] the greatest density of the cells that a sample has a share in."""
        return self.density[self.near].max(1)


def over_target(run, frames, resolution=128):
    """{frame: (the largest density over its target, share of the hair over 1.5 times its target)} at the frame's end. The
    target of a cell is the mean, over the hair in it, of the density that this hair had about it at rest."""
    rest = run.cache.rest_position.astype(float)
    cell = (rest.max(0) - rest.min(0)).max() / resolution
    allowed = np.maximum(LEAST, Lattice(run, rest, cell).about_samples())
    result = {}
    for frame in frames:
        now = Lattice(run, run.position(frame), cell)
        ratio = now.density**2 / now.spread(allowed)
        result[frame] = ratio.max(), now.density[ratio > 1.5].sum() / now.density.sum()
    return result


def volume(run, frame, size):
    """Of the cubes of side `size` that hair is in, on the axes of the head, which the roots tell."""
    rest, position = run.cache.rest_position.astype(float), run.position(frame)
    rotation, translation = rigid_motion(rest[run.roots], position[run.roots])
    places, _ = samples(run, (position - translation) @ rotation, size / 3)
    return len(np.unique(keys(np.floor(places / size)))) * size**3
