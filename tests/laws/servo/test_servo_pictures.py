"""What a person sees of a servo run: a table, a video, plots and a report."""

import base64
import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from fake_tracker import FakeEstimate
from numpy.typing import NDArray

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from servo_run import SMALL, Run, bottle_body

from servoid.camera import Camera
from servoid.errors import OutputError
from servoid.pose import Pose
from servoid.record import ServoOverlay, ServoScene, ServoVideo, write_servo_log
from servoid.record.lettering import width_px, write_into
from servoid.record.overlay import STATUS_COLORS
from servoid.servo import (
    Command,
    Reason,
    ServoLog,
    ServoMetrics,
    ServoSettings,
    Tick,
    holds,
    settings_toml,
    verdict_of,
)
from servoid.shape import Body
from servoid.source import Instant
from servoid.view import ServoPictures, draw_servo_plots, write_servo_report
from servoid.view.servo.servo_plots import gaze_panels, hand_panels, joint_panels

SECONDS = 0.9
NO_BREAK = "\N{NO-BREAK SPACE}"
PLOTS = ["hand.png", "joints.png", "gaze.png"]
CAMERA = Camera(size_px=(160, 120), focal_px=(170.0, 170.0), center_px=(79.5, 59.5))
AHEAD = Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))
GRAY = np.full((120, 160, 3), 120, np.uint8)
LONGEST = sorted(Reason, key=lambda reason: len(reason.value))[-3:]


class NotFinite:
    """A pose that another tracker than ours may report."""

    def matrix(self) -> NDArray[np.float64]:
        return np.full((4, 4), np.nan)


@dataclass
class Shown:
    """A run, and the files that show it."""

    log: ServoLog
    folder: Path
    size_px: tuple[int, int]
    plots: list[Path]
    overview: NDArray[np.uint8]


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shown]:
    folder = tmp_path_factory.mktemp("run")
    run = Run(cameras=SMALL)
    overview = run.world.overview((120, 90), samples=1)
    video = ServoVideo(
        folder / "servo.mp4", run.world.cameras, run.world.camera_names, 30.0, overview_px=(120, 90)
    )

    def watch(tick: Tick, body: Body) -> None:
        if tick.instant is not None:
            seen = (tick.instant, tick.estimate, tick.command)
            video.add(*seen, overview, "servoing", body=body)

    with video:
        log = run.run(SECONDS, watch)
    write_servo_log(log, folder / "log.csv")
    plots = draw_servo_plots(log, folder, settle_s=0.3)
    yield Shown(log, folder, video.size_px, plots, overview)


def frames(path: Path) -> list[NDArray[np.uint8]]:
    video, found = cv2.VideoCapture(str(path)), []
    while True:
        more, image = video.read()
        if not more:
            return found
        found.append(np.asarray(image, np.uint8))


def scene(
    status: str = "tracking",
    confidence: float = 0.75,
    command: Command | None = None,
    line: str = "servoing",
    image: NDArray[np.uint8] | None = GRAY,
) -> ServoScene:
    instant = Instant(0, 1.25, (Pose.identity(),) * 2, (image, GRAY))
    estimate = FakeEstimate(1.25, AHEAD, status, confidence)
    return ServoScene(instant, estimate, command, line, bottle_body())


def overlay() -> ServoOverlay:
    return ServoOverlay([CAMERA] * 2, ["left", "right"])


def test_a_video_has_a_picture_of_each_observation_and_words_below_it(shown: Shown) -> None:
    found = frames(shown.folder / "servo.mp4")
    assert len(found) == len(shown.log.seen) > 20
    assert found[0].shape == (*shown.size_px[::-1], 3)
    assert shown.size_px[0] == 1280 and shown.size_px[1] % 2 == 0
    for image in found:
        band = image[-78:].astype(int)
        for left, right in ((190, 390), (400, 1000), (1150, 1270)):
            assert (band[:39, left:right].max(axis=2) > 120).sum() > 40
        assert (band[39:, 16:390].max(axis=2) > 120).sum() > 40
        assert image[:-80].std() > 10.0


def test_the_band_of_a_lost_target_is_red_and_says_what_holds_the_hand(shown: Shown) -> None:
    lost = next(
        place
        for place, (_, seen) in enumerate(shown.log.seen)
        if seen.estimate is not None and seen.estimate.status == "lost"
    )
    strip = frames(shown.folder / "servo.mp4")[lost][-79].mean(axis=0)[::-1]
    assert np.abs(strip - STATUS_COLORS["lost"]).max() < 30


