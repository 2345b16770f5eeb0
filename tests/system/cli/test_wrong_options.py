"""A value that an option does not take is answered with what was given and what is allowed."""

from pathlib import Path

import pytest

from conftest import Command


def framed(text: str) -> str:
    """Return the words in the frame around an error, in one line."""
    lines = (line.strip("│ ") for line in text.splitlines() if line.startswith("│"))
    return " ".join(lines)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("track run --seed 1.5", "'--seed': '1.5' is not a whole number; write one such as 3"),
        ("track run --distance 0,5", "'--distance': '0,5' is not a number; write one such as 0.5"),
        ("track run --seed " + "9" * 5000, f"'--seed': '{'9' * 40}...' has too many digits; write"),
        ("sample run --size medium", "'--size': 'medium' is not one of 'small', 'full'"),
        ("study modell --out results", "'name': 'modell' is not one of 'paper', 'bode',"),
        (
            "study modell",
            "'name': 'modell' is not one of 'paper', 'bode', 'track', 'model'; did you "
            "mean 'model'?",
        ),
        (
            "sample run --size smal",
            "'--size': 'smal' is not one of 'small', 'full'; did you mean 'small'?",
        ),
        (
            "model run --out b.json --max-ellipsoids 0",
            "'--max-ellipsoids': it must be 1 to 64, but it is 0",
        ),
        ("pick run --image -1", "'--image': -1 is out of range; choose 0 or more"),
        ("pick run --port 80000", "'--port': 80000 is out of range; choose 65535 or less"),
    ],
)
def test_a_value_that_an_option_does_not_take_is_repeated_beside_what_it_takes(
    arguments: str, message: str, servoid_command: Command
) -> None:
    done = servoid_command(*arguments.split())
    assert done.code == 2
    assert framed(done.err).startswith(f"Invalid value for {message}")
    assert "Value error" not in done.err and "Input should" not in done.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--object teapot", ""),
        ("--object bottel", "; did you mean 'bottle'?"),
        ("--world pa1O", "; did you mean 'pa10'?"),
    ],
)
def test_a_name_that_is_almost_right_is_answered_with_the_right_one(
    arguments: str, message: str, servoid_command: Command, tmp_path: Path
) -> None:
    done = servoid_command("servo", "--out", tmp_path / "run", *arguments.split())
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert message in done.err
    assert bool(message) == ("did you mean" in done.err)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            "model run --out b.json --max-ellipsoids 65",
            "--max-ellipsoids must be 1 to 64, but it is 65",
        ),
        (
            "model run --out b.json --delta -1",
            "--delta must be at least 0 and below 1, but it is -1",
        ),
        ("track run --out p.csv --population 7", "--population must be 8 to 4096, but it is 7"),
        (
            "track run --out p.csv --generations 5000",
            "--generations must be 1 to 1000, but it is 5000",
        ),
    ],
)
def test_a_setting_out_of_range_is_named_by_the_option_that_sets_it(
    arguments: str, message: str, servoid_command: Command
) -> None:
    done = servoid_command(*arguments.split())
    assert (done.code, done.err) == (2, f"error: {message}\n")
