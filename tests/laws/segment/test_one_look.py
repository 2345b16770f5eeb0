"""One look of a stereo pair, of a depth image, or of one instant of a recording."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from body_measures import WorldBody
from drawn_pairs import Pair
from scene_table import Scene
from scenes_looks import (
    BEFORE_POSTER,
    box_around,
    errors_m,
    fit_in_box,
    fit_pair,
    look_at_pair,
    look_by_depth_camera,
    look_by_paper,
    look_in_box,
    look_with_depth,
    marked_figures,
    marks_all,
    paper_figures,
    saved,
    seen_figures,
)
from tiers import tiered

from conftest import Command
from servoid.capture import open_capture
from servoid.model import Coverage, Request, fit_capture
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


def test_a_pair_with_one_mask_gives_the_seen_surface_and_says_what_was_not_seen(
    pair: Path, servoid_command: Command
) -> None:
    found = model(servoid_command, pair)
    assert look_at_pair.beyond(seen_figures(found.file, found.pair)) == []
    made_by, seen = found.file.made_by, found.file.seen
    assert made_by is not None
    assert made_by.seen_points > 1000
    assert made_by.views == ("left/0000", "right/0000")
    assert seen is not None
    text = " ".join(found.out.split())
    assert f"surface seen {100 * seen.share:.0f} %" in text
    assert f"{100 * (1 - seen.share):.0f} % of the surface was never seen" in text
    assert "is a guess" in text
    lines = [line for line in found.out.splitlines() if str(pair.parent) not in line]
    assert max(map(len, lines)) <= 80


def test_what_was_not_seen_is_said_although_it_lies_on_no_one_side() -> None:
    shares = np.array([0.4, 0.6])
    around = Coverage(by_ellipsoid=shares, share=0.5, unseen_toward=None).note()
    assert around is not None
    assert around.startswith("50 % of the surface was never seen: parts of it on all sides")
    assert around.endswith("and so is 1 of the ellipsoids")
    assert Coverage(by_ellipsoid=shares, share=0.9, unseen_toward=None).note() is None


@pytest.mark.parametrize("one", tiered([(one,) for one in BEFORE_POSTER]))
def test_what_hangs_behind_the_object_in_its_color_is_neither_in_its_mask_nor_in_its_body(
    one: Scene,
) -> None:
    assert one.broken(0) == []


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
    result = fit_in_box(pair, folder)
    assert result.targets == (str(box_around(pair.draw(0, 0.0)[2], "left/0000")),)
    off = errors_m(saved(result, folder), pair).mean()
    assert look_in_box.beyond({"surface off": 1e3 * float(off)}) == []


@pytest.mark.extended
def test_depth_images_bring_a_flat_coloured_object_closer(tmp_path: Path) -> None:
    folder = Pair(patterned=False).write(tmp_path / "with", depths=True)
    assert len(fit_pair(folder).range_samples) > 1000
    assert look_with_depth.broken(0) == []


def test_one_depth_camera_finds_the_seen_side_as_a_pair_does(
    tmp_path: Path, servoid_command: Command
) -> None:
    folder = Pair().write(tmp_path / "alone", cameras=1, depths=True)
    found = model(servoid_command, folder)
    assert look_by_depth_camera.beyond(seen_figures(found.file, found.pair)) == []
    assert "was never seen" in " ".join(found.out.split())


@pytest.mark.extended
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
    assert re.search(r"selects none of the 3; choose among 0 to 2", outcome.err), outcome.err


@pytest.mark.extended
def test_a_target_says_which_instant_of_a_recording_is_meant(tmp_path: Path) -> None:
    pair = Pair(PLACES)
    capture = open_capture(pair.write(tmp_path / "pair", masked=(0,), rate_hz=10.0))
    box = box_around(pair.draw(2, 0.0)[2], "left/0002")
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
    assert look_by_paper.beyond(paper_figures(found.file)) == []


def test_a_mask_in_one_image_leads_to_masks_in_all(pair: Path) -> None:
    assert marks_all.beyond(marked_figures(pair, 1)) == []