@pytest.mark.parametrize("status", STATUS_COLORS)
@pytest.mark.parametrize("confidence", [0.0, 0.4, 1.0, np.nan])
def test_the_bar_is_as_long_as_the_confidence_and_has_the_colour_of_the_status(
    status: str, confidence: float
) -> None:
    page = overlay().draw(scene(status, confidence))
    top = overlay().size_px[1] - 80
    row = page[top + 3 + 19, 16:176]
    filled = (row == STATUS_COLORS[status]).all(axis=1)
    assert filled.sum() == round(160 * np.nan_to_num(confidence))
    assert filled[: filled.sum()].all()


def test_the_body_is_drawn_where_the_estimate_says_and_a_cross_in_the_middle() -> None:
    bare = replace(scene(), body=None)
    changed = (overlay().draw(scene()) != overlay().draw(bare)).any(axis=2)[:480, :640]
    rows, columns = np.nonzero(changed)
    # The bottle reaches 0.12 m up and 0.105 m down, and 4 pixels of the page are one.
    assert np.ptp(rows) == pytest.approx(4.0 * 170.0 * (0.105 + 0.12) / 0.5, rel=0.08)
    assert abs(columns.min() + columns.max() - 639) > 40  # the x axis reaches beyond the bottle
    page = overlay().draw(bare)
    middle = page[230:250, 310:330]
    assert (middle != 120).any() and (page[100:140, 100:140] == 120).all()


@pytest.mark.parametrize("image", [None, GRAY[..., 0], GRAY], ids=["none", "grey", "colour"])
@pytest.mark.parametrize("pose", [AHEAD, Pose.identity(), AHEAD.inverse()])
def test_any_observation_can_be_drawn_and_no_image_is_changed(
    image: NDArray[np.uint8] | None, pose: Pose
) -> None:
    before = None if image is None else image.copy()
    one = scene(image=image)
    moved = FakeEstimate(1.25, pose)
    page = overlay().draw(replace(one, estimate=moved))
    assert page.shape == (*overlay().size_px[::-1], 3)
    assert before is None or image is None or np.array_equal(before, image)
    assert overlay().draw(replace(one, estimate=None, body=None)).shape == page.shape


def test_a_body_without_a_finite_pose_is_not_drawn() -> None:
    page = overlay().draw(replace(scene(), estimate=FakeEstimate(1.25, NotFinite())))  # type: ignore
    bare = overlay().draw(replace(scene(confidence=0.9), body=None))
    assert np.array_equal(page, bare)


@pytest.mark.parametrize("words", ["", "servoing", "looking " * 60, "x" * 400])
@pytest.mark.parametrize("room_px", [60, 300, 860])
def test_words_never_leave_their_box(words: str, room_px: int) -> None:
    page = np.zeros((120, 1000, 3), np.uint8)
    write_into(page, (40, 40, room_px, 38), words, (255, 255, 255), size=0.6)
    rows, columns = np.nonzero(page.max(axis=2))
    if not words:
        assert not len(rows)
        return
    assert rows.min() >= 38 and rows.max() < 40 + 38 + 2
    assert columns.min() >= 38 and columns.max() < 40 + room_px + 2


def test_the_sentences_of_three_reasons_are_written_in_full() -> None:
    command = Command(np.zeros(2), np.zeros(6), holding=frozenset(LONGEST))
    texts: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        write = cv2.putText
        patch.setattr(cv2, "putText", lambda *given: (texts.append(given[1]), write(*given))[1])
        overlay().draw(scene(command=command))
    joined = " ".join(texts)
    assert all(reason.value in joined for reason in LONGEST)
    assert "..." not in joined


def test_wider_words_are_wider() -> None:
    assert width_px("arm", 0.5) < width_px("arm and eyes", 0.5) < width_px("arm and eyes", 0.6)


def test_an_overview_stays_until_the_next() -> None:
    drawing = ServoOverlay([CAMERA] * 2, ["left", "right"], (160, 120))
    assert drawing.size_px == (1280, 720) and drawing.overview_px is not None
    red = np.zeros((120, 160, 3), np.uint8)
    red[:] = (200, 30, 30)
    first = drawing.draw(replace(scene(), overview=red))
    assert (first[: drawing.overview_px[1], : drawing.overview_px[0]] == (200, 30, 30)).all()
    assert np.array_equal(first, drawing.draw(scene()))


