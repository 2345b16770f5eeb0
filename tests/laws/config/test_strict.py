"""What is wrong with a value is explained in words, whatever the value is."""

from enum import Enum
from typing import Annotated

import msgspec
import pytest

from servoid.config.strict import explained


class _Law(Enum):
    END = "end"


class _Settings(msgspec.Struct):
    law: _Law = _Law.END
    gain: Annotated[float, msgspec.Meta(gt=0.0)] = 1.0
    seed: Annotated[int, msgspec.Meta(le=2**32 - 1)] = 1
    names: Annotated[list[str], msgspec.Meta(min_length=1)] = msgspec.field(
        default_factory=lambda: ["one"]
    )


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("law", "a -> end", "'a -> end'"),
        ("law", "< 5", "'< 5'"),
        ("gain", -3.0, "expected a number above 0, got -3"),
        ("seed", 2**33, "of 4294967295 or less"),
        ("names", [], "of length 1 or more"),
    ],
)
def test_a_wrong_value_is_quoted_as_it_is_and_its_bounds_are_put_in_words(
    key: str, value: object, words: str
) -> None:
    given = {key: value}
    with pytest.raises(msgspec.ValidationError) as caught:
        msgspec.convert(given, _Settings)
    assert words in explained(caught.value, given, _Settings, "settings")
