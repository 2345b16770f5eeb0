"""How recognition, gaze and hand answer by frequency, and how much the loop bears."""

from servoid_experiments.bode.planning import plan
from servoid_experiments.bode.settings import QUICK, BodeSettings
from servoid_experiments.bode.telling import tell
from servoid_experiments.design import Study

BODE = Study(
    name="bode",
    title="Frequency responses and margins",
    asks=(
        "Up to which frequency do recognition, gaze and hand follow, with and without feed-forward "
        "and turning eyes, and how much gain, delay and latency does the loop bear?"
    ),
    settings=BodeSettings,
    quick=QUICK,
    plan=plan,
    tell=tell,
)

__all__ = ["BODE", "BodeSettings"]