def test_a_video_that_fails_leaves_nothing_and_takes_no_more(tmp_path: Path) -> None:
    video = ServoVideo(tmp_path / "a.mp4", [CAMERA] * 2, ["left", "right"], 30.0)
    one = scene()
    given = (one.instant, one.estimate, None, None, "servoing")
    with pytest.raises(ZeroDivisionError), video:
        video.add(*given)
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OutputError, match="inside the video's with block"):
        video.add(*given)


def test_the_table_reads_back_with_a_line_for_each_tick(shown: Shown) -> None:
    with (shown.folder / "log.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    log = shown.log
    assert len(rows) == len(log)
    for number in (0, 40, len(log) - 1):
        row, tick = rows[number], log.rows[number].tick
        assert float(row["time_s"]) == pytest.approx(tick.state.time_s, abs=1e-6)
        for place, name in enumerate(log.names):
            assert float(row[f"q_{name}"]) == pytest.approx(tick.state.positions[place], abs=1e-7)
            assert float(row[f"command_{name}"]) == pytest.approx(
                tick.command.velocities[place], abs=1e-7
            )
        pose = [float(row[f"hand_{part}"]) for part in ("tx", "ty", "tz")]
        assert pose == pytest.approx(log.rows[number].world_from_hand.translation, abs=1e-7)
    seen = [row for row in rows if row["image"]]
    assert len(seen) == len(log.seen)
    assert {row["status"] for row in seen} == {"tracking", "lost"}
    assert any("lost" in row["holding"] for row in rows)
    assert all(
        None not in row and None not in row.values() for row in rows
    )  # as wide as the header


def test_the_columns_of_the_table_are_those_of_the_documentation(shown: Shown) -> None:
    text = (Path(__file__).parents[3] / "docs" / "formats.md").read_text(encoding="utf-8")
    section = text.split("## The log of a servo run", 1)[1].split("\n## ", 1)[0]
    keys = [
        name.replace("JOINT", joint).replace("CAMERA", camera)
        for cell in re.findall(r"^\| (`.+?) \|", section, re.MULTILINE)
        for name in _expanded(re.findall(r"`([^`]+)`", cell))
        for joint in (shown.log.names if "JOINT" in name else ("",))
        for camera in (shown.log.cameras if "CAMERA" in name else ("",))
    ]
    with (shown.folder / "log.csv").open(newline="") as file:
        header = next(csv.reader(file))
    assert sorted(keys) == sorted(header)


def _expanded(names: list[str]) -> list[str]:
    """Write out poses, whose columns the documentation sums up with a star."""
    parts = ("w", "x", "y", "z", "tx", "ty", "tz")
    return [name.replace("*", part) for name in names for part in (parts if "*" in name else ("",))]


def test_the_plots_are_three_pictures_that_are_not_blank(shown: Shown) -> None:
    assert [path.name for path in shown.plots] == PLOTS
    for path in shown.plots:
        image = cv2.imread(str(path))
        assert image is not None and min(image.shape[:2]) > 500
        assert image.std() > 10.0


def test_the_plots_show_what_the_log_says(shown: Shown) -> None:
    log = shown.log
    moved, apart, *_ = hand_panels(log, 0.3)
    target = next(line for line in moved.lines if line.name == "target y").values
    assert target[0] == 0.0
    assert np.abs(target[-1]) == pytest.approx(150 - 150 * np.cos(0.2 * np.pi * SECONDS), rel=0.02)
    assert apart.lines[0].values == pytest.approx(1e3 * log.hand_errors[:, 0])
    angles, speeds, *_ = joint_panels(log)
    assert len(angles.lines) == len(speeds.lines) == 7
    assert len({line.style for line in angles.lines}) == 7  # told apart without colour, too
    assert {line.style for line in moved.lines[:3]} == {"band"}  # seen below a hand that is there
    assert [line.name for line in gaze_panels(log, 0.3)[-1].lines[3:]] == [
        "tilt",
        "left pan",
        "right pan",
    ]


def test_a_log_that_says_nothing_can_be_drawn(tmp_path: Path) -> None:
    for path in draw_servo_plots(ServoLog(("a", "b")), tmp_path):
        assert path.stat().st_size > 1000
    page = write_servo_report(tmp_path, ServoLog(("a", "b")), {}, ServoPictures())
    text = page.read_text(encoding="utf-8")
    assert "Why the hand was held" not in text
    assert "Servoing: unknown: the errors of the hand are unknown: servoing did not begin." in text


def test_a_report_holds_everything_and_asks_for_nothing_from_elsewhere(shown: Shown) -> None:
    path = write_servo_report(
        shown.folder,
        shown.log,
        {"hand position error": "1.2 mm", "<fixation>": "3 px"},
        ServoPictures(shown.overview, shown.plots),
        title="A bottle & an arm",
        settings=settings_toml(ServoSettings()),
        notes=["Seed 7."],
    )
    text = path.read_text(encoding="utf-8")
    assert path == shown.folder / "report.html"
    assert re.findall(r"https?://|[\"']//|url\(|@import|<script|<link|fetch\(", text) == []
    assert "{{" not in text
    assert re.findall(r"<th(?! scope=)(?!ead)", text) == []
    assert '<span class="value">1.2 mm</span>' in text
    assert '<th scope="row">limited by</th>' in text
    sources = re.findall(r'src="data:image/(\w+);base64,([^"]+)"', text)
    assert [kind for kind, _ in sources] == ["jpeg", "png", "png", "png"]
    inside = [base64.b64decode(data) for _, data in sources[1:]]
    assert inside == [plot.read_bytes() for plot in shown.plots]
    for words in (
        "A bottle &amp; an arm",
        "Seed 7.",
        "1.2 mm",
        "&lt;fixation&gt;",
        "least_confidence = 0.8",
    ):
        assert words in text
    for hold in holds(shown.log):
        assert f"{hold.start_s:.2f} s" in text and f"{hold.end_s:.2f} s" in text
        assert all(reason.value in text for reason in hold.reasons)


@pytest.mark.parametrize("ending", [None, "interrupted after 0.9 of 5 s of servoing"])
def test_a_report_begins_with_its_verdict_and_what_is_not_good(
    shown: Shown, tmp_path: Path, ending: str | None
) -> None:
    verdict = verdict_of(shown.log, ServoMetrics.of(shown.log, 0.3), ending)
    page = write_servo_report(tmp_path, shown.log, {}, ServoPictures(), settle_s=0.3, ending=ending)
    text = page.read_text(encoding="utf-8").replace(NO_BREAK, " ")
    first = re.search(r'<p class="verdict">(.*)</p>', text)
    assert first is not None
    assert first[1].startswith(f"Servoing: {verdict.word}")
    assert all(reason in first[1] for reason in verdict.reasons)
    assert (ending is None) == ("interrupted" not in first[1])


@pytest.mark.parametrize("settle_s", [0.3, 0.6])
def test_a_report_has_the_repeatability_of_its_table_below_its_verdict(
    shown: Shown, tmp_path: Path, settle_s: float
) -> None:
    metrics = ServoMetrics.of(shown.log, settle_s)
    page = write_servo_report(tmp_path, shown.log, {}, ServoPictures(), settle_s=settle_s)
    text = page.read_text(encoding="utf-8")
    assert f"both after {settle_s:g}{NO_BREAK}s of servoing" in text
    text = text.replace(NO_BREAK, " ")
    verdict = re.search(
        r'<p class="verdict">Repeatability ([\d.]+) mm RMS, ([\d.]+) mm at 95 %; '
        rf"accuracy not known; both after {settle_s:g} s",
        text,
    )
    assert verdict is not None
    expected = [1e3 * metrics.position_rms, 1e3 * metrics.position_95]
    assert [float(one) for one in verdict.groups()] == pytest.approx(expected, abs=0.006)


@pytest.mark.extended
def test_nothing_is_written_where_nothing_can_be_written(shown: Shown, tmp_path: Path) -> None:
    none = tmp_path / "none"
    with pytest.raises(OutputError, match="cannot write"):
        write_servo_log(shown.log, none / "log.csv")
    with pytest.raises(OutputError, match="cannot write"):
        draw_servo_plots(ServoLog(("a",)), none)
    with pytest.raises(OutputError, match="cannot write"):
        write_servo_report(none, shown.log, {}, ServoPictures())
    with pytest.raises(OutputError, match="cannot write"):
        ServoVideo(none / "a.mp4", [CAMERA], ["left"], 30.0)
    with pytest.raises(OutputError, match=r"cannot put .*gone.png into the report"):
        write_servo_report(tmp_path, shown.log, {}, ServoPictures(files=[none / "gone.png"]))
    assert list(tmp_path.iterdir()) == []
