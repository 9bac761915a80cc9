"""The physics of the user's own rigs: a drive's axis, chambers whose pressures are measured.

Figures of an axis are in the units of a linear one; at a rotary one N stands for N.m and m for rad.
"""
