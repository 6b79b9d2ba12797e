"""tools/install-packages without root: it says what to run and touches nothing."""
import os
import shutil
import subprocess
import tempfile
import time

import pytest

NOBODY = 65534


@pytest.fixture
def clone(source):
    """A folder that everybody may read, with the script in it and a `bin` to put first on PATH."""
    folder = tempfile.mkdtemp(prefix="ringlet-install-")
    os.chmod(folder, 0o755)
    os.makedirs(f"{folder}/bin")
    shutil.copytree(source / "tools", f"{folder}/tools", ignore=shutil.ignore_patterns("__pycache__"))
    yield folder
    shutil.rmtree(folder)


def write_command(clone, name, script):
    path = f"{clone}/bin/{name}"
    with open(path, "w", encoding="ascii") as file:
        file.write(f"#!/bin/bash\n{script}\n")
    os.chmod(path, 0o755)


def install(clone, path):
    unprivileged = [shutil.which("setpriv"), f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]
    command = [*(unprivileged if os.geteuid() == 0 else []), f"{clone}/tools/install-packages"]
    return subprocess.run(
        command, env={"PATH": path}, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=False
    )


def test_without_root_it_prints_the_one_line(clone):
    write_command(clone, "sudo", "exit 1")
    missing = "libassimp-dev|ninja-build"
    write_command(clone, "dpkg-query", f'[[ "${{@: -1}}" =~ ^({missing})$ ]] && exit 1; echo -n installed')
    result = install(clone, f"{clone}/bin:/usr/bin:/bin")
    assert result.returncode == 2
    lines = result.stdout.splitlines()
    expected = "apt-get install -y --no-install-recommends ninja-build libassimp-dev"
    assert lines == [f"sudo apt-get update && sudo {expected}"]
    assert result.stderr.startswith("error: packages are missing")
    assert not os.path.exists(f"{clone}/.venv")


def test_another_system_is_told_what_is_supported(clone):
    os.symlink(shutil.which("dirname"), f"{clone}/bin/dirname")
    result = install(clone, f"{clone}/bin")
    assert result.returncode == 2
    assert "Debian 12 and Ubuntu 24.04" in result.stderr


def test_with_everything_there_it_is_quick_and_silent(clone):
    write_command(clone, "dpkg-query", "echo -n installed")
    os.makedirs(f"{clone}/.venv/bin")
    os.symlink("/usr/bin/python3", f"{clone}/.venv/bin/python")
    stamp = '"$(/usr/bin/python3 --version) $(sha256sum tools/requirements.txt)"'
    subprocess.run(["bash", "-c", f"echo {stamp} > .venv/installed"], cwd=clone, check=True)
    started = time.monotonic()
    result = install(clone, f"{clone}/bin:/usr/bin:/bin")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    assert time.monotonic() - started < 10
