"""Reads a strand cache (schemas/cache.md) for the Python tools and their tests: h5py and numpy only."""
import dataclasses
import pathlib
import re

import h5py
import numpy as np

FORMAT = "ringlet-cache"
FRAME_FILE = re.compile(r"^(?P<name>.+)\.(?P<frame>-?\d{4,})\.h5$")


class CacheError(Exception):
    """What is wrong with the input, with the file that it concerns."""


@dataclasses.dataclass
class Snapshot:
    """Strands and surfaces at one time, in the cache's units of length."""

    label: str
    position: np.ndarray  # [particles, 3]
    living: np.ndarray  # [strands] particles that are there; those beyond the tip lie on it
    surfaces: list  # of (vertices [n, 3], triangles [m, 3])


class StrandCache:
    """A run's cache: what is constant is read at once, the frames as they are asked for.

    offsets [strands + 1], width [particles] (diameter), rest_position [particles, 3], up ("x", "y", "z").
    """

    def __init__(self, path):
        """`path`: the cache's directory, its master, one of its frame files, or its NAME.failed.h5."""
        path = pathlib.Path(path)
        match = FRAME_FILE.match(path.name)
        self.asked_frame = int(match["frame"]) if match else None  # the frame whose file was named
        self.failed = path.name.endswith(".failed.h5")
        self.header = _header_file(path)
        self.directory = self.header.parent
        self.name = self.header.name.removesuffix(".h5").removesuffix(".failed")
        with _open(self.header, "master", "failed") as file:
            self.up = file.attrs["up"]
            strands = file["strands"]
            self.offsets = strands["offsets"][:]
            self.width = strands["width"][:]
            self.rest_position = strands["rest_position"][:]
            self._triangles = {name: surface["triangles"][:] for name, surface in file["surfaces"].items()}

    def frames(self):
        """Numbers of the frames on disk, sorted."""
        found = (FRAME_FILE.match(path.name) for path in self.directory.iterdir())
        return sorted(int(match["frame"]) for match in found if match and match["name"] == self.name)

    def frame(self, number):
        """The Snapshot of frame `number`."""
        path = self.directory / f"{self.name}.{number:0{5 if number < 0 else 4}d}.h5"
        if not path.exists():
            raise CacheError(f"{self.directory}: no frame {number} (there are: {_ranges(self.frames()) or 'none'})")
        with _open(path, "frame") as file:
            return self._snapshot(file, f"frame {number}", lambda field: field[:])

    def failed_state(self):
        """The Snapshot at which the run diverged, of a NAME.failed.h5."""
        with _open(self.header, "failed") as file:
            return self._snapshot(file, f"failed in frame {file['frames'][0]}", lambda field: field[0])

    def _snapshot(self, file, label, read):
        surfaces = file.get("surfaces", {})
        posed = [name for name in self._triangles if name in surfaces and "vertices" in surfaces[name]]
        meshes = [(read(surfaces[name]["vertices"]), self._triangles[name]) for name in posed]
        living = read(file["living"]) if "living" in file else np.diff(self.offsets)
        return Snapshot(label, read(file["position"]), living, meshes)


def _header_file(path):
    """The file that holds what is constant: the master, or a failed state itself."""
    if path.is_dir():
        masters = [file for file in sorted(path.glob("*.h5")) if _is_master(file)]
        if len(masters) != 1:
            raise CacheError(f"{path}: holds {len(masters) or 'no'} caches (name a cache's master file)")
        return masters[0]
    if not path.exists():
        raise CacheError(f"{path}: no such file or directory")
    match = FRAME_FILE.match(path.name)
    if not match:
        return path
    master = path.parent / f"{match['name']}.h5"
    if not master.exists():
        raise CacheError(f"{path}: its master {master.name} is not beside it")
    return master


def _is_master(path):
    other = path.name.endswith((".state.h5", ".failed.h5")) or FRAME_FILE.match(path.name)
    return not (path.name.startswith(".") or other)


def _open(path, *contents):
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise CacheError(f"{path}: not readable as HDF5: {error}") from error
    if file.attrs.get("format") != FORMAT or file.attrs.get("content") not in contents:
        file.close()
        raise CacheError(f"{path}: not a Ringlet cache's {' or '.join(contents)} file")
    return file


def _ranges(numbers):
    """[1, 2, 3, 7] as '1-3, 7'."""
    runs = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(f"{low}" if low == high else f"{low}-{high}" for low, high in runs)
