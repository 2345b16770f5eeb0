import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from servoid.errors import BodyError
from servoid.pose import Pose
from servoid.shape import (
    Body,
    MadeBy,
    SeenEntry,
    body_schema,
    load_body,
    published_schema,
    save_body,
    write_body_file,
)

MADE_BY = MadeBy(
    servoid="0.1.0",
    seed=3,
    max_ellipsoids=6,
    delta=0.002,
    views=("eye/0000",),
    method="paper",
    targets=("hue:200..260",),
    seen_points=12,
)


def seen_of(body: Body) -> SeenEntry:
    share = (0.25,) * len(body)
    return SeenEntry(share=0.25, unseen_toward=(0.0, 0.6, -0.8), by_ellipsoid=share)


@st.composite
def bodies(draw: st.DrawFn) -> tuple[Body, np.ndarray]:
    """Draw a body of up to five ellipsoids, from micrometres to kilometres, and its colours."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    count = draw(st.integers(1, 5))
    scale = 10.0 ** draw(st.floats(-6, 3))
    turns = Rotation.random(count + 1, rng=random).as_quat()[:, [3, 0, 1, 2]]
    body = Body(
        world_from_object=Pose.from_parts((scale * random.normal(size=3)).tolist(), turns[-1]),
        centers=scale * random.normal(size=(count, 3)),
        radii=scale * random.uniform(0.01, 1.0, (count, 3)),
        rotations=turns[:-1],
    )
    return body, random.integers(0, 256, (count, 3), dtype=np.uint8)


def one_ball() -> Body:
    return Body(
        world_from_object=Pose.from_parts([0.1, 0.2, 0.3], [1, 0, 0, 0]),
        centers=np.zeros((1, 3)),
        radii=np.full((1, 3), 0.05),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )


@given(drawn=bodies())
def test_a_body_comes_back_from_its_file_and_fits_the_published_schema(
    drawn: tuple[Body, np.ndarray], tmp_path_factory: pytest.TempPathFactory
) -> None:
    body, colors = drawn
    path = tmp_path_factory.mktemp("body") / "body.json"
    save_body(path, body, colors, fitness=0.9, made_by=MADE_BY, seen=seen_of(body))
    jsonschema.validate(json.loads(path.read_text()), json.loads(published_schema()))
    file = load_body(path)
    again = file.body()
    np.testing.assert_array_equal(again.centers, body.centers)
    np.testing.assert_array_equal(again.radii, body.radii)
    np.testing.assert_allclose(again.rotations, body.rotations, rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        again.world_from_object.matrix(), body.world_from_object.matrix(), rtol=1e-14, atol=1e-15
    )
    np.testing.assert_array_equal(file.colors(), colors)
    assert (file.fitness, file.made_by, file.seen) == (0.9, MADE_BY, seen_of(body))


@given(drawn=bodies())
def test_the_same_body_gives_the_same_bytes(
    drawn: tuple[Body, np.ndarray], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("body")
    first, second, third = (folder / f"{name}.json" for name in ("first", "second", "third"))
    save_body(first, *drawn)
    save_body(second, *drawn)
    write_body_file(third, load_body(first))
    assert first.read_bytes() == second.read_bytes() == third.read_bytes()


def test_a_body_file_is_laid_out_for_people(tmp_path: Path) -> None:
    save_body(tmp_path / "body.json", one_ball(), np.array([[255, 0, 10]], np.uint8))
    assert (tmp_path / "body.json").read_text() == (
        "{\n"
        '  "version": 1,\n'
        '  "units": "m",\n'
        '  "world_from_object": [0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0],\n'
        '  "ellipsoids": [\n'
        "    {\n"
        '      "center": [0.0, 0.0, 0.0],\n'
        '      "radii": [0.05, 0.05, 0.05],\n'
        '      "rotation": [1.0, 0.0, 0.0, 0.0],\n'
        '      "color": [255, 0, 10]\n'
        "    }\n"
        "  ],\n"
        '  "fitness": null,\n'
        '  "made_by": null,\n'
        '  "seen": null,\n'
        '  "appearance": null\n'
        "}\n"
    )


def test_a_body_without_colors_says_so(tmp_path: Path) -> None:
    save_body(tmp_path / "body.json", one_ball())
    assert load_body(tmp_path / "body.json").colors() is None


def test_colors_must_be_as_many_as_ellipsoids(tmp_path: Path) -> None:
    with pytest.raises(BodyError, match=r"needs colors of shape \(1, 3\), not \(2, 3\)"):
        save_body(tmp_path / "body.json", one_ball(), np.zeros((2, 3), np.uint8))
    assert not any(tmp_path.iterdir())


def test_the_published_schema_is_what_the_types_say() -> None:
    assert json.loads(published_schema()) == body_schema()
    jsonschema.Draft202012Validator.check_schema(body_schema())


def first(data: dict[str, Any]) -> dict[str, Any]:
    return data["ellipsoids"][0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda data: data.update(version=2),
            "'version' is 2; this servoid reads bodies of version 1",
        ),
        (lambda data: data.pop("version"), "the key 'version' is missing"),
        (lambda data: data.update(units="mm"), "units is 'mm'; give lengths in metres"),
        (lambda data: data.update(colour=1), "unknown key 'colour'; known keys: version, units"),
        (
            lambda data: first(data).update(radius=1),
            r"ellipsoids\[0\]: unknown key 'radius'; known keys: center, radii, rotation, color",
        ),
        (lambda data: first(data).pop("radii"), r"ellipsoids\[0\]: the key 'radii' is missing"),
        (lambda data: first(data).update(radii=[1, 0, 1]), r"ellipsoids\[0\].radii.* above 0"),
        (lambda data: first(data).update(radii=[1, 1]), r"ellipsoids\[0\].radii.*length 3"),
        (lambda data: first(data).update(rotation=[1, 1, 0, 0]), r"length 1\.41421; it must be 1"),
        (
            lambda data: first(data).update(color=[0, 0, 256]),
            r"ellipsoids\[0\].color.* of 255 or less",
        ),
        (lambda data: data.update(world_from_object=[0] * 7), "has length 0; it must be 1"),
        (lambda data: data.update(ellipsoids=[]), "ellipsoids.*length 1 or more"),
        (lambda data: data.update(fitness=5), "fitness: expected a number of 1 or less, got 5"),
        (lambda data: data.update(fitness=-3), "fitness: expected a number of -1 or more, got -3"),
        (lambda data: data["seen"].update(share=2), "seen.share: .*of 1 or less, got 2"),
        (
            lambda data: data["seen"].update(by_ellipsoid=[0.5, 0.2]),
            "seen.by_ellipsoid has 2 numbers, but the body has 1 ellipsoid; give one number for",
        ),
        (
            lambda data: data["seen"].update(unseen_toward=[0, 0, 0]),
            r"seen.unseen_toward: the vector \(x, y, z\) has length 0; it must be 1",
        ),
        (lambda data: data.update(ellipsoids=None), "ellipsoids"),
    ],
)
def test_a_wrong_body_file_is_refused_and_the_message_says_where(
    change: Any, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "body.json"
    save_body(path, one_ball(), seen=SeenEntry(share=0.5, by_ellipsoid=(0.5,)))
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    with pytest.raises(BodyError, match=message) as caught:
        load_body(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("key", ["units", "radii"])
def test_a_key_that_a_body_file_has_twice_is_refused(key: str, tmp_path: Path) -> None:
    path = tmp_path / "body.json"
    save_body(path, one_ball())
    path.write_text(path.read_text().replace(f'"{key}":', f'"{key}": null, "{key}":'))
    with pytest.raises(BodyError, match=rf"body\.json: the key '{key}' is given twice in"):
        load_body(path)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999", '"0.05"', "null"])
def test_a_radius_that_is_no_finite_number_is_refused(number: str, tmp_path: Path) -> None:
    path = tmp_path / "body.json"
    save_body(path, one_ball())
    path.write_text(path.read_text().replace("[0.05,", f"[{number},"))
    with pytest.raises(BodyError, match=r"body\.json"):
        load_body(path)


def test_a_missing_body_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(BodyError, match=r"cannot read .*none\.json: no such file"):
        load_body(tmp_path / "none.json")
    with pytest.raises(BodyError, match="expected a table"):
        (tmp_path / "list.json").write_text('[{"version": 1}]')
        load_body(tmp_path / "list.json")
