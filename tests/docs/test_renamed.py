"""Names that were public once."""

import subprocess
import sys

import pytest

import servoid
from servoid.errors import RenamedError, ServoidError
from servoid.renamed import refuse_old_names


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("servoid.observe", "camera, capture, config, segment, source and stereo"),
        ("servoid.model.Sights", "RangeSamples"),
        ("servoid.model.fit_sights", "fit_range_samples"),
        ("servoid.model.sights_of_cloud", "range_samples_of_cloud"),
        ("servoid.batch.Headway", "BatchProgress"),
        ("servoid.servo.meet", "explore"),
        ("servoid.servo.Meeting", "Exploration"),
        ("servoid.servo.Wish", "TrueGoal"),
        ("servoid.opening.Known", "GivenCalibration"),
        ("servoid.opening.count_untold", "count_uncalibrated_cameras"),
        ("servoid.exchange.bags.Told", "BagCalibrationSupplier"),
        ("servoid.exchange.bags.ToldCamera", "SuppliedCamera"),
        ("servoid.exchange.bags.why_untold", "why_uncalibrated"),
        ("servoid.exchange.export.check_wish", "check_options"),
        ("servoid.segment.seek_object", "find_with_doubts"),
        ("servoid.track.place_body", "pose_from_masks"),
    ],
)
def test_an_old_name_is_refused_with_the_new_one(old: str, new: str) -> None:
    module, name = old.rsplit(".", 1)
    script = f"from {module} import {name}"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert old in last
    assert new in last


def test_each_new_name_is_there() -> None:
    assert servoid.model.RangeSamples and servoid.model.fit_range_samples
    assert servoid.model.range_samples_of_cloud and servoid.track.pose_from_masks
    assert servoid.servo.explore and servoid.servo.Exploration and servoid.servo.TrueGoal


def test_a_name_that_never_was_is_no_attribute() -> None:
    refuse = refuse_old_names("servoid.x", {"old": "new"})
    with pytest.raises(RenamedError, match=r"servoid\.x\.old is called new now"):
        refuse("old")
    with pytest.raises(AttributeError, match="no attribute 'never'"):
        refuse("never")
    assert issubclass(RenamedError, ServoidError)
    assert not hasattr(servoid.model, "never")
