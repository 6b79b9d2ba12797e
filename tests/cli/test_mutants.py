"""tools/mutate: every mistake can still be made in the sources; that tests catch them takes too long for every day."""
import tomllib

from conftest import SOURCE, run

MUTANTS = tomllib.loads((SOURCE / "tools/mutants.toml").read_text())["mutant"]


def test_every_mutant_applies():
    result = run(SOURCE / "tools/mutate", "--check")
    assert result.returncode == 0, result.stderr
    assert result.stdout == f"{len(MUTANTS)} mutants apply\n"


def test_there_are_enough_of_them_and_each_has_a_name_of_its_own():
    assert len(MUTANTS) >= 20
    assert len({mutant["name"] for mutant in MUTANTS}) == len(MUTANTS)
    assert {path.parts[0] for path in map(SOURCE.__class__, (mutant["file"] for mutant in MUTANTS))} == {"kernels"}


def test_a_mutant_that_is_not_known_is_refused():
    result = run(SOURCE / "tools/mutate", "--list", "nothing")
    assert result.returncode == 2
    assert "no mutant nothing" in result.stderr
