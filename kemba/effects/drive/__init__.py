"""The physics of a drive: one axis, linear or rotary, at the port `axis`.

Figures are in the units of a linear axis; at a rotary one N stands for N.m and m for rad.
"""
