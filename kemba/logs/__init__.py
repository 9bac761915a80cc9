"""Logs of other programs: column maps, file formats, and drafts of maps."""

from kemba.logs.columns import ColumnMap, ColumnSource, load_map
from kemba.logs.foreign import ENDINGS, log_files, open_log

__all__ = ["ENDINGS", "ColumnMap", "ColumnSource", "load_map", "log_files", "open_log"]
