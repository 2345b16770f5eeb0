"""What the paper's servoing experiment came to, in words, tables and pictures."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from servoid_experiments.design import Results
from servoid_experiments.findings import Finding, Section, Verdict
from servoid_experiments.paper.intervals import Interval
from servoid_experiments.paper.servoing import FAST, OTHER, READINGS, SLOW, ServoingSettings
from servoid_experiments.paper.servoing_cures import cure_section
from servoid_experiments.paper.servoing_followed import Followed
from servoid_experiments.paper.servoing_future import future_sections
from servoid_experiments.paper.servoing_plots import Column, draw_courses
from servoid_experiments.paper.servoing_rows import failures, over, period, response_table, rows_of
from servoid_experiments.paper.servoing_settings import Place
from servoid_experiments.paper.servoing_trial import SERVOING, ServoingRow

_SHARED = 0.25  # of x's variance that goes with z, from which on z spoils x
_UNSTEADY = 1.2  # times as wide counts as wider
_RECOGNISED_M = 0.03  # farther off, an object of this size counts as missed


@dataclass(frozen=True)
class _Motion:
    """The runs of the paper's method at one speed, and the period in words."""

    period: str
    rows: Sequence[ServoingRow]

    def mean(self, take: Callable[[Followed], float]) -> Interval:
        """Return the mean of a figure over the runs."""
        return over(self.rows, take)


def servoing_sections(settings: ServoingSettings, results: Results, folder: Path) -> list[Section]:
    """Tell of the paper's experiment, of what cures it, and of the future work that it names.

    Pictures go into the folder, which must exist.

    Raises:
        OutputError: a picture cannot be written.

    """
    sections = []
    if rows_of(results, SLOW) and rows_of(results, FAST):
        sections.append(_paper_section(settings, results, folder))
        sections.append(cure_section(settings, results, folder))
    return sections + future_sections(settings, results, folder)


def _paper_section(settings: ServoingSettings, results: Results, folder: Path) -> Section:
    slow, fast = (
        _Motion(period(omega), rows_of(results, name))
        for omega, name in zip(settings.omegas, (SLOW, FAST), strict=True)
    )
    columns = [
        Column(f"{one.period}, the paper's method", one.rows[0].followed.courses)
        for one in (slow, fast)
    ]
    picture = draw_courses(
        columns,
        folder / "servoing.png",
        "Figs. 10 and 11 of the paper, one run each: place of the object, of what was recognised "
        "and of the hand, along the axes of M0, the object's frame at its start (x to the right, "
        "y down, z away from the hand). The hand is counted from where it should be at the start. "
        "y and z have a scale of their own.",
    )
    readings = [one.name for one in READINGS]
    names = [name for name in (SLOW, FAST, OTHER, *readings) if rows_of(results, name)]
    return Section(
        heading="Section 5.3, Figs. 10 and 11: servoing to one ellipsoid",
        words=_words(settings, results, slow, fast),
        findings=(
            _follows(slow, fast),
            _recognises(slow),
            _unsteady(slow, fast, results),
            _spoils(slow, fast),
        ),
        pictures=(picture,),
        tables=(response_table(results, names, "The paper's method; means over runs, 95 %."),),
    )


def _words(
    settings: ServoingSettings, results: Results, slow: _Motion, fast: _Motion
) -> tuple[str, ...]:
    scene, search = settings.constants.scene, settings.constants.search
    latency_s = settings.constants.eyes.latency_s
    ages = [math.degrees(omega * latency_s) for omega in settings.omegas]
    held = max(row.held_share for row in (*slow.rows, *fast.rows))
    long, wide = sorted({2e3 * radius for radius in scene.radii}, reverse=True)[:2]
    words = [
        f"An ellipsoid of {long:g} and {wide:g} mm swings {2e3 * scene.amplitude:g} mm wide along "
        "x before the hand. Its orientation is given; x, y and z are the genes of a population of "
        f"{search.population} that breeds {_counted(search.generations, 'generation')} an image. "
        "Estimates are used as they come: no filter, no prediction, no feed-forward.",
        "The population lives in the hand's frame, in which the paper's equation 9 has the object; "
        "of time stamps it does not speak, so that the object is taken to be before the hand now "
        "as it was seen before the hand. The table names other readings. Not as in the paper: "
        "colours are a posterior that is learnt at the start, where the paper has a window of "
        "hues, and the start and the ellipsoid are the true ones, where the paper has what it "
        "modelled.",
        "Recognition is measured against the truth at the moment of the exposure, whatever the "
        "hand takes it for. The hand has "
        f"its result {1e3 * latency_s:g} ms later, which is {ages[0]:.1f} degrees of phase of the "
        f"slow and {ages[1]:.1f} of the fast motion.",
    ]
    if other := rows_of(results, OTHER):
        lags = [over(rows, lambda row: row.hand_lag_deg) for rows in (other, fast.rows)]
        text = scene.place is Place.TEXT
        words.append(
            "The paper contradicts itself about the start: its matrix puts the object beside "
            f"where its text wants it. Here the {'text' if text else 'matrix'} holds; with the "
            f"{'matrix' if text else 'text'} the hand lags {lags[0].written(1)} degrees instead of "
            f"{lags[1].written(1)}."
        )
    if held > 0.0:
        words.append(f"The hand was held for up to {100.0 * held:.0f} % of a run.")
    return (*words, *failures(results.get(SERVOING.name, ())))


def _counted(count: int, what: str) -> str:
    return f"one {what}" if count == 1 else f"{count} {what}s"


