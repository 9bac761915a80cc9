"""What a process keeps."""

from kemba.cache import Recent


def test_the_last_used_ones_are_kept() -> None:
    made: list[str] = []
    recent: Recent[str, str] = Recent()

    def get(key: str) -> str:
        return recent.get(key, lambda: made.append(key) or key.upper(), 2)

    assert [get(key) for key in "ababcacb"] == list("ABABCACB")
    assert made == list("abcab")
