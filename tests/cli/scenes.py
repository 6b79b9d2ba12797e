"""Running a scene through the program with changed values."""
import json

import conftest


def run(program, scene, out, *options):
    """`ringlet run`; output and exit code are the test's to judge."""
    return conftest.run(program, "run", scene, "-o", out, "--progress", "none", *options)


def setting(pointer, value):
    """The options that give a scene another value."""
    return ["--set", f"{pointer}={json.dumps(value)}"]
