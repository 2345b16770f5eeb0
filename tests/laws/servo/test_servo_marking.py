"""How the object is marked in the first image of a run."""

import re

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from servoid.errors import ServoError, TargetError
from servoid.servo.exploration import Masks, first_look
from servoid.sim.trial.marking import marker
from servoid.sim.trial.settings import RunSettings
from servoid.sim.world import CameraSettings, ObjectSettings, World, WorldSettings


def marked(target: str, *, ideal: bool = False, seed: int = 0) -> tuple[World, Masks]:
    """Mark the bottle in a world, by a target."""
    world = World(
        WorldSettings(
            background="plain",
            cameras=CameraSettings(size_px=(320, 240), samples=1, moments=1),
            object=ObjectSettings(name="bottle"),
            ideal=ideal,
            seed=seed,
        )
    )
    mark = marker(world, RunSettings(target=target, trust_target=True))
    return world, mark(first_look(world.arm, world.source))


def shared(mask: np.ndarray | None, true: np.ndarray) -> float:
    assert mask is not None
    one, other = mask > 0, true > 0
    return float((one & other).sum() / (one | other).sum())


def test_in_an_ideal_world_a_hand_draws_the_object_as_it_is() -> None:
    world, masks = marked("hand", ideal=True)
    assert masks[1] is None
    assert shared(masks[0], world.masks()[0]) == 1.0


@pytest.mark.parametrize(("target", "least"), [("hand", 0.88), ("box", 0.8), ("click", 0.8)])
def test_what_a_person_marks_is_about_the_object(target: str, least: float) -> None:
    world, masks = marked(target, seed=2)
    assert masks[1] is None
    assert least < shared(masks[0], world.masks()[0]) < 1.0


def test_a_target_as_of_the_tracker_may_name_the_camera() -> None:
    world, masks = marked("box:100,10,220,230@right", ideal=True)
    assert masks[0] is None
    assert shared(masks[1], world.masks()[1]) > 0.8


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("boxes", "the target 'boxes' has no known form; write mask:FILE, box:"),
        ("box:1,2,3", "the target 'box:1,2,3' needs 4 numbers with ','"),
        ("box:30,20,10,40", "left < right and top < bottom"),
        ("click:here", "the target 'click:here' needs 2 numbers"),
    ],
)
def test_a_target_that_is_none_is_refused_before_anything_moves(target: str, message: str) -> None:
    with pytest.raises(ServoError, match=r"^run\.target: .*choose one of hand, box, click") as one:
        RunSettings(target=target)
    assert re.search(re.escape(message), str(one.value))


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("click:10,10@eye", "meant for the view 'eye', but the cameras are left, right"),
        ("click:1000,10", "the click lies outside the image, which has u from 0 to 319"),
        ("box:0,0,400,400", "the box covers the whole image"),
        ("mask:none.png", "none.png"),
    ],
)
def test_a_target_that_finds_nothing_is_refused_in_words(target: str, message: str) -> None:
    with pytest.raises((TargetError, ServoError, ValueError), match=re.escape(message)):
        marked(target)
