"""Logs of other programs: column maps, file formats, and drafts of maps."""

from kemba.logs.columns import ColumnMap, Columns, ColumnSource, load_map, map_of
from kemba.logs.foreign import is_log_file, log_files, open_log

__all__ = [
    "ColumnMap",
    "ColumnSource",
    "Columns",
    "is_log_file",
    "load_map",
    "log_files",
    "map_of",
    "open_log",
]
