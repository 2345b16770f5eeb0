from pathlib import Path

import numpy as np
import pytest
from drawn_pairs import Pair
from scenes_looks import (
    alone_figures,
    left_only,
    look_from_twice,
    look_with_one_eye,
    twice_figures,
)

from conftest import Command
from servoid.capture import open_capture
from servoid.errors import ModelError
from servoid.model import Request, fit_capture
from servoid.model.one_view import half_thickness_px


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Pair().write(tmp_path_factory.mktemp("one") / "pair")


def test_a_disc_swells_to_a_ball_and_a_bar_to_a_rod() -> None:
    rows, columns = np.mgrid[:101, :301]
    disc = np.hypot(rows - 50, columns - 60) <= 30
    bar = (np.abs(rows - 50) <= 10) & (columns > 120) & (columns < 290)
    reach = half_thickness_px((disc | bar).astype(np.uint8))
    ball = np.sqrt(np.maximum(30.5**2 - (rows - 50) ** 2 - (columns - 60) ** 2, 0.0))
    near = np.hypot(rows - 50, columns - 60) <= 26
    assert np.abs(reach - ball)[near].max() < 3.0
    assert reach[50, 150:260] == pytest.approx(11.0, abs=0.6)
    assert (reach[~(disc | bar)] == 0.0).all()


@pytest.mark.parametrize(
    ("distance_m", "is_doubted"), [(0.42, False), (42.0, True), (0.0042, True)]
)
def test_a_distance_that_makes_an_object_absurdly_large_or_small_is_doubted(
    pair: Path, distance_m: float, is_doubted: bool
) -> None:
    made = fit_capture(left_only(pair), Request(max_ellipsoids=1, delta=0.0), distance_m=distance_m)
    told = [
        doubt for doubt in made.all_doubts if "m away as was given, and so it is up to" in doubt
    ]
    assert bool(told) == is_doubted
    assert not is_doubted or made.verdict.word != "good"


def test_one_image_at_a_known_distance_gives_a_body_there_of_the_right_size(pair: Path) -> None:
    result = fit_capture(left_only(pair), distance_m=0.42)
    assert look_with_one_eye.beyond(alone_figures(result)) == []
    assert any("one image shows no depth" in note for note in result.all_notes)


@pytest.mark.extended
def test_twice_the_distance_makes_the_body_twice_as_large(pair: Path) -> None:
    assert look_from_twice.beyond(twice_figures(pair)) == []


def test_a_distance_is_asked_for_where_it_is_needed_and_refused_elsewhere(pair: Path) -> None:
    with pytest.raises(ModelError, match=r"at least two views .* such as --distance 0\.6"):
        fit_capture(left_only(pair))
    with pytest.raises(ModelError, match="leave the distance out"):
        fit_capture(open_capture(pair), distance_m=0.4)
    for distance_m in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ModelError, match="give a positive number of metres"):
            fit_capture(left_only(pair), distance_m=distance_m)


@pytest.mark.parametrize("more", [("--method", "paper")])
def test_the_paper_s_method_takes_no_distance(
    pair: Path, tmp_path: Path, servoid_command: Command, more: tuple[str, ...]
) -> None:
    out = tmp_path / "body.json"
    outcome = servoid_command("model", pair, "--out", out, "--distance", 0.5, *more)
    assert outcome.code == 2
    assert "--distance does not apply to the paper's method" in outcome.err
