"""Forked children model and track as their parents do: the parents' threads stay behind."""

from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.queues import Queue
from typing import TypeVar

import pytest
from fake_tracker import plain_body
from faults import Moments
from recordings import Alone

from servoid._native import Estimate, silhouette_ious
from servoid.camera import Camera
from servoid.capture import View
from servoid.pose import Pose

PATIENCE_S = 30.0

T = TypeVar("T")


def in_a_child(work: Callable[[], T]) -> T:
    """Return what work returns in a forked child, which is killed if it hangs."""
    context = get_context("fork")
    answers: Queue[T] = context.Queue()
    child = context.Process(target=lambda: answers.put(work()))
    child.start()
    try:
        return answers.get(timeout=PATIENCE_S)
    finally:
        child.kill()
        child.join()


@pytest.fixture
def views() -> list[View]:
    camera, body = Camera.from_fov((160, 120), 60.0), plain_body()
    turns = [Pose.from_euler("y", [angle]) for angle in (0.0, 0.7, 1.4)]
    poses = [turn @ Pose.from_parts([0.0, 0.0, -0.6], [1.0, 0.0, 0.0, 0.0]) for turn in turns]
    masks = [body.silhouette(camera, pose) for pose in poses]
    return [
        View(camera=camera, world_from_camera=pose, mask=mask)
        for pose, mask in zip(poses, masks, strict=True)
    ]


def test_a_forked_child_scores_outlines_as_its_parent_did(views: list[View]) -> None:
    scored = silhouette_ious(plain_body(), views).tolist()
    assert in_a_child(lambda: silhouette_ious(plain_body(), views).tolist()) == scored


def test_a_forked_child_evolves_the_body_that_its_parent_began_to_evolve(alone: Alone) -> None:
    moments = alone.recording.moments()
    tracker = alone.tracker_in(alone.recording, moments[0])

    def follow(some: Moments) -> list[Estimate]:
        return [tracker.step(one.time_s, one.world_from_camera, one.images) for one in some]

    follow(moments[1:12])
    assert tracker.begin_evolving()
    in_child, here = in_a_child(lambda: follow(moments[12:20])), follow(moments[12:20])
    assert in_child == here
    assert any(one.evolved for one in here)
