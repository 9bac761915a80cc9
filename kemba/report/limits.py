"""How close a motion comes to the limits of the robot: how much was used of torque and speed of the
hips, of friction and air; energy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from kemba.effects.mechanics.ground import Contact
from kemba.effects.mechanics.hip import Motor
from kemba.effects.pneumatics.flow import ATMOSPHERE, GAS, TEMPERATURE
from kemba.events import runs
from kemba.identify.logs.local_fit import local_fit
from kemba.identify.problem.noise import difference_sigma
from kemba.mechanism import Cylinder
from kemba.model import Model
from kemba.plant.controller import motor_of
from kemba.plotting.source import EXACT, Machine, Mask
from kemba.report.charts import Book, Chart, Curve, Track, colour, onto, table
from kemba.report.motion import Events
from kemba.trajectory import Array, Trajectory

NORMAL = 1.204e-3  # kg in a litre of air at 20 deg C and one atmosphere
AT_START = 20  # rows whose median is the pressure of the supply before valves open


FULL = 0.99  # share of a limit that counts as reached
LOADED = 0.1  # share of the weight on a foot below which its friction says nothing
SMOOTH = 0.011  # s; window over which a measured position is made a speed
CLEAR = 8.0  # times its noise that a ground force must be, for friction as its share


@dataclass(frozen=True)
class Use:
    """Of one motion and leg, arrays (rows,): hip torque [N.m] and speed [rad/s]; shares of the
    torque there is at that speed, and of the friction cone."""

    torque: Array
    speed: Array
    motor: Array
    cone: Array


def use_of(track: Track, model: Model, machine: Machine, leg: str) -> Use:
    """What a motion uses of a leg's limits; NaN where a column is missing."""
    t = track.t
    nothing = np.full(len(t), np.nan)
    torque = t.get(f"{leg}/hip/tau", nothing)
    speed = rate(track, f"{leg}/hip/w", f"{leg}/hip/q")
    motor = motor_of(model, leg)
    share = motor_share(motor, torque, speed) if motor else nothing
    return Use(torque, speed, share, _cone(t, model, machine, leg))


def motor_share(motor: Motor, torque: Array, speed: Array) -> Array:
    """Torque (n,) [N.m] over what the motor gives at this speed: its peak, less at high speed."""
    driving = np.clip(speed * np.sign(torque), 0.0, None)
    left = np.clip((motor.w_noload - driving) / motor.slope, 1e-3, motor.tau_peak)
    return np.asarray(np.abs(torque) / left)


def _cone(t: Trajectory, model: Model, machine: Machine, leg: str) -> Array:
    """Share of the friction cone while the foot stands and is loaded."""
    ground = next((e for e in model.effects if isinstance(e, Contact)), None)
    names = (f"{leg}/foot/Fx", f"{leg}/foot/Fz")
    if ground is None or not all(name in t for name in names):
        return np.full(len(t), np.nan)
    along, normal = (t[name] for name in names)
    noise = 0.0 if t.meta.get("kind") in EXACT else difference_sigma(normal)
    loaded = normal > max(LOADED * model.mechanism.weight, CLEAR * noise)
    loaded &= machine.stance(t, leg)
    x = t.get(f"{leg}/foot/x", np.zeros(len(t)))
    mu = model.mechanism.scene.ground.friction(x, ground.mu)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(loaded, np.abs(along) / (mu * normal), np.nan)


def rate(track: Track, speed: str, position: str) -> Array:
    """A speed (rows,): its column, else the smoothed slope of the position; NaN without either."""
    t = track.t
    if speed in t:
        return t[speed]
    if position not in t or len(t) < 5:
        return np.full(len(t), np.nan)
    step = float(np.median(np.diff(t.time)))
    width = max(2, round(0.5 * SMOOTH / step))
    if 2 * width + 1 > len(t):
        return np.gradient(t[position], t.time)
    return local_fit(t[position], width, step, 2, 1)


