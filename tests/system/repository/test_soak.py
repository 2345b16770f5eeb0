"""A soak finds what it looks for, and a short one finds nothing."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))

from fuzz.soak import servoing, tracking  # noqa: E402
from fuzz.soak.camera_faults import KINDS, CameraFaults, Taken  # noqa: E402
from fuzz.soak.health import Health  # noqa: E402
from servoid.pose import Pose  # noqa: E402
from servoid.sim import Scenario  # noqa: E402


@pytest.mark.parametrize(("grows_mib", "status"), [(0.0, 0), (20.0, 1)])
def test_memory_that_grows_is_found(grows_mib: float, status: int) -> None:
    random, health = np.random.default_rng(0), Health()
    health.memory = [
        (1000 * index, 400.0 + 100.0 * (index % 7 == 3) + grows_mib * index + random.uniform(-5, 5))
        for index in range(60)
    ]
    assert health.end() == status


def estimate(place: float, **other: object) -> SimpleNamespace:
    usual = {"status": "tracking", "confidence": 0.9, "covariance": np.eye(6), "notices": ["a"]}
    pose = Pose.from_parts((place, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))
    return SimpleNamespace(**(usual | {"world_from_object": pose} | other))


@pytest.mark.parametrize(
    ("estimates", "dark", "words"),
    [
        ([estimate(0.0), estimate(0.0)], False, []),
        ([estimate(0.1), estimate(0.0), estimate(0.1)], False, []),
        ([estimate(0.1), estimate(0.1)], False, ["2 images in a row were wrong"]),
        ([estimate(0.1, status="searching")] * 3, False, []),
        ([estimate(0.0)], True, ["tracking is said of no image"]),
        ([estimate(0.0, confidence=np.nan)], False, ["the confidence is nan"]),
        ([estimate(0.0, covariance=np.full((6, 6), np.nan))], False, ["has NaN", "is negative"]),
    ],
)
def test_what_is_wrong_and_trusted_or_insane_is_found(
    estimates: list[SimpleNamespace], dark: bool, words: list[str]
) -> None:
    health, truth = Health(), Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))
    judge = tracking._Judge(health, np.zeros((3, 3)), Pose.identity())
    for one in estimates:
        judge.see(one, truth, "none", dark)
    judge.end()
    assert len(health.faults) == len(words)
    assert all(part in found for part, found in zip(words, health.faults, strict=True))


def test_every_fault_strikes_and_none_changes_the_images_that_it_was_given() -> None:
    random = np.random.default_rng(0)
    whole = tuple(random.integers(0, 256, (240, 320, 3), np.uint8) for _ in range(2))
    kept = tuple(image.copy() for image in whole)
    faults, seen = CameraFaults(random, 2), {}
    for index in range(6000):
        leaps = faults.leaps()
        taken = faults.strike(index / 30.0, whole)
        assert leaps == (faults.kind == "leap")
        seen.setdefault(faults.kind, taken)
    assert set(seen) == set(KINDS)
    assert all((one == two).all() for one, two in zip(whole, kept, strict=True))
    assert struck(seen["dark"]) == [(240, 320, 3)] * 2
    assert seen["none"].images == whole


def struck(taken: Taken) -> list[tuple[int, ...]]:
    return [np.shape(image) for image in taken.images]  # pyright: ignore[reportArgumentType]


def test_no_object_leaps_while_images_are_frozen() -> None:
    for seed in range(300):
        faults = servoing._faults(np.random.default_rng(seed), 12.0)
        for leap in (one for one in faults if one["type"] == "teleport"):
            for freeze in (one for one in faults if one["type"] == "freeze"):
                assert not 0.0 <= leap["at_s"] - freeze["at_s"] <= freeze["seconds"]


@pytest.mark.extended
def test_a_short_soak_finds_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tracking, "SCENES", (Scenario(count=24, size="small"),))
    health = Health()
    tracking.soak_tracking(np.random.default_rng(0), 400, tmp_path, health)
    servoing.soak_servoing(np.random.default_rng(0), tmp_path, health, seconds=12.0)
    assert health.faults == []
    assert (health.images, health.runs) == (400, 1)
    assert health.servoed >= health.counts["servoing tracking"] > 0
    assert health.servoed_s == pytest.approx(12.0, abs=0.1)


def test_an_object_that_leapt_leaps_back() -> None:
    for seed in range(300):
        faults = servoing._faults(np.random.default_rng(seed), 60.0)
        leaps = [one for one in faults if one["type"] == "teleport"]
        leaps.sort(key=lambda one: one["at_s"])
        moved = np.cumsum([one["by"] for one in leaps], axis=0)
        assert np.allclose(moved[1::2], 0.0)
