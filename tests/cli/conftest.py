"""Shared by the command line's tests: the program, the tools, a small cache made without the program."""
import os
import pathlib
import subprocess
import sys

import pytest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tools"))

from small_cache import write_small_cache  # noqa: E402


def run(*command, **options):
    """Runs a command to its end; its output and exit code are the test's to judge."""
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=300, **options)


@pytest.fixture(scope="session")
def source():
    """The repository's root."""
    return SOURCE


@pytest.fixture(scope="session")
def program():
    """The program under test: RINGLET_PROGRAM, or that of the release build."""
    path = pathlib.Path(os.environ.get("RINGLET_PROGRAM", SOURCE / "build/release/bin/ringlet"))
    if not path.exists():
        pytest.skip(f"{path.name} is not built")
    return path


@pytest.fixture(scope="session")
def small_cache(tmp_path_factory):
    """Directory of a cache called `ball`: 300 curly strands on a ball, frames 1 to 3."""
    directory = tmp_path_factory.mktemp("ball")
    write_small_cache(directory)
    return directory