def _follows(slow: _Motion, fast: _Motion) -> Finding:
    lags = [one.mean(lambda row: row.hand_lag_deg) for one in (slow, fast)]
    gains = [one.mean(lambda row: row.hand_gain) for one in (slow, fast)]
    late = lags[0].mean > 0.0 and lags[1].mean > lags[0].mean
    return Finding(
        before="The hand follows the object with a phase lag at either speed.",
        ours=f"It lags {lags[0].written(1)} degrees at {slow.period} and {lags[1].written(1)} "
        f"degrees at {fast.period}, with {gains[0].written(3)} and {gains[1].written(3)} of the "
        "amplitude.",
        verdict=Verdict.AGREES if late else Verdict.DIFFERS,
        why="A proportional law without feed-forward needs an error to move at all: the lag is "
        "about the frequency over the sum of its gains, and the age of the images adds to it where "
        "answers belong to the time of their images. The gains are assumed, so the size of the lag "
        "is ours.",
    )


def _recognises(slow: _Motion) -> Finding:
    lag = slow.mean(lambda row: row.seen_lag_deg)
    gain = slow.mean(lambda row: row.seen_gain)
    worst = max(max(row.followed.seen_worst) for row in slow.rows)
    works = abs(gain.mean - 1.0) < 0.02 and worst < _RECOGNISED_M
    return Finding(
        before=f"At {slow.period} the genetic algorithm recognises the object all the time.",
        ours=f"The recognised x has {gain.written(4)} of the amplitude and lags {lag.written(2)} "
        f"degrees; no coordinate was ever more than {1e3 * worst:.0f} mm off.",
        verdict=Verdict.AGREES if works else Verdict.DIFFERS,
        why="From one image to the next the object moves by much less than the population is "
        "wide, so one generation finds it again."
        if works
        else "One generation an image does not keep up: gains, noise or search are not the "
        "laboratory's.",
    )


def _unsteady(slow: _Motion, fast: _Motion, results: Results) -> Finding:
    spreads = [one.mean(lambda row: 1e3 * row.seen_spread[2]) for one in (slow, fast)]
    across = fast.mean(lambda row: 1e3 * row.seen_spread[0])
    worst = 1e3 * max(row.followed.seen_worst[2] for row in fast.rows)
    growth = _growth(fast.rows)
    wider, grows = spreads[1].mean > _UNSTEADY * spreads[0].mean, _grows(growth)
    verdict = Verdict.AGREES if wider and grows else Verdict.PARTLY if wider else Verdict.DIFFERS
    return Finding(
        before=f"At {fast.period} recognition becomes unstable in z as time passes.",
        ours=f"The recognised z spreads by {spreads[1].written(1)} mm at {fast.period} (x by "
        f"{across.written(1)} mm) and by {spreads[0].written(1)} mm at {slow.period}; it was "
        f"{worst:.0f} mm off at worst. {_over_time(fast, growth, grows)}",
        verdict=verdict,
        why="The fitness changes little along z, so that one generation an image, led by a few "
        "points, picks places far apart along it, the more so the faster the object moves away "
        "from the population. How far depends on the population and its reach, which are assumed. "
        "What lets it grow with time in the laboratory the paper does not say"
        + ("." if grows or not _tells_growth(fast.rows) else f"; {_excluded(results)}"),
    )


def _excluded(results: Results) -> str:
    """Say that no growth is reproduced, and which readings of the method do not grow, either."""
    found = [(one.name, rows_of(results, one.name)) for one in READINGS]
    steady = [name for name, rows in found if _tells_growth(rows) and not _grows(_growth(rows))]
    too = f" Nor does it grow {', nor '.join(steady)}." if steady else ""
    return f"the growth is not reproduced, and its cause unknown.{too}"


def _tells_growth(rows: Sequence[ServoingRow]) -> bool:
    """Say if runs tell whether z spreads more and more: there are several, of several periods."""
    return len(rows) > 1 and all(len(row.followed.z_spread_by_period) > 1 for row in rows)


def _growth(rows: Sequence[ServoingRow]) -> Interval:
    """Return how many times as much z spreads in the last period as in the first."""
    return over(rows, lambda row: row.z_spread_by_period[-1] / row.z_spread_by_period[0])


def _grows(growth: Interval) -> bool:
    return growth.half is not None and growth.mean - growth.half > 1.0


def _over_time(fast: _Motion, growth: Interval, grows: bool) -> str:
    """Say whether z spreads more and more."""
    if any(len(row.followed.z_spread_by_period) < 2 for row in fast.rows):
        return "Whether that grows with time a single period does not tell."
    clear = "it grows with time" if grows else "no growth with time is clear"
    times = f"{growth.written(2)} times as much as in the first"
    return f"In the last period it spreads {times}: {clear}."


def _spoils(slow: _Motion, fast: _Motion) -> Finding:
    shared = fast.mean(lambda row: row.x_by_z)
    seen = [one.mean(lambda row: 1e3 * row.seen_spread[0]) for one in (slow, fast)]
    hand = [one.mean(lambda row: 1e3 * row.hand_jitter[0]) for one in (slow, fast)]
    linked = shared.mean**2 >= _SHARED
    spoilt = seen[1].mean > _UNSTEADY * seen[0].mean
    agrees = {2: Verdict.AGREES, 1: Verdict.PARTLY, 0: Verdict.DIFFERS}[linked + spoilt]
    return Finding(
        before="The unsteady z has a bad influence on x.",
        ours=f"The errors in x and z correlate by {shared.written(2)}. The recognised x spreads by "
        f"{seen[1].written(2)} mm instead of {seen[0].written(2)} mm at {slow.period}, and what is "
        f"left of the hand's x beside its swing is {hand[1].written(2)} mm instead of "
        f"{hand[0].written(2)}.",
        verdict=agrees,
        why="While the hand lags, the object is not in front of it, and an error along the line of "
        "sight has a part in x. Most of it stays in z, because the eyes look from both sides.",
    )
