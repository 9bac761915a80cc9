"""What is kept: compiled code on this machine, where nobody else could have written it, and what
a process made lately."""

import os
import stat
from collections import OrderedDict
from collections.abc import Callable, Hashable
from pathlib import Path
from typing import Generic, TypeVar

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")

BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path | None:
    """Where compiled functions are kept: KEMBA_CACHE, or the user's cache folder.

    None for a user without a home.
    """
    if own := os.environ.get("KEMBA_CACHE"):
        return Path(own)
    if base := os.environ.get("XDG_CACHE_HOME"):
        return Path(base) / "kemba"
    try:
        return Path.home() / ".cache" / "kemba"
    except RuntimeError:  # neither HOME nor an entry in the list of users
        return None


def is_own(path: Path) -> bool:
    """Whether a file or folder is the user's and nobody else could have written it.

    A folder above it may be the user's or the system's, and open to others only where these
    cannot rename what is not theirs (as in a shared folder for temporary files).
    """
    if not is_mine(path.lstat()):
        return False
    for above in path.resolve().parents:
        facts = above.stat()
        open_to_all = facts.st_mode & stat.S_IWOTH and not facts.st_mode & stat.S_ISVTX
        if facts.st_uid not in (0, os.geteuid()) or open_to_all:
            return False
    return True


def is_mine(facts: os.stat_result) -> bool:
    """Whether a file with these facts is the user's, no link, and nobody else may write it."""
    linked = stat.S_ISLNK(facts.st_mode)
    return not linked and facts.st_uid == os.geteuid() and not facts.st_mode & BY_OTHERS


class Recent(Generic[K, V]):
    """The last things made, by their keys."""

    def __init__(self) -> None:
        self._kept: OrderedDict[K, V] = OrderedDict()

    def get(self, key: K, make: Callable[[], V], most: int) -> V:
        """What is kept under `key`, or else made; `most` are kept, the last used ones."""
        if key not in self._kept:
            self._kept[key] = make()
        self._kept.move_to_end(key)
        while len(self._kept) > most:
            self._kept.popitem(last=False)
        return self._kept[key]
