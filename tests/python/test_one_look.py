"""One look of a stereo pair, of a depth image, or of one instant of a recording."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from body_measures import WorldBody
from conftest import Command
from drawn_pairs import BASELINE, Pair

from servoid.model import ModelResult, Request, Surface, fit_capture, mark_everywhere
from servoid.observe import BoxTarget, open_capture
from servoid.shape import BodyFile, load_body

PLACES = ((0.012, -0.008, 0.42), (-0.05, 0.01, 0.46), (0.06, 0.02, 0.50))


@dataclass(frozen=True)
class Modelled:
    """What the command line made of a pair."""

    pair: Pair
    folder: Path
    file: BodyFile
    out: str


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    return Pair().write(tmp_path / "pair")


def model(servoid_command: Command, folder: Path, *options: object) -> Modelled:
    out = folder.parent / "body.json"
    ending = () if "--delta" in options else ("--max-ellipsoids", 2, "--delta", 0)
    outcome = servoid_command("model", folder, "--out", out, *options, *ending)
    assert outcome.code == 0, outcome.err
    return Modelled(Pair(), folder, load_body(out), outcome.out)


def left_centers(file: BodyFile) -> np.ndarray:
    return Pair().to_left(WorldBody.of(file).centers)


def fit_pair(folder: Path) -> ModelResult:
    return fit_capture(open_capture(folder), Request(max_ellipsoids=2, delta=0.0))


def errors_m(result: ModelResult, folder: Path, pair: Pair) -> np.ndarray:
    result.save(folder / "body.json")
    return WorldBody.of(load_body(folder / "body.json")).distances(pair.seen_points())


def test_a_pair_with_one_mask_gives_the_seen_surface_and_says_what_was_not_seen(
    pair: Path, servoid_command: Command
) -> None:
    found = model(servoid_command, pair)
    errors = WorldBody.of(found.file).distances(found.pair.seen_points())
    assert errors.mean() < 0.002
    assert np.quantile(errors, 0.98) < 0.004
    made_by, seen = found.file.made_by, found.file.seen
    assert made_by is not None
    assert made_by.seen_points > 1000
    assert made_by.views == ("left/0000", "right/0000")
    assert seen is not None
    assert 0.3 < seen.share < 0.65
    assert seen.unseen_toward is not None
    toward = WorldBody.of(found.file).world_from_object @ seen.unseen_toward
    assert toward @ found.pair.world_from_left[:3, 2] > 0.8
    text = " ".join(found.out.split())
    assert f"surface seen {100 * seen.share:.0f} %" in text
    assert f"{100 * (1 - seen.share):.0f} % of the surface was never seen" in text
    assert "is a guess" in text
    lines = [line for line in found.out.splitlines() if str(pair.parent) not in line]
    assert max(map(len, lines)) <= 80


def test_what_was_not_seen_is_said_although_it_lies_on_no_one_side() -> None:
    shares = np.array([0.4, 0.6])
    around = Surface(by_ellipsoid=shares, share=0.5, unseen_toward=None).note()
    assert around is not None
    assert around.startswith("50 % of the surface was never seen: parts of it on all sides")
    assert around.endswith("and so is 1 of the ellipsoids")
    assert Surface(by_ellipsoid=shares, share=0.9, unseen_toward=None).note() is None


@pytest.mark.parametrize(
    "poster", [(0.04, -0.06, 0.14, 0.04), (-0.02, -0.08, 0.25, 0.0), (-0.3, -0.05, 0.0, 0.03)]
)
def test_what_hangs_behind_the_object_in_its_color_is_neither_in_its_mask_nor_in_its_body(
    tmp_path: Path, poster: tuple[float, float, float, float]
) -> None:
    pair = Pair(poster=poster)
    folder = pair.write(tmp_path / "pair")
    result = fit_pair(folder)
    found = {view.camera_name: view.mask() != 0 for view in result.used_views}
    true = pair.draw(0, BASELINE)[2]
    assert (found["right"] & true).sum() / (found["right"] | true).sum() > 0.89
    result.save(folder / "body.json")
    away = left_centers(load_body(folder / "body.json")) - pair.centers[0]
    assert np.linalg.norm(away, axis=1).max() < 0.05
    assert errors_m(result, folder, pair).mean() < 0.003


def test_the_same_pair_gives_the_same_bytes_on_one_and_on_two_threads(
    pair: Path, servoid_command: Command
) -> None:
    texts = []
    for threads in (1, 2):
        model(servoid_command, pair, "--seed", 4, "--threads", threads)
        texts.append((pair.parent / "body.json").read_bytes())
    assert texts[0] == texts[1]


def test_a_box_does_for_a_pair_what_a_mask_does(tmp_path: Path) -> None:
    pair = Pair()
    folder = pair.write(tmp_path / "pair")
    capture = open_capture(folder)
    rows, columns = np.nonzero(pair.draw(0, 0.0)[2])
    corners = (columns.min() - 4, rows.min() - 4, columns.max() + 4, rows.max() + 4)
    box = BoxTarget(*map(float, corners), view="left/0000")
    result = fit_capture(capture, Request(max_ellipsoids=2, delta=0.0), targets=[box])
    assert result.targets == (str(box),)
    assert errors_m(result, folder, pair).mean() < 0.003


def test_depth_images_bring_a_flat_coloured_object_closer(tmp_path: Path) -> None:
    pair = Pair(patterned=False)
    without = pair.write(tmp_path / "without")
    with_depth = pair.write(tmp_path / "with", depths=True)
    blind, seeing = fit_pair(without), fit_pair(with_depth)
    assert len(seeing.sights) > 1000
    far, near = errors_m(blind, without, pair), errors_m(seeing, with_depth, pair)
    assert near.mean() < 0.002
    assert near.mean() < far.mean()


def test_one_depth_camera_finds_the_seen_side_as_a_pair_does(
    tmp_path: Path, servoid_command: Command
) -> None:
    folder = Pair().write(tmp_path / "alone", cameras=1, depths=True)
    found = model(servoid_command, folder)
    assert WorldBody.of(found.file).distances(found.pair.seen_points()).mean() < 0.002
    seen = found.file.seen
    assert seen is not None
    assert 0.2 < seen.share < 0.65
    assert seen.unseen_toward is not None
    toward = WorldBody.of(found.file).world_from_object @ seen.unseen_toward
    assert toward @ found.pair.world_from_left[:3, 2] > 0.7
    assert "was never seen" in " ".join(found.out.split())


def test_of_a_recording_only_the_instant_with_the_mask_is_used(
    tmp_path: Path, servoid_command: Command
) -> None:
    folder = Pair(PLACES).write(tmp_path / "pair", masked=(1, 2), rate_hz=10.0)
    for options, index in (((), 1), (("--observations", "2:"), 2)):
        found = model(servoid_command, folder, *options)
        made_by = found.file.made_by
        assert made_by is not None
        assert made_by.views == (f"left/{index:04}", f"right/{index:04}")
        distance = np.linalg.norm(left_centers(found.file) - PLACES[index], axis=1).min()
        assert distance < 0.02
    outcome = servoid_command(
        "model", folder, "--out", tmp_path / "no.json", "--observations", "0:1"
    )
    assert outcome.code == 1
    assert "--target" in outcome.err
    outcome = servoid_command(
        "model", folder, "--out", tmp_path / "no.json", "--observations", "7:"
    )
    assert outcome.code == 1
    assert re.search(r"holds none of the 3; choose among 0 to 2", outcome.err), outcome.err


def test_a_target_says_which_instant_of_a_recording_is_meant(tmp_path: Path) -> None:
    pair = Pair(PLACES)
    capture = open_capture(pair.write(tmp_path / "pair", masked=(0,), rate_hz=10.0))
    rows, columns = np.nonzero(pair.draw(2, 0.0)[2])
    corners = (columns.min() - 4, rows.min() - 4, columns.max() + 4, rows.max() + 4)
    box = BoxTarget(*map(float, corners), view="left/0002")
    result = fit_capture(capture, Request(max_ellipsoids=1), targets=[box])
    assert {view.index for view in result.used_views} == {2}


def test_the_papers_method_finds_where_a_coloured_ellipsoid_is(
    pair: Path, servoid_command: Command
) -> None:
    options = ("--method", "paper", "--max-ellipsoids", 1, "--delta", 0)
    found = model(servoid_command, pair, *options)
    assert found.file.made_by is not None
    assert found.file.made_by.method == "paper"
    assert "hue window" in found.out
    center = left_centers(found.file)[0]
    np.testing.assert_allclose(center[:2], PLACES[0][:2], rtol=0, atol=0.005)


def test_a_mask_in_one_image_leads_to_masks_in_all(pair: Path) -> None:
    views = {
        view.camera_name: view for view in mark_everywhere(open_capture(pair), Request(seed=1))
    }
    for name, offset in (("left", 0.0), ("right", BASELINE)):
        mask, true = views[name].mask() > 0, Pair().draw(0, offset)[2]
        assert (mask & true).sum() / (mask | true).sum() > 0.85
