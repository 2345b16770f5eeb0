"""Laws of run.mcap, which `servoid servo --mcap` writes: it takes what the cameras deliver."""

from contextlib import ExitStack
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("matplotlib", reason="the plots of a run need matplotlib")
pytest.importorskip("rosbags", reason="recordings need rosbags")

from bag_writing import reads_with
from servo_trials import SMALL

from servoid.cli.servo import servoing
from servoid.cli.servo.servo_order import Order
from servoid.servo.exploration import first_look
from servoid.sim.trial import TrialStep
from servoid.sim.world import World

STAMPED_TOO_EARLY = {"world.ideal": False, "world.lab.stamp_offset_s": 0.1}


def stamps_of(path: Path, topic: str) -> list[float]:
    reader = reads_with("mcap_ros2.reader")
    found = reader.read_ros2_messages(str(path), topics=[topic])
    stamps = [one.ros_msg.header.stamp for one in found]
    return [stamp.sec + 1e-9 * stamp.nanosec for stamp in stamps]


def test_images_that_are_stamped_before_the_start_are_recorded(tmp_path: Path) -> None:
    values = SMALL | STAMPED_TOO_EARLY
    order = Order(out=tmp_path, video=False, mcap=True, config=None, values=values)
    world = World(order.settings().world)
    looks = []
    with ExitStack() as stack:
        run = servoing._Run(tmp_path, 1.0, lambda *_: None)
        run.prepare(world, stack, order)
        for _ in range(3):
            looks.append(first_look(world.arm, world.source))
            run.watch(TrialStep("looking", 0.0, world.time_s, looks[-1]))
    assert looks[0].time_s < 0.0
    stamps = stamps_of(tmp_path / "run.mcap", "/left/image_raw")
    assert stamps == pytest.approx([look.time_s + 1.0 for look in looks])
