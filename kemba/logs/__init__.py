"""Logs of other programs: column maps, file formats, and drafts of maps."""

from kemba.logs.columns import ColumnMap, Source, load_map
from kemba.logs.opening import ENDINGS, open_log

__all__ = ["ENDINGS", "ColumnMap", "Source", "load_map", "open_log"]
