import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import replays
from drawn import Drawn

from servoid import _native

SCRIPT = Path(replays.__file__)
OTHERS = [name for name in _native.backends() if name != _native.backend()]
VECTOR_CODE = np.show_config(mode="dicts").get("SIMD Extensions", {}).get("found", [])
ELSEWHERE = {
    "the vector code of an old processor": {
        "NPY_DISABLE_CPU_FEATURES": " ".join(VECTOR_CODE),
        "OPENBLAS_CORETYPE": "Nehalem",
        "OPENCV_CPU_DISABLE": "AVX2,FMA3",
        "OPENCV_FOR_THREADS_NUM": "1",
    },
    "the vector code of a processor with AVX2 only": {
        "OPENBLAS_CORETYPE": "Haswell",
        "OPENCV_IPP": "avx2",
    },
}
OLD, NEWER = ELSEWHERE
OLDEST = f"portable code and {OLD}"
ELSEWHERE[OLDEST] = ELSEWHERE[OLD] | {"SERVOID_BACKEND": "portable"}
RUN_ELSEWHERE = [
    *((OLD, name) for name in ("drawn/model", "drawn/track")),
    (OLDEST, "world/servo"),
    *((NEWER, name) for name in ("drawn/model", "stereo/teabox")),
]
LONG = [name for name in replays.RECORDED if (NEWER, name) not in RUN_ELSEWHERE]
PORTABLE = {"mono/dragon_red", "photos/blowtorch"}
DATA = "the recordings lie beside the repository, and not here"


def comparable(name: str) -> str:
    """Return the hash that a replay must have; skip the test where it need not have it."""
    hashes, with_versions = replays.read_table()
    here = replays.versions()
    for library in ("mujoco", "opencv") if name.startswith("world/") else ("opencv",):
        if here[library] != with_versions[library]:
            pytest.skip(
                f"the table is of {library} {with_versions[library]}, and here is {here[library]}"
            )
    if not replays.is_here(name):
        pytest.skip(DATA)
    return hashes[name]


def asked(names: list[str], shelf: Path | None, **environment: str) -> dict[str, str]:
    """Run replays in another process; return their hashes."""
    drawn = [] if shelf is None else ["--shelf", str(shelf)]
    done = subprocess.run(
        [sys.executable, str(SCRIPT), *drawn, *names],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return dict(line.split("\t") for line in done.stdout.splitlines())


def agree(name: str, found: str, wanted: str, where: str) -> None:
    assert found == wanted, (
        f"{name} has other bits with {where}: {found}, but the table has {wanted}; if numbers are "
        "meant to change, write it anew with `python tests/scenes/replays.py --write`"
    )


@pytest.fixture(scope="session")
def shelf(pytestconfig: pytest.Config) -> Path | None:
    cache = getattr(pytestconfig, "cache", None)
    return None if cache is None else cache.mkdir("drawn")


@pytest.mark.parametrize("name", replays.DRAWN)
def test_a_run_has_the_bits_that_it_always_had(name: str, drawn: Drawn) -> None:
    wanted = comparable(name)
    agree(name, replays.replayed(name, drawn), wanted, f"the backend {_native.backend()}")


@pytest.mark.extended
@pytest.mark.parametrize("backend", OTHERS)
def test_a_run_has_the_same_bits_with_every_back_end(backend: str, shelf: Path | None) -> None:
    wanted = {name: comparable(name) for name in replays.DRAWN if name != "world/servo"}
    found = asked(list(wanted), shelf, SERVOID_BACKEND=backend)
    for name, hash_ in wanted.items():
        agree(name, found[name], hash_, f"the backend {backend}")


@pytest.mark.extended
@pytest.mark.parametrize("name", LONG)
def test_a_long_run_has_the_bits_that_it_always_had(name: str) -> None:
    wanted = comparable(name)
    # Portable code is slow: one long run of each kind has it, and of the drawn ones all.
    backend = "portable" if name in PORTABLE else _native.backend()
    agree(name, asked([name], None, SERVOID_BACKEND=backend)[name], wanted, backend)


@pytest.mark.extended
@pytest.mark.parametrize(("where", "name"), RUN_ELSEWHERE)
def test_a_run_has_the_same_bits_on_other_processors(name: str, where: str) -> None:
    wanted = comparable(name)
    # Nothing is taken from the shelf: drawing has to give the same bits, too.
    agree(name, asked([name], None, **ELSEWHERE[where])[name], wanted, where)


def test_the_table_holds_every_replay_and_what_it_was_measured_with() -> None:
    hashes, with_versions = replays.read_table()
    assert set(hashes) == set(replays.REPLAYS)
    assert set(with_versions) == set(replays.versions())


def test_other_bits_are_told_with_the_place_and_the_cure() -> None:
    with pytest.raises(AssertionError, match=r"drawn/model .* backend portable: 1, .* 2; .*write"):
        agree("drawn/model", "1", "2", "the backend portable")
