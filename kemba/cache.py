"""Where code that was compiled on this machine is kept, and who could have written it."""

from __future__ import annotations

import os
import stat
from pathlib import Path

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
