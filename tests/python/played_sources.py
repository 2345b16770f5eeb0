"""Sources beside the simulator's, played against a clock that a test moves."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from threading import Condition

import cv2
import numpy as np

from servoid.camera import Lens
from servoid.capture import Capture, open_capture
from servoid.pose import Pose
from servoid.source import Live, LiveCamera, LiveSettings, Recording, Source

SIZE_PX = (64, 48)
PERIOD_S = 0.008


@dataclass
class Played:
    """A source, the time on its clock, what lets a control period pass, and what ends it."""

    source: Source
    now: Callable[[], float]
    pass_period: Callable[[], None]
    close: Callable[[], None] = lambda: None


class FakeClock:
    """A clock that stands still until it is told to go on."""

    def __init__(self, time_s: float = 5.0) -> None:
        self.turn = Condition()
        self.time_s = time_s
        self.videos: list[FakeVideo] = []

    def __call__(self) -> float:
        with self.turn:
            return self.time_s

    def advance(self, seconds: float = PERIOD_S) -> None:
        """Let time pass, and wait until all images that are due by then were fetched."""
        with self.turn:
            self.time_s += seconds
            self.turn.notify_all()
            self.turn.wait_for(lambda: all(one.next_s > self.time_s for one in self.videos))


class FakeVideo:
    """A camera that exposes by a fake clock; images whose numbers are in `lost` do not come."""

    def __init__(
        self,
        clock: FakeClock,
        *,
        shift_s: float = 0.0,
        rate_hz: float = 30.0,
        lost: Collection[int] = (),
        size_px: tuple[int, int] = SIZE_PX,
    ) -> None:
        self.clock, self.lost, self.size_px = clock, lost, size_px
        self.first_s, self.rate_hz, self.count = clock() + shift_s, rate_hz, 0
        self.closed = False
        self.is_fetched = False  # an image that came is being stamped and kept
        clock.videos.append(self)

    @property
    def next_s(self) -> float:
        if self.closed or self.is_fetched:
            return np.inf if self.closed else -np.inf
        return self.first_s + (self.count + 1) / self.rate_hz

    def grab(self) -> bool:
        with self.clock.turn:
            self.is_fetched = False
            self.clock.turn.notify_all()
            while self.clock.time_s < self.next_s and not self.closed:
                self.clock.turn.wait(0.05)
            self.count += 1
            self.is_fetched = self.count - 1 not in self.lost
            return self.is_fetched

    def retrieve(self) -> tuple[bool, np.ndarray]:
        width, height = self.size_px
        image = np.zeros((height, width, 3), np.uint8)
        image[..., 0], image[..., 2] = 200, self.count % 256  # blue comes first
        return True, image

    def release(self) -> None:
        with self.clock.turn:
            self.closed = True
            self.clock.turn.notify_all()


def lens(distortion: tuple[float, ...] = ()) -> Lens:
    return Lens(
        model="brown_conrady" if distortion else "pinhole",
        size_px=SIZE_PX,
        focal_px=(60.0, 60.0),
        center_px=(31.5, 23.5),
        distortion=distortion,
    )


def rig(*videos: FakeVideo | str, distortion: tuple[float, ...] = ()) -> tuple[LiveCamera, ...]:
    return tuple(
        LiveCamera(
            name, video, lens(distortion), Pose.from_parts([0.1 * place, 0, 0], [1.0, 0, 0, 0])
        )
        for place, (name, video) in enumerate(zip(("left", "right"), videos, strict=False))
    )


def live(
    lost: Collection[int] = (),
    distortion: tuple[float, ...] = (),
    settings: LiveSettings | None = None,
) -> Played:
    """Play two live cameras, the right one 6 ms behind and without some images."""
    clock = FakeClock()
    videos = FakeVideo(clock), FakeVideo(clock, shift_s=0.006, lost=lost)
    source = Live(rig(*videos, distortion=distortion), clock=clock, settings=settings)

    def close() -> None:
        for video in videos:
            video.closed = True
        source.close()

    return Played(source, clock, clock.advance, close)


def write_capture(folder: Path, count: int = 40, *, rate: str = "rate_hz = 30.0") -> Capture:
    """Write a small recording of two cameras; the first ten right images but three are empty."""
    tables = ""
    for place, name in enumerate(("left", "right")):
        (folder / name).mkdir(parents=True)
        for number in range(count):
            image = np.full((SIZE_PX[1], SIZE_PX[0], 3), number, np.uint8)
            path = folder / name / f"{number:03d}.png"
            if name == "right" and 3 <= number < 10:
                path.write_bytes(b"")
            else:
                cv2.imwrite(str(path), image)
        tables += f'[[camera]]\nname = "{name}"\nimages = "{name}/*.png"\nsize_px = [64, 48]\n'
        tables += 'model = "pinhole"\nfocal_px = [60, 60]\ncenter_px = [31.5, 23.5]\n'
        tables += f"rig_from_camera = [[1,0,0,{0.1 * place}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n"
    (folder / "capture.toml").write_text(f"version = 1\n{rate}\n{tables}")
    return open_capture(folder)


def recorded(folder: Path, **options: float) -> Played:
    """Play a recording on disk."""
    clock = FakeClock()
    return Played(Recording(write_capture(folder), clock, **options), clock, clock.advance)
