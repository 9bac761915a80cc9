"""Logs of other programs: column maps, file formats, and drafts of maps."""

from kemba.logs.columns import ColumnMap, ColumnSource, load_map
from kemba.logs.foreign import is_log_file, log_files, open_log

__all__ = ["ColumnMap", "ColumnSource", "is_log_file", "load_map", "log_files", "open_log"]
