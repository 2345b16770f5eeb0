"""Images of several streams of a device, joined by their stamps."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from servoid.source.devices.pairing import Pairing

EYES = ("left", "right")
PERIOD_S = 1.0 / 30.0
APART_S = 0.4 * PERIOD_S


def joined(pairing: Pairing, images: list[tuple[str, int]]) -> list[dict[str, int]]:
    found = []
    for stream, number in images:
        found += [one.images for one in pairing.add(stream, PERIOD_S * number, number)]
    return found


@given(st.integers(0, 2**32))
def test_every_moment_that_is_whole_comes_once_in_order_whatever_the_order_of_images(
    seed: int,
) -> None:
    generator = np.random.default_rng(seed)
    images = [(eye, number) for number in range(40) for eye in EYES]
    # An image comes up to three moments late.
    order = np.argsort([number + generator.uniform(0.0, 3.0) for _, number in images])
    found = joined(Pairing(EYES, apart_s=APART_S), [images[at] for at in order])
    numbers = [one["left"] for one in found]
    assert all(one["left"] == one["right"] for one in found)
    assert numbers == sorted(set(numbers))


def test_images_that_come_in_turn_lose_no_moment() -> None:
    images = [(eye, number) for number in range(40) for eye in EYES]
    assert [one["left"] for one in joined(Pairing(EYES, apart_s=APART_S), images)] == list(
        range(40)
    )
    late = [("left", 0)]
    for number in range(1, 40):
        late += [("left", number), ("right", number - 1)]
    assert [one["left"] for one in joined(Pairing(EYES, apart_s=APART_S), late)] == list(range(39))


def test_an_image_without_a_partner_is_counted() -> None:
    pairing = Pairing(EYES, apart_s=APART_S)
    images = [
        (eye, number) for number in range(10) for eye in EYES if (eye, number) != ("right", 4)
    ]
    assert [one["left"] for one in joined(pairing, images)] == [0, 1, 2, 3, 5, 6, 7, 8, 9]
    assert pairing.alone() == ("1 image of left had no partner of the same moment",)
    assert pairing.alone() == ()


def test_an_eye_that_falls_silent_keeps_few_images_waiting() -> None:
    pairing = Pairing(EYES, apart_s=APART_S)
    assert joined(pairing, [("left", number) for number in range(100)]) == []
    assert len(pairing._waiting) < 10
    assert pairing.alone()[0].startswith("9")


def test_depth_that_is_late_is_waited_for_until_the_next_pair_is_whole() -> None:
    pairing = Pairing(EYES, ("depth",), apart_s=APART_S)
    assert joined(pairing, [("left", 0), ("right", 0)]) == []
    assert joined(pairing, [("depth", 0)]) == [{"left": 0, "right": 0, "depth": 0}]
    assert joined(pairing, [("left", 1), ("right", 1), ("left", 2)]) == []
    assert joined(pairing, [("right", 2)]) == [{"left": 1, "right": 1}]
    assert joined(pairing, [("depth", 2)]) == [{"left": 2, "right": 2, "depth": 2}]


def test_stamps_of_a_device_that_was_restarted_are_taken_anew() -> None:
    pairing = Pairing(EYES, apart_s=APART_S)
    images = [(eye, number) for number in (300, 301, 0, 1, 2) for eye in EYES]
    assert [one["left"] for one in joined(pairing, images)] == [300, 301, 0, 1, 2]
