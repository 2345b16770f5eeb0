"""Pictures of what was modelled. Needs the extra `view`: `pip install 'servoid[view]'`."""

from importlib.util import find_spec

from servoid.errors import MissingExtraError

if find_spec("matplotlib") is None:
    # Said at the import, so that nobody models for minutes before learning it.
    raise MissingExtraError.of("pictures", "matplotlib", "view")

from servoid.view.report import write_report

__all__ = ["write_report"]
