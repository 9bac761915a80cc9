"""Before anything is imported: one thread for linear algebra in each test process.

The matrices here are small. OpenBLAS splits them all the same, and its threads wait for each other
by spinning: beside another process that costs many times the work itself.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["KEMBA_MEMORY"] = ""  # no test begins from the plans of another
