#!/usr/bin/env bash
# TDMS: three ways in which one rig's channels lose their common time in npTDMS' data frames.
#
# Guess, written before the run: as_dataframe(time_index=True) lets channels with other start times
# each begin at 0 (npTDMS' issue 262), puts channels of one rate into common rows, and fills short
# ones with NaN at their end.
#
# Seen (nptdms 1.13.0, pandas 3.1.1):
# - The first is so: channels that began 250 ms apart both begin at 0.
# - Common rows are not. Times come from linspace over each channel's own length, and 3 * 0.1 / 3
#   and 4 * 0.1 / 4 differ in the last digit. Of two channels at 10 Hz with 5 and 4 values, two rows
#   coincide and the others do not: seven rows instead of five. At 10 kHz, 12345 and 12340 values
#   share 1998 rows. It hangs on the lengths: of random pairs at 10 kHz 28 % lose most of their
#   common rows, at 1 kHz hardly any (300 pairs of 1000 to 100000 values each, by a trial of
#   linspace alone).
# - The pause is lost: a channel has one wf_start_time, that of its last segment. All rows of the
#   first recording are dated from the start of the second, without a pause.
#
# Why it matters: acquisition that starts module after module, or is stopped between trials, is
# usual with LabVIEW. dropna() after the first leaves a few accidental rows, interpolation hides
# them; delays between valve and pressure are fitted to shifts that the reader made. Reckon time as
# wf_start_time + wf_start_offset + n * wf_increment, segment by segment, in integer nanoseconds.
#
# Read: npTDMS' documentation (time_track, as_dataframe), its issues 41 and 262.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet nptdms==1.13.0 pandas==3.1.1 numpy==2.4.6
"$work/venv/bin/python" - "$work/rig.tdms" <<'EOF'
import sys
from importlib.metadata import version

import numpy as np
from nptdms import ChannelObject, TdmsFile, TdmsWriter

path = sys.argv[1]
begin = np.datetime64("2026-01-02T10:00:00.000000")
print("nptdms", version("nptdms"), "pandas", version("pandas"))


def channel(name, size, step=0.1, later_ms=0, first=0.0):
    return ChannelObject(
        "rig",
        name,
        first + np.arange(size, dtype=float),
        properties={
            "wf_start_time": begin + np.timedelta64(later_ms, "ms"),
            "wf_start_offset": 0.0,
            "wf_increment": step,
            "wf_samples": size,
        },
    )


def written(*segments):
    with TdmsWriter(path) as writer:
        for segment in segments:
            writer.write_segment(segment)
    return TdmsFile.read(path)["rig"]


short = written([channel("valve", 5), channel("pressure", 4)]).as_dataframe(time_index=True)
print("two channels at 10 Hz, 5 and 4 values:", len(short), "rows")
print(short.to_string())
long = written([channel("valve", 12345, 1e-4), channel("pressure", 12340, 1e-4)])
common = long.as_dataframe(time_index=True).dropna()
print("two channels at 10 kHz, 12345 and 12340 values:", len(common), "rows with both")
late = written([channel("valve", 4), channel("pressure", 4, later_ms=250)])
print(
    "begun 250 ms apart, first times:",
    [float(late[name].time_track()[0]) for name in ("valve", "pressure")],
    "rows with both:",
    len(late.as_dataframe(time_index=True).dropna()),
)
again = written([channel("valve", 3)], [channel("valve", 3, later_ms=60000, first=100.0)])
times = again["valve"].time_track(absolute_time=True)
print("stopped, started again a minute later:", times[0], "to", times[-1])

if len(short) <= 5 or len(short.dropna()) == 4:
    sys.exit("changed: channels of one rate and different lengths now share their rows")
if len(common) > 6000:
    sys.exit("changed: at 10 kHz most rows are now shared")
if len(late.as_dataframe(time_index=True).dropna()) != 4:
    sys.exit("changed: start times are no longer ignored")
if (
    times[0] != begin + np.timedelta64(60, "s")
    or (np.diff(times) > np.timedelta64(101, "ms")).any()
):
    sys.exit("changed: the pause between two recordings is now in the times")
EOF
