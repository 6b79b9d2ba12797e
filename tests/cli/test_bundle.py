"""tools/bundle on the tree as built: what it makes runs alone, from wherever it is put."""
import shutil
import subprocess
import tarfile

import pytest

from conftest import run


@pytest.fixture(scope="module")
def bundle(source, program, tmp_path_factory):
    output = tmp_path_factory.mktemp("bundle")
    result = run(source / "tools/bundle", "--build", program.parent.parent, "-o", output)
    assert result.returncode == 0, result.stderr
    return output, result.stdout


def test_it_verified_itself(bundle):
    _, said = bundle
    assert "verified" in said


def test_tarball_runs_where_it_is_unpacked(bundle, source, tmp_path):
    output, _ = bundle
    (tarball,) = output.glob("ringlet-*.tar.gz")
    with tarfile.open(tarball) as archive:
        archive.extractall(tmp_path)
    (folder,) = tmp_path.glob("ringlet-*")
    assert {"bin", "lib", "schemas", "scenes", "LICENSE", "README.md"} <= {path.name for path in folder.iterdir()}
    listing = subprocess.run(["ldd", folder / "bin/ringlet"], capture_output=True, text=True, check=True).stdout
    system = ("/lib64/ld-linux", "libc.so", "libm.so", "linux-vdso", "libpthread", "libdl", "librt", "libresolv")
    for line in listing.splitlines():
        assert str(folder) in line or any(name in line for name in system), line
    shutil.copytree(folder, tmp_path / "moved")
    result = run(tmp_path / "moved/bin/ringlet", "validate", tmp_path / "moved/scenes/quickstart.json", env={})
    assert result.returncode == 0, result.stderr


def test_usage(source):
    assert run(source / "tools/bundle", "--nonsense", "x").returncode == 2
    assert run(source / "tools/bundle", "--build", "/nonexistent").returncode == 2
