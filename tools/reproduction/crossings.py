"""Which strands went through which, from the frames' positions alone.

Between two frames every particle is taken to go straight. Two segments go through one another where, on the way, the
four ends come into one plane and the segments cut each other there. The way may be another than that in the run, but
where it begins and ends is not: strands that lie on different sides of each other afterwards have gone through, or
round an end, which is not counted.
"""
import numpy as np

PARTS = 4  # of a frame's way, each searched for one passage of a pair
HALVINGS = 30


def cross(a, b):
    """np.cross for [n, 3], several times as fast."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def dot(a, b):
    return np.einsum("ij,ij->i", a, b)


class Pairs:
    """Pairs of moving segments: `ends` [4, pairs, 3] before (a, a's end, b, b's end), `way` how far they go."""

    def __init__(self, ends, way):
        self.ends, self.way = ends, way

    def __getitem__(self, chosen):
        return Pairs(self.ends[:, chosen], self.way[:, chosen])

    def at(self, time):
        return self.ends + time[:, None] * self.way

    def volume(self, time):
        """[pairs] six times that of the four ends; its sign tells on which side of a the segment b passes."""
        a, a_end, b, b_end = self.at(time)
        return dot(cross(a_end - a, b_end - b), b - a)

    def cut(self, time):
        """[pairs] whether segments that lie in one plane cut each other."""
        a, a_end, b, b_end = self.at(time)
        normal = cross(a_end - a, b_end - b)
        square = np.maximum(dot(normal, normal), 1e-300)
        along_a = dot(cross(b - a, b_end - b), normal) / square
        along_b = dot(cross(b - a, a_end - a), normal) / square
        return (along_a >= 0) & (along_a < 1) & (along_b >= 0) & (along_b < 1)


def passages(pairs):
    """[pairs] how often b goes through a: +1 for each time to the side of positive volume, -1 back."""
    count = len(pairs.ends[0])
    found = np.zeros(count, int)
    before = pairs.volume(np.zeros(count))
    for part in range(PARTS):
        low = np.full(count, part / PARTS)
        after = pairs.volume(low + 1 / PARTS)
        changed = np.flatnonzero((before > 0) != (after > 0))
        if len(changed):
            side, some = before[changed] > 0, pairs[changed]
            low, high = low[changed], low[changed] + 1 / PARTS
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                same = (some.volume(middle) > 0) == side
                low, high = np.where(same, middle, low), np.where(same, high, middle)
            found[changed] += np.where(some.cut(high), np.where(side, -1, 1), 0)
        before = after
    return found


def boxes(start, end):
    """Lowest and highest corners of the boxes that segments (starts and ends [n, 3] before and after) sweep."""
    corners = np.stack([start[:-1], start[1:], end[:-1], end[1:]])
    return corners.min(0), corners.max(0)


def meeting(low_a, high_a, low_b, high_b, block=512):
    """Indices (a, b) of boxes that meet."""
    near_a = np.flatnonzero(((low_a <= high_b.max(0)) & (high_a >= low_b.min(0))).all(1))
    near_b = np.flatnonzero(((low_b <= high_a.max(0)) & (high_b >= low_a.min(0))).all(1))
    found = [(near_a[:0], near_b[:0])]
    for first in range(0, len(near_a), block):
        a = near_a[first : first + block]
        meet = np.ones((len(a), len(near_b)), bool)
        for axis in range(3):
            meet &= low_a[a, None, axis] <= high_b[None, near_b, axis]
            meet &= high_a[a, None, axis] >= low_b[None, near_b, axis]
        i, j = np.nonzero(meet)
        found.append((a[i], near_b[j]))
    return tuple(np.concatenate(each) for each in zip(*found))


def went_through(run, first, second):
    """How many pairs of a strand of groom `first` and one of groom `second` went through each other. By frame: `net`,
    pairs that are on another side than in the first frame; `ever`, pairs that went through at any time so far."""
    particles = [np.flatnonzero(np.isin(run.strand, np.flatnonzero(run.groom == groom))) for groom in (first, second)]
    strands = [run.strand[each] for each in particles]
    inner = [each[:-1] == each[1:] for each in strands]  # segments, not gaps between strands
    sums, ever, result = {}, set(), {"net": {}, "ever": {}}
    positions = [run.position(run.frames[0])[each] for each in particles]
    for frame in run.frames:
        before, positions = positions, [run.position(frame)[each] for each in particles]
        swept = [boxes(p, q) for p, q in zip(before, positions)]
        index = [np.flatnonzero(each) for each in inner]
        low_high = [side[each] for box, each in zip(swept, index) for side in box]
        a, b = meeting(*low_high)
        a, b = index[0][a], index[1][b]
        start = np.stack([before[0][a], before[0][a + 1], before[1][b], before[1][b + 1]])
        end = np.stack([positions[0][a], positions[0][a + 1], positions[1][b], positions[1][b + 1]])
        found = passages(Pairs(start, end - start))
        for hit in np.flatnonzero(found):
            pair = int(strands[0][a[hit]]), int(strands[1][b[hit]])
            sums[pair] = sums.get(pair, 0) + int(found[hit])
            ever.add(pair)
        result["net"][frame] = sum(value != 0 for value in sums.values())
        result["ever"][frame] = len(ever)
    return result
