"""Groups the images of one device's streams by instant, using their timestamps."""

from collections import deque
from dataclasses import dataclass, field
from typing import Any

_WAITING = 8  # pending instants, beyond which an incomplete one is dropped


@dataclass(eq=False)
class Moment:
    """What streams took at one instant: images by stream name, with a timestamp in seconds."""

    stamp_s: float
    images: dict[str, Any] = field(default_factory=dict)


class Pairing:
    """Collects images in any order until all streams have one with the same timestamp.

    If only a `wanted` stream is missing, an instant is complete once a later one is; if a `needed`
    one is missing, it is left out. Instants are returned in the order of their timestamps.
    """

    def __init__(
        self, needed: tuple[str, ...], wanted: tuple[str, ...] = (), *, apart_s: float
    ) -> None:
        """Group images whose timestamps differ by at most `apart_s`: far less than a period."""
        self._needed, self._wanted, self._apart_s = needed, wanted, apart_s
        self._waiting: deque[Moment] = deque()
        self._last_s: float | None = None
        self._alone: dict[str, int] = {}

    def add(self, stream: str, stamp_s: float, image: Any) -> list[Moment]:
        """Add an image of a stream; return the instants that are now complete."""
        if self._last_s is not None and stamp_s <= self._last_s + self._apart_s:
            if stamp_s > self._last_s - 1.0:
                self._count(stream)
                return []
            self._waiting.clear()  # the device's clock jumped back: it was restarted
            self._last_s = None
        moment = self._moment(stamp_s)
        moment.images[stream] = image
        if len(self._waiting) > _WAITING:
            self._give_up(self._waiting.popleft())
        if any(name not in moment.images for name in (*self._needed, *self._wanted)):
            return self._without_wanted()
        return self._until(moment)

    def alone(self) -> tuple[str, ...]:
        """Report the images that had no partner since the previous call."""
        messages = tuple(
            f"{count} {'image' if count == 1 else 'images'} of {name} had no partner of the same "
            "moment"
            for name, count in self._alone.items()
        )
        self._alone.clear()
        return messages

    def _moment(self, stamp_s: float) -> Moment:
        """Return the instant with a timestamp, in order among the pending ones."""
        for place, one in enumerate(self._waiting):
            if abs(one.stamp_s - stamp_s) <= self._apart_s:
                return one
            if one.stamp_s > stamp_s:
                self._waiting.insert(place, Moment(stamp_s))
                return self._waiting[place]
        self._waiting.append(Moment(stamp_s))
        return self._waiting[-1]

    def _has_needed(self, moment: Moment) -> bool:
        return all(name in moment.images for name in self._needed)

    def _without_wanted(self) -> list[Moment]:
        """Return pending instants that lack only optional streams, if a later one is pending."""
        ready = [one for one in self._waiting if self._has_needed(one)]
        return self._until(ready[-2]) if len(ready) > 1 else []

    def _until(self, last: Moment) -> list[Moment]:
        """Return the complete instants up to a given one, and drop the incomplete ones."""
        found: list[Moment] = []
        while self._waiting and self._waiting[0].stamp_s <= last.stamp_s:
            one = self._waiting.popleft()
            if self._has_needed(one):
                found.append(one)
            else:
                self._give_up(one)
        self._last_s = last.stamp_s
        return found

    def _give_up(self, moment: Moment) -> None:
        for name in moment.images:
            self._count(name)

    def _count(self, stream: str) -> None:
        self._alone[stream] = self._alone.get(stream, 0) + 1
