"""The numbers on the studies' pages are those of the results that are kept beside the studies."""

import csv
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import pytest

from servoid.servo import settings_toml
from servoid_experiments.running import study_named

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "experiments" / "results"
PAGES = ROOT / "docs" / "studies"


@dataclass(frozen=True)
class Kept:
    """The tables of a study that are kept."""

    folder: Path

    def rows(self, table: str, **where: str) -> list[dict[str, str]]:
        """Return the rows of a table whose cells are as given."""
        with (self.folder / f"{table}.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        return [row for row in rows if all(row[name] == value for name, value in where.items())]

    def figure(self, table: str, column: str, **where: str) -> float:
        """Return the number in the one row whose cells are as given."""
        [row] = self.rows(table, **where)
        return float(row[column])


FEW = {"views": "views", "ellipsoids": "ellipsoids"}
SPOILT = {
    "outlines off by, px": "outlines off by",
    "wrong pixels, share": "wrong pixels in masks",
    "holes, share": "holes in masks",
    "cameras off by, mm": "cameras off by",
    "cameras turned off by, degrees": "cameras turned off by",
}
CLOSE = 0.02


def model_sentences(kept: Kept) -> Iterator[str]:
    """Yield what `model.md` says in numbers."""
    center = kept.figure("modelling", "volume_iou", factor="views", value="12", object="all")
    for label, factor in (FEW | SPOILT).items():
        pairs = [
            (row["value"], float(row["volume_iou"]))
            for row in kept.rows("modelling", factor=factor, object="all")
        ]
        ends = [f"{iou:.2f} with {value}" for value, iou in (pairs[0], pairs[-1])]
        close = [value for value, iou in pairs if iou >= center - CLOSE]
        own = {"views": "12", "ellipsoids": "5"}.get(factor, "0")
        yield (
            f"| {label} | {own} | {pairs[0][0]} to {pairs[-1][0]} | {center:.2f} | "
            + (f"{', '.join(ends)} | {close[0]} or more |" if factor in FEW.values() else "")
            + ("" if factor in FEW.values() else f"{pairs[-1][1]:.2f} | up to {close[-1]} |")
        )

    def iou(name: str, ellipsoids: str) -> str:
        where = {"factor": "ellipsoids", "value": ellipsoids, "object": name}
        return f"{kept.figure('modelling', 'volume_iou', **where):.2f}"

    yield f"goes from {iou('bird', '5')} with five to {iou('bird', '12')} with twelve"
    yield f"the bottle from {iou('bottle', '5')} to {iou('bottle', '12')}"
    turned = {"factor": "cameras turned off by", "value": "2", "object": "bottle"}
    yield f"still agree to {kept.figure('modelling', 'outline_iou', **turned):.2f}"
    bird = {"factor": "views", "value": "12", "series": "bird"}
    low, high = (kept.figure("volume", f"seeds_{end}", **bird) for end in ("low", "high"))
    seen = kept.figure("outline", "outline_iou", **bird)
    yield f"outlines are as good ({seen:.2f}) and whose volumes are not ({low:.2f} to {high:.2f})"

    def seconds(factor: str, value: str) -> str:
        where = {"factor": factor, "value": value, "object": "all"}
        return f"{kept.figure('modelling', 'seconds', **where):.2g}"

    views = [f"{seconds('views', value)}" for value in ("2", "12", "24")]
    yield "{} with 2 views, {} with 12, {} with 24".format(*views)
    counts = [f"{seconds('ellipsoids', value)}" for value in ("1", "5", "12")]
    yield "{} with one ellipsoid, {} with five, {} with twelve".format(*counts)


FORWARD, FIXED = "feed-forward, eyes follow", "feed-forward, fixed cameras"
LAG, FIXED_LAG = f"no {FORWARD}", f"no {FIXED}"


def response_rows(kept: Kept) -> Iterator[str]:
    """Yield the rows of the table of responses in `bode.md`."""

    def cells(signal: str, words: Callable[[dict[str, str]], str]) -> str:
        found = [
            kept.rows("response_figures", variant=variant, signal=signal, axis="sideways")
            for variant in (FORWARD, FIXED, LAG, FIXED_LAG)
        ]
        return " | ".join(words(row) for [row] in found)

    def spread(column: str, unit: str, form: str) -> Callable[[dict[str, str]], str]:
        def words(row: dict[str, str]) -> str:
            if float(row[column]) == float("inf"):
                return "above 2 Hz"
            middle, low, high = (
                f"{float(row[column + end]):{form}}" for end in ("", "_low", "_high")
            )
            return f"{middle}{unit} ({low} to {high})"

        return words

    def peak(row: dict[str, str]) -> str:
        hz = f"{float(row['greatest_gain_hz']):g}"
        return f"{float(row['greatest_gain']):.2f} at {hz} Hz"

    yield f"| hand: lag at 0.1 Hz | {cells('hand', spread('lag_deg', '°', '.1f'))} |"
    within = cells("hand", spread("within_3db_hz", " Hz", ".2f"))
    yield f"| hand: within 3 dB up to | {within} |"
    falls = cells("hand", spread("falls_by_3db_hz", " Hz", ".2f"))
    yield f"| hand: amplitude falls by 3 dB | {falls} |"
    yield f"| hand: greatest gain | {cells('hand', peak)} |"
    within = cells("gaze", lambda row: f"{float(row['within_3db_hz']):.2f} Hz")
    yield f"| gaze: within 3 dB up to | {within} |"
    yield f"| gaze: greatest gain | {cells('gaze', peak)} |"


def bode_sentences(kept: Kept) -> Iterator[str]:
    """Yield what `bode.md` says in numbers."""
    yield from response_rows(kept)
    for row in kept.rows("greatest_gains"):
        gains = [float(row[f"{rate} Hz"]) for rate in (10, 30, 60, 120)]
        words = [f"{gain:.{1 if gain < 10 else 0}f}" for gain in gains]
        yield f"| {row['latency_ms']} ms | {' | '.join(words)} |"

    def edge(loop: str, latency_s: str, rate_hz: str, quantity: str = "delay") -> float:
        where = {"latency_s": latency_s, "rate_hz": rate_hz, "sought": quantity}
        return kept.figure("margins", "edge", loop=loop, **where)

    following, still = "servoid, eyes follow", "servoid, fixed eyes"
    yield f"stamps may be wrong by {1e3 * edge(following, '0.04', '30'):.0f} ms"
    yield f"with fixed cameras by {1e3 * edge(still, '0.04', '30'):.0f} ms"
    bare = "neither feed-forward nor prediction, eyes follow"
    delays = [1e3 * float(row["edge"]) for row in kept.rows("margins", loop=bare)]
    yield f"Without feed-forward and prediction it is {min(delays):.0f} to {max(delays):.0f} ms"
    far = f"{edge(following, '0.2', '120', 'gain'):.0f} times with 200 ms and 120 Hz"
    yield f"could be {edge(following, '0', '10', 'gain'):.0f} times as high without latency"
    yield far
    low = min(float(row["limited_share_low"]) for row in kept.rows("response_limits"))
    high = max(float(row["limited_share_high"]) for row in kept.rows("response_limits"))
    yield f"In {100 * low:.0f} to {100 * high:.0f} % of the control periods"
    off = [abs(float(row["ratio"]) - 1.0) for row in kept.rows("response_halved")]
    yield f"by {100 * median(off):.0f} % as a median over frequencies"
    yield f"and by {100 * max(off):.0f} % at most"


SENTENCES: dict[str, Callable[[Kept], Iterator[str]]] = {
    "bode": bode_sentences,
    "model": model_sentences,
}


def missing(name: str, text: str) -> list[str]:
    """Return what a page should say by the results that are kept, and does not."""
    return [one for one in SENTENCES[name](Kept(RESULTS / name)) if one not in text]


def test_all_results_that_are_kept_are_compared_with_a_page() -> None:
    assert {folder.name for folder in RESULTS.iterdir()} == set(SENTENCES)


@pytest.mark.parametrize("name", SENTENCES)
def test_the_numbers_on_a_page_are_those_of_the_results(name: str) -> None:
    assert missing(name, (PAGES / f"{name}.md").read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("name", SENTENCES)
def test_a_number_that_drifts_is_found(name: str) -> None:
    text = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    spoilt = re.sub(r"\d(?!\w)", lambda match: str((int(match[0]) + 1) % 10), text)
    assert len(missing(name, spoilt)) == len(list(SENTENCES[name](Kept(RESULTS / name))))


@pytest.mark.parametrize("name", SENTENCES)
def test_the_results_that_are_kept_are_those_of_the_whole_study(name: str) -> None:
    settings = (RESULTS / name / "study.toml").read_text(encoding="utf-8")
    assert settings == settings_toml(study_named(name).settings())


@pytest.mark.parametrize("name", SENTENCES)
def test_a_page_says_how_many_trials_there_were(name: str) -> None:
    study = study_named(name)
    trials = sum(len(work.cases) for work in study.plan(study.settings()))
    assert f"Of {trials} trials with" in (PAGES / f"{name}.md").read_text(encoding="utf-8")
