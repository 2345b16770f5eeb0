"""Reports and pictures of models, tracks and runs; needs `pip install 'servoid[view]'`."""

from importlib.util import find_spec

from servoid.errors import MissingExtraError

if find_spec("matplotlib") is None:
    # Raised at import, before the long work whose result is to be drawn.
    raise MissingExtraError.of("pictures", "matplotlib", "view")

from servoid.view.model.report import write_report
from servoid.view.servo.servo_plots import draw_servo_plots
from servoid.view.servo.servo_report import ServoPictures, write_servo_report
from servoid.view.track.track_report import write_track_report

__all__ = [
    "ServoPictures",
    "draw_servo_plots",
    "write_report",
    "write_servo_report",
    "write_track_report",
]
