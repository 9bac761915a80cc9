"""The simulator that is loaded while a plan is sought."""

import subprocess
import sys
from textwrap import dedent

import pytest

pytest.importorskip("numba")


@pytest.mark.parametrize(("cores", "beside"), [(2, True), (1, False)])
def test_a_second_thread_loads_the_simulator_where_there_is_a_core(
    cores: int, beside: bool
) -> None:
    code = f"""
        import os, sys, threading
        from kemba.plant.simulate import load_meanwhile
        assert "numba" not in sys.modules
        os.cpu_count = lambda: {cores}
        load_meanwhile()
        for thread in threading.enumerate():
            if thread.name == "loading":
                thread.join()
        print("numba" in sys.modules and "kemba.plant.player" in sys.modules)
    """
    done = subprocess.run(
        [sys.executable, "-c", dedent(code)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == str(beside)
