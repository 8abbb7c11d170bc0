"""What turns notebooks into a book: run, artifacts, report, site."""

from .compare import differences, side_by_side
from .report import PAGE, check_folder_is_free, write_report
from .site import build_site

__all__ = [
    "PAGE",
    "build_site",
    "check_folder_is_free",
    "differences",
    "side_by_side",
    "write_report",
]
