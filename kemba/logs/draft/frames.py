"""Bodies in three dimensions: which axis is up, and the pitch of a quaternion."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kemba.logs.draft.words import Names, named_unit
from kemba.logs.foreign import pitch
from kemba.trajectory import Array

QUATERNION = re.compile(r"(?P<stem>.*?)(?P<mark>q(?:uat)?_?)?(?P<axis>[xyzw])")
NUMBERED = re.compile(r"(?P<stem>.*?q)[\[_/]?(?P<axis>[0-3])\]?")  # of PX4: w first
UNIT_NORM = 0.02


def quaternions(
    values: Mapping[str, Array], names: Names
) -> tuple[dict[str, Array], Names, dict[str, tuple[str, ...]]]:
    """The columns without those of quaternions, each with the pitch that it turns by instead, and
    the four columns x, y, z, w of each pitch."""
    found: dict[str, dict[str, str]] = {}
    for name in values:
        bare = named_unit(name)[0]
        match = QUATERNION.fullmatch(bare)
        number = NUMBERED.fullmatch(bare)
        if match:
            found.setdefault(f"{match['stem']}{match['mark'] or ''}", {})[match["axis"]] = name
        elif number:
            found.setdefault(number["stem"], {})["wxyz"[int(number["axis"])]] = name
    left, labels, turned = dict(values), dict(names.labels), {}
    for stem, parts in found.items():
        if set(parts) != set("xyzw"):
            continue
        four = tuple(parts[axis] for axis in "xyzw")
        norm = np.sqrt(sum(values[name] ** 2 for name in four))
        if np.mean(np.abs(norm[np.isfinite(norm)] - 1.0) < UNIT_NORM) < 0.99:
            continue
        for name in four:
            left.pop(name)
        label = f"{stem} (pitch of the quaternion)"
        left[label] = pitch(*(values[name] for name in four))
        labels[label], turned[label] = f"{stem}_pitch_derived", four
    below = {**names.below, **dict.fromkeys(turned, "rad")}
    return left, replace(names, labels=labels, below=below, columns=tuple(left)), turned


def upright(values: Mapping[str, Array], names: Names) -> tuple[Names, list[str]]:
    """Which of y and z is up: z, unless it stays about zero while y does not."""
    heights: dict[str, list[float]] = {}
    for name, y in values.items():
        says = names.says(name)
        up = says.get("direction", set()) & {"y", "z"}
        if len(up) == 1 and says.get("kind", {"position"}) == {"position"} and "leg" not in says:
            heights.setdefault(up.pop(), []).append(float(np.nanmedian(np.abs(y))))
    if "y" not in heights or "z" not in heights or max(heights["z"]) > 0.2 * max(heights["y"]):
        return names, []
    exchange = str.maketrans("yzYZ", "zyZY")
    turned = {
        name: re.sub(r"[YZyz](?![A-Za-z])", lambda m: m[0].translate(exchange), name)
        for name in values
        if names.says(name).get("direction", set()) & {"y", "z"}
    }
    said = ["Height: z stays about zero, so y is taken as the height"]
    return replace(names, labels={**turned, **names.labels}), said
