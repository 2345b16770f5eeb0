"""`servoid doctor`: reports what servoid runs on, tests it for five seconds, and judges it."""

import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import asdict

import msgspec
import typer

from servoid.cli.doctor.checkup import Camera, Machine, look_at_machine, problems_of
from servoid.cli.doctor.installed import NEEDED
from servoid.cli.progress import progress_bar
from servoid.sim import SelfTest, run_self_test
from servoid.words import counted

_LABEL_WIDTH, _WIDTH = 15, 80
_MS_PER_S, _MM_PER_M = 1e3, 1e3
_UNWELL = 1

Row = tuple[str, str]


def run_doctor(*, json: bool, tests: bool) -> None:
    """Print what servoid runs on and the result of its self-test; exit with 1 on a problem."""
    machine = look_at_machine(tries=tests)
    if not json:
        _print(_machine_rows(machine))
    test = _tested() if tests else None
    problems = [*machine.problems, *([] if test is None else problems_of(test))]
    if json:
        _print_json(machine, test, problems)
    else:
        _print([] if test is None else _test_rows(test))
        _print(("problem", problem) for problem in problems)
        works = "" if test is None else " and works"
        _print([] if problems else [("verdict", f"all that servoid needs is there{works}")])
    if problems:
        raise typer.Exit(_UNWELL)


def _tested() -> SelfTest:
    with progress_bar("testing") as update:
        update(0.0, "a rendered bottle is modelled and tracked")
        return run_self_test()


def _print(rows: Iterable[Row]) -> None:
    for label, value in rows:
        lines = textwrap.wrap(
            value, _WIDTH - _LABEL_WIDTH - 1, break_long_words=False, break_on_hyphens=False
        )
        for number, line in enumerate(lines):
            typer.echo(f"{label if number == 0 else '':<{_LABEL_WIDTH}} {line}")


def _machine_rows(machine: Machine) -> Iterator[Row]:
    yield "servoid", machine.servoid
    yield "python", f"{machine.python} on {machine.system}"
    yield "cores", _cores(machine)
    others = ", ".join(machine.back_ends)
    yield (
        "backend",
        f"{machine.back_end} (this machine has {others}; SERVOID_BACKEND forces one, and all give "
        "the same numbers)",
    )
    yield from _library_rows(machine)
    for number, (name, words) in enumerate(machine.renderers.items()):
        yield "" if number else "renderers", f"{name}: {words}"
    if not machine.cameras:
        yield "cameras", "none: there is no /dev/video0"
    for number, camera in enumerate(machine.cameras):
        yield "" if number else "cameras", _camera_words(camera)


def _library_rows(machine: Machine) -> Iterator[Row]:
    if machine.libraries is None:
        yield "libraries", "not known: servoid is not installed as a package"
        return
    for extra, found in machine.libraries.items():
        words = ", ".join(f"{name} {number or 'missing'}" for name, number in found.items())
        if not found:
            words = f"not available for {machine.system}"
        elif extra != NEEDED and None in found.values():
            words += f"; install with: pip install 'servoid[{extra}]'"
        elif extra in machine.unloadable:
            words += f"; {machine.unloadable[extra]}"
        yield extra if extra == NEEDED else f"[{extra}]", words


def _cores(machine: Machine) -> str:
    count, usable = machine.cores, machine.usable_cores
    text = str(count) if usable == count else f"{usable} of {count}"
    return text if machine.processor is None else f"{text}, {machine.processor}"


def _camera_words(camera: Camera) -> str:
    words = f"{camera.device}, {camera.name}"
    if camera.links:
        words += f", also {' and '.join(camera.links)}"
    if not camera.readable:
        words += "; no permission to open it: add yourself to the group video"
    return words


def _test_rows(test: SelfTest) -> Iterator[Row]:
    yield (
        "self-test",
        f"a rendered bottle, {counted(test.ellipsoids, 'ellipsoid')}, {test.observations} stereo "
        "observations of 640x480 pixels",
    )
    yield (
        "  modelled",
        f"in {test.modelling_s:.2f} s; outline IoU {test.iou:.3f}, expected "
        f"{test.least_iou:.2f} or more",
    )
    yield (
        "  tracked",
        f"in {100.0 * test.tracked:.0f} %, expected {100.0 * test.least_tracked:.0f} %; "
        f"{_MM_PER_M * test.error_m:.2f} mm off, expected {_MM_PER_M * test.largest_error_m:.1f} "
        "or less",
    )
    pace = "" if test.keeps_up else ": too slow for that here, or the machine is busy"
    yield (
        "  speed",
        f"{_MS_PER_S * test.step_s:.1f} ms per observation, up to "
        f"{_MS_PER_S * test.longest_step_s:.0f} ms keep up with 30 Hz{pace}; rendering took "
        f"{_MS_PER_S * test.drawing_s:.0f} ms per image",
    )


def _print_json(machine: Machine, test: SelfTest | None, problems: list[str]) -> None:
    report = asdict(machine) | {
        "self_test": None
        if test is None
        else asdict(test) | {"is_right": test.is_right, "keeps_up": test.keeps_up},
        "problems": problems,
    }
    typer.echo(msgspec.json.format(msgspec.json.encode(report), indent=2).decode())
