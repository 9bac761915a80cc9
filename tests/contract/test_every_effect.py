"""What every effect of the catalogue promises, tried on each of them."""

from functools import cache

import pytest

from kemba.contract import CHECKS, Check
from kemba.contract.cases import Broken, Placed
from kemba.contract.check import keeps_the_mirror
from kemba.effects import BY_KIND, EFFECTS

KINDS = sorted(kind for kind, effect in BY_KIND.items() if effect in EFFECTS)
CASES = [
    pytest.param(kind, check, id=f"{kind}: {check.name}")
    for kind in KINDS
    for check in CHECKS
    if check.applies(BY_KIND[kind])
]
ON_BODY = [kind for kind in KINDS if BY_KIND[kind].place == "body"]
LOPSIDED = {"com_offset"}  # a mirror image of theirs is another value

placed = cache(Placed)


def test_no_two_effects_have_one_kind() -> None:
    assert len(KINDS) == len(EFFECTS)


@pytest.mark.parametrize("kind, check", CASES)
def test_keeps_its_promise(kind: str, check: Check) -> None:
    check.run(placed(BY_KIND[kind]))


@pytest.mark.parametrize("kind", ON_BODY)
def test_effects_on_the_body_keep_the_mirror_but_one(kind: str) -> None:
    if kind not in LOPSIDED:
        keeps_the_mirror(placed(BY_KIND[kind]))
        return
    with pytest.raises(Broken):
        keeps_the_mirror(placed(BY_KIND[kind]))
