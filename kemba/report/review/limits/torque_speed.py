"""The torque-speed plane of a hip: what was used, within what the motor can give."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from kemba.effects.mechanics.motor import Motor
from kemba.report.review.charts import colour
from kemba.report.review.limits.use import Use, envelope
from kemba.report.review.tracks import Track
from kemba.trajectory import Array

WIDE, HIGH, LEFT, BOTTOM = 420.0, 200.0, 34.0, 26.0
POINTS = 300  # of each curve
DASHED = ' stroke-dasharray="5 3"'


def torque_speed(leg: str, tracks: Sequence[Track], uses: Sequence[Use], motor: Motor) -> str:
    """Torque against driving speed as SVG; empty where no motion has both."""
    curves = [(i, *_driving(use)) for i, use in enumerate(uses)]
    curves = [(i, speed, torque) for i, speed, torque in curves if len(speed)]
    if not curves:
        return ""
    low = min(-1.0, *(float(speed.min()) for _, speed, _ in curves))

    def at(speed: float, torque: float) -> str:
        x = LEFT + (speed - low) / (motor.w_noload - low) * (WIDE - LEFT - 4)
        y = HIGH - BOTTOM - torque / (1.08 * motor.tau_peak) * (HIGH - BOTTOM - 4)
        return f"{x:.1f},{y:.1f}"

    border = " ".join(at(max(speed, low), torque) for speed, torque in envelope(motor))
    lines = "".join(
        f'<polyline points="{" ".join(at(*pair) for pair in zip(speed, torque, strict=True))}" '
        f'fill="none" stroke="{colour(tracks, i)}" stroke-width="1.2"'
        f"{DASHED if tracks[i].role == 'plant' else ''}/>"
        for i, speed, torque in curves
    )
    ticks = "".join(
        _tick(at(speed, 0.0), f"{speed + 0.0:g}", 12.0, "middle")
        for speed in np.arange(np.ceil(low / 10) * 10, motor.w_noload, 10)
    )
    ticks += "".join(
        _tick(at(low, torque), f"{torque:g}", 4.0, "end")
        for torque in np.arange(0, motor.tau_peak, 8)
    )
    used = max(float(np.nanmax(use.motor)) for use in uses if np.isfinite(use.motor).any())
    title = f"{leg.title()} hip: torque against speed"
    alt = f"{title}; at most {100 * used:.0f} % of what the motor gives is used"
    return (
        f"<figure><figcaption><b>{escape(title)}</b> [N.m against rad/s]</figcaption>"
        f'<svg viewBox="0 0 {WIDE:g} {HIGH:g}" role="img" aria-label="{escape(alt)}">'
        f'<polyline points="{border}" fill="none" stroke="#8c8c8c" stroke-dasharray="4 3"/>'
        f'<polyline points="{at(low, 1.08 * motor.tau_peak)} {at(low, 0.0)} '
        f'{at(motor.w_noload, 0.0)}" fill="none" stroke="#8c8c8c"/>{lines}{ticks}</svg></figure>'
    )


def _driving(use: Use) -> tuple[Array, Array]:
    """Speed in the direction of the torque, and the torque's size, thinned out."""
    known = np.flatnonzero(np.isfinite(use.torque) & np.isfinite(use.speed))
    chosen = known[:: max(1, len(known) // POINTS)]
    torque = use.torque[chosen]
    return use.speed[chosen] * np.sign(torque), np.abs(torque)


def _tick(place: str, text: str, down: float, anchor: str) -> str:
    x, y = (float(part) for part in place.split(","))
    x -= 4.0 if anchor == "end" else 0.0
    return (
        f'<text x="{x:.1f}" y="{y + down:.1f}" font-size="10" fill="#595959" '
        f'text-anchor="{anchor}">{text}</text>'
    )