def slides(track: Track, leg: str, stands: Mask, foot: Array | None) -> float:
    """How far [m] a foot slides while it stands: by its slip speed, else by where it is."""
    t = track.t
    if f"{leg}/foot/slip" in t:
        return float(np.trapezoid(np.where(stands, t[f"{leg}/foot/slip"], 0.0), t.time))
    if foot is None or "body/x" not in t:
        return float("nan")
    way = 0.0
    for a, b in runs(stands):
        place = foot[a:b][np.isfinite(foot[a:b])]
        few = max(1, len(place) // 5)
        if len(place) > 2:
            way += abs(float(np.mean(place[-few:]) - np.mean(place[:few])))
    return way


def supply_share(t: Trajectory) -> Array | None:
    """Pressure (rows,) [1] of the supply above the atmosphere, as a share of that at the start;
    None where it is not known."""
    for name in ("supply/P", "supply/line/s", "supply/s"):
        if name in t and np.isfinite(t[name]).any():
            level = t[name] - (ATMOSPHERE if name.endswith("P") else 0.0)
            known = level[np.isfinite(level)]
            return np.asarray(level / np.median(known[:AT_START]))
    return None


def pressure(t: Trajectory, leg: str, side: str, cylinder: Cylinder) -> Array | None:
    """Pressure (rows,) [Pa] of a chamber: its column, else by its force."""
    area = cylinder.area_extend if side == "extend" else cylinder.area_retract
    where = f"{leg}/chamber/{side}" if leg else f"chamber/{side}"
    if f"{where}/P" in t:
        return t[f"{where}/P"]
    return ATMOSPHERE + t[f"{where}/F"] / area if f"{where}/F" in t else None


def air_drawn(track: Track, leg: str, cylinder: Cylinder) -> float | None:
    """Air [kg] that a leg's chambers take from the supply: what each holds more after its valve
    was on, at room temperature."""
    t, own = track.t, f"{leg}/" if leg else ""
    drawn, found = 0.0, False
    for side in ("extend", "retract"):
        P, place, valve = pressure(t, leg, side, cylinder), f"{own}piston/x", f"{own}valve/{side}"
        if P is None or place not in t or valve not in t:
            continue
        x = t[place] if side == "extend" else cylinder.stroke - t[place]
        area = cylinder.area_extend if side == "extend" else cylinder.area_retract
        mass = P * (cylinder.tube + area * x) / (GAS * TEMPERATURE)
        on = np.nan_to_num(t[valve]) > 0.5
        for start, end in track.source.spans(np.asarray(on)):
            a, b = np.interp([start, end], t.time[np.isfinite(mass)], mass[np.isfinite(mass)])
            drawn += max(0.0, float(b - a))
        found = True
    return drawn if found else None


@dataclass(frozen=True)
class Energy:
    """Work (rows,) [J] since the start of the pistons and of the hips; energy that impacts take
    [J], air drawn from the supply [kg]. None where it is not known."""

    pistons: Array | None
    hips: Array | None
    impacts: float | None
    drawn: float | None


def energy_of(
    track: Track, legs: Sequence[str], cylinder: Cylinder, certificate: Mapping[str, Any]
) -> Energy:
    """The energy of one motion."""
    listed = (certificate if track.role == "plan" else track.t.meta).get("impacts")
    drawn = [air_drawn(track, leg, cylinder) for leg in legs]
    return Energy(
        _summed([_piston_power(track, leg, cylinder) for leg in legs], track),
        _summed([_hip_power(track, leg) for leg in legs], track),
        sum(float(i["energy_J"]) for i in listed) if listed is not None else None,
        sum(one or 0.0 for one in drawn) if any(one is not None for one in drawn) else None,
    )


def _piston_power(track: Track, leg: str, cylinder: Cylinder) -> Array | None:
    """Of the force on the rod where it is known, else of the air alone."""
    t = track.t
    push, pull = (pressure(t, leg, side, cylinder) for side in ("extend", "retract"))
    speed = rate(track, f"{leg}/piston/v", f"{leg}/piston/x")
    if f"{leg}/piston/F" in t:
        return np.asarray(t[f"{leg}/piston/F"] * speed)
    if push is None or pull is None or not np.isfinite(speed).any():
        return None
    force = cylinder.area_extend * (push - ATMOSPHERE)
    return np.asarray((force - cylinder.area_retract * (pull - ATMOSPHERE)) * speed)


def _hip_power(track: Track, leg: str) -> Array | None:
    if f"{leg}/hip/tau" not in track.t:
        return None
    return np.asarray(track.t[f"{leg}/hip/tau"] * rate(track, f"{leg}/hip/w", f"{leg}/hip/q"))


def _summed(powers: Sequence[Array | None], track: Track) -> Array | None:
    """Work (rows,) of all legs since the start."""
    if any(power is None for power in powers):
        return None
    total = np.nan_to_num(np.sum([power for power in powers if power is not None], axis=0))
    steps = np.diff(track.t.time) * 0.5 * (total[1:] + total[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


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

    corner = max(0.0, motor.w_noload - motor.slope * motor.tau_peak)  # up to it, the peak is given
    given = (low, motor.tau_peak), (corner, motor.tau_peak), (motor.w_noload, 0.0)
    border = " ".join(at(*place) for place in given)
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


MOST = 6  # times in a cell of a table


def event_table(tracks: Sequence[Track], events: Sequence[Events | None]) -> str:
    """Apex, lift-off and touchdown of every motion."""
    legs = list(dict.fromkeys(leg for e in events if e for leg in e.touchdowns))
    heads = ["motion", "apex of the body's centre", "feet rise", "lift-off"]
    heads += [f"touchdown {leg}" for leg in legs] + ["end"]
    rows = []
    for track, e in zip(tracks, events, strict=True):
        if e is None:
            continue
        found = e.apexes if len(e.apexes) > 1 else [(e.apex_time, e.apex)]
        tops = [(round(time, 3) + 0.0, z) for time, z in found]  # without -0.000
        rows.append(
            [
                escape(track.name),
                ", ".join(f"{z:.3f} m at {time:.3f} s" for time, z in tops),
                _or_dash(e.feet, 100, "cm"),
                _times(e.lift_offs),
                *(_touchdown(e, leg) for leg in legs),
                f"<b>{escape(e.fault)}</b>" if e.fault else "upright",
            ]
        )
    clock = "Times of the plan's clock. " if any(track.role == "plan" for track in tracks) else ""
    title = f"{clock}The apex is that of the body's centre, which is above the feet."
    return table(title, heads, rows)


def _touchdown(e: Events, leg: str) -> str:
    text, grazes = _times(e.touchdowns.get(leg, ())), e.grazes.get(leg, ())
    return text + (f'<span class="aside">grazes at {_times(grazes)}</span>' if grazes else "")


def _times(listed: Sequence[float]) -> str:
    """The first few times [s]."""
    if not listed:
        return "-"
    more = f" and {len(listed) - MOST} more" if len(listed) > MOST else ""
    return ", ".join(f"{time:.3f}" for time in listed[:MOST]) + " s" + more


def limit_parts(book: Book, model: Model, machine: Machine) -> list[str]:
    """Torque-speed planes, use of motor and friction cone in time, and a table of it all."""
    legs = machine.mechanism.legs
    used = {leg: [use_of(track, model, machine, leg) for track in book.tracks] for leg in legs}
    motors, charts = {leg: motor_of(model, leg) for leg in legs}, []
    planes = [torque_speed(leg, book.tracks, used[leg], m) for leg, m in motors.items() if m]
    shares = {"hip: share of motor limit": "motor", "foot: share of friction cone": "cone"}
    for title, name in shares.items():
        for leg, uses in used.items():
            lines = _curves(book, [getattr(use, name) for use in uses], 100.0)
            charts.append(book.add(Chart(f"{leg.title()} {title}", "%", lines, levels=(100.0,))))
    lines = _curves(book, [supply_share(track.t) for track in book.tracks], 100.0)
    charts.append(book.add(Chart("Supply pressure, of that at the start", "%", lines, least=10.0)))
    grid = f'<div class="grid legs">{"".join(planes)}{"".join(charts)}</div>'
    return [_limit_table(book.tracks, used, machine), grid]


def _curves(book: Book, values: Sequence[Array | None], factor: float = 1.0) -> list[Curve]:
    """A curve for every motion of which `values` (rows,) are known."""
    each = enumerate(zip(book.tracks, values, strict=True))
    return [
        Curve(track.name, factor * _onto(book.grid, track, known), i)
        for i, (track, known) in each
        if known is not None
    ]


def _limit_table(
    tracks: Sequence[Track], used: Mapping[str, Sequence[Use]], machine: Machine
) -> str:
    rows = []
    for i, track in enumerate(tracks):
        coordinates = machine.coordinates(track.t)
        points = machine.points(coordinates) if coordinates is not None else {}
        supply = supply_share(track.t)
        lowest = "-" if supply is None else f"{100 * float(np.nanmin(supply)):.0f} %"
        for leg, uses in used.items():
            foot = points[f"{leg}/foot"][:, 0] if points else None
            slid = slides(track, leg, machine.stance(track.t, leg), foot)
            full = np.nan_to_num(uses[i].motor) >= FULL
            rows.append(
                [
                    escape(track.name),
                    escape(leg),
                    _largest(np.abs(uses[i].torque), "N.m", 1),
                    _largest(100 * uses[i].motor, "%", 0),
                    f"{1e3 * np.sum(np.gradient(track.t.time)[full]):.0f} ms",
                    _largest(100 * uses[i].cone, "%", 0),
                    _or_dash(slid, 1e3, "mm"),
                    lowest,
                ]
            )
    heads = ["motion", "leg", "largest torque", "largest share of the limit", "time at the limit"]
    heads += ["largest share of the friction cone", "foot slides", "lowest supply pressure"]
    note = (
        '<p class="soft">The limit is the torque that the motor gives at that speed. At 100 % of '
        "the friction cone a foot begins to slide; a measured foot may show more: its forces are "
        "noisy, or the ground grips better than in the model. The supply is what reaches the "
        "valves: its pressure above the atmosphere as a share of that at the start.</p>"
    )
    return table("Largest use of motors and ground", heads, rows) + note


def energy_parts(book: Book, machine: Machine, certificate: Mapping[str, Any]) -> list[str]:
    """Work in time, and a table of work, impacts and air drawn."""
    cylinder = machine.mechanism.need_cylinder()
    found = [energy_of(t, machine.mechanism.legs, cylinder, certificate) for t in book.tracks]
    rows = [
        [escape(track.name), *_both(one.pistons), *_both(one.hips),
         _or_dash(one.impacts, 1, "J"), _air(one)]
        for track, one in zip(book.tracks, found, strict=True)
    ]  # fmt: skip
    heads = ["motion", "pistons put in", "pistons take out", "hips put in", "hips take out"]
    text = table("Energy", [*heads, "impacts take", "air drawn"], rows)
    work = {"pistons": [one.pistons for one in found], "hips": [one.hips for one in found]}
    charts = [
        book.add(Chart(f"Work of the {name}", "J", _curves(book, values), least=1.0))
        for name, values in work.items()
    ]
    note = (
        '<p class="soft">Work of the pistons: of the force on the rod, after friction and damping. '
        "Air drawn: what the chambers hold more after each time a valve was on, at 20 deg C; 1 l "
        "at atmospheric pressure.</p>"
    )
    return [text, f'<div class="grid">{"".join(charts)}</div>', note]


def _onto(grid: Array, track: Track, values: Array) -> Array:
    """Values by row of a motion at the times of the page."""
    time = track.t.time
    at = np.clip(np.searchsorted(time, grid), 0, len(time) - 1)
    return np.where(np.isfinite(values)[at], onto(grid, time, values), np.nan)


def _largest(values: Array, unit: str, digits: int) -> str:
    known = values[np.isfinite(values)]
    return f"{known.max():.{digits}f} {unit}" if len(known) else "-"


def _or_dash(value: float | None, factor: float, unit: str) -> str:
    known = value is not None and np.isfinite(value)
    return f"{factor * value:.1f} {unit}" if known and value is not None else "-"


def _both(work: Array | None) -> tuple[str, str]:
    """Energy put in, and taken out again."""
    if work is None:
        return "-", "-"
    steps = np.diff(work)
    return f"{steps[steps > 0].sum():.1f} J", f"{-steps[steps < 0].sum():.1f} J"


def _air(one: Energy) -> str:
    if one.drawn is None:
        return "-"
    return f"{1e3 * one.drawn:.2f} g ({one.drawn / NORMAL:.1f} l)"
