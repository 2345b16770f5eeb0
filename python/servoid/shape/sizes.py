"""Reports bodies of sizes that hardly any object has."""

import numpy as np

from servoid._native import Body
from servoid.config.plausible import size_note


def body_size_note(body: Body) -> str | None:
    """Report a body that is implausibly large or small for one in metres, else return None."""
    reach = body.radii.max(axis=1, keepdims=True)
    size_m = np.ptp(np.concatenate([body.centers - reach, body.centers + reach]), axis=0).max()
    return size_note("the body", float(size_m))
