"""`servoid scan`, and `servoid model` of a video without poses."""

from pathlib import Path

import numpy as np
import pytest
from commands import Command
from rooms_to_scan import AIM, LENS, Room, around, draw, few_features, write_film, write_photos

from servoid.capture import open_capture
from servoid.pose import Pose

WALK = around(10, 60.0)


def test_the_command_says_how_sure_it_is(tmp_path: Path, servoid_command: Command) -> None:
    few = write_photos(tmp_path / "few", draw(Room(), WALK[:8:2]))
    done = servoid_command("scan", few, "--out", tmp_path / "out", "--threads", 1)
    assert done.code == 0, done.err
    assert "4 of 4 registered" in done.out
    assert "UNKNOWN: lengths are not in metres" in done.out
    page = (tmp_path / "out" / "report.html").read_text()
    assert '<span class="option">--length</span> in two images' in page  # no line ends within it
    assert "lengths are not in metres" in page and page.count("<figure") == 2 + 4
    assert not open_capture(tmp_path / "out").metric


def test_a_wrong_scale_is_a_wrong_option(tmp_path: Path, servoid_command: Command) -> None:
    done = servoid_command("scan", tmp_path, "--out", tmp_path / "out", "--length", "x")
    assert done.code == 2 and "is not a length" in done.err


@pytest.mark.parametrize(
    "marks",
    [
        ["0012:310,205,480,212=0.12"],
        ["0012:310,205,480,212=0.12", "0031:150,190,330,240=0.13"],
        ["0012:310,205,480,212=0.12", "0012:311,205,480,212=0.12"],
    ],
)
def test_a_length_that_is_marked_in_one_image_only_is_refused_before_any_image_is_read(
    tmp_path: Path, servoid_command: Command, marks: list[str]
) -> None:
    options = [word for mark in marks for word in ("--length", mark)]
    done = servoid_command("scan", tmp_path, "--out", tmp_path / "out", *options)
    assert done.code == 2
    assert "the length of 0.12 m is marked only in 0012" in done.err
    assert "in two images from different positions, with --length twice and the same m" in done.err
    assert ("0.13 m would be another length" in done.err) == ("0.13" in marks[-1])


@pytest.mark.extended
def test_a_film_and_a_click_give_a_body(
    tmp_path: Path, servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    few_features(monkeypatch)
    way = around(10, 50.0)
    film = write_film(tmp_path / "film.avi", draw(Room(seed=3), way))
    middle = LENS.project(Pose(way[0]).inverse().transform(np.array([[*AIM[:2], 0.06]])))[0]
    out = tmp_path / "body.json"
    u, v = middle
    box = f"box:{u - 45:.0f},{v - 55:.0f},{u + 45:.0f},{v + 50:.0f}"
    target = ("--target", box, "--trust-targets", "--max-ellipsoids", 3)
    done = servoid_command("model", film, "--out", out, *target)
    assert done.code == 0, done.err
    assert "total" in done.out and f"capture         {tmp_path / 'body_scan'}" in done.out
    assert "not in metres" in done.out
    assert out.is_file()


def test_a_film_without_a_target_is_refused_before_it_is_scanned(
    tmp_path: Path, servoid_command: Command
) -> None:
    film = write_film(tmp_path / "film.avi", draw(Room(), WALK[:3]))
    done = servoid_command("model", film, "--out", tmp_path / "body.json")
    assert done.code == 2 and "mark it in the first image" in done.err
    done = servoid_command(
        *("model", film, "--out", tmp_path / "body.json", "--target", "click:100,100@0009")
    )
    assert done.code == 2 and "0000 to 0002" in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["film.avi"]
