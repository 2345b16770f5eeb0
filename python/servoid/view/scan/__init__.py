"""The report of a scan."""

from servoid.view.scan.scan_report import scan_page

__all__ = ["scan_page"]
