"""What the words in a column's name may mean."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np

from kemba.logs.foreign import pitch
from kemba.trajectory import Array
from kemba.units import parse_unit

# Of one group a column has one meaning. English, the usual short forms, and some of the words of
# other languages in which laboratories name columns.
WORDS: dict[str, dict[str, str]] = {
    "part": {
        "hip": "hip hips motor qdd huefte hüfte hüft hueft hüftgelenk qm tm hanche cadera anca "
        "股関節 髋 髋关节",
        "piston": "piston pistons cylinder cylinders cyl knee rod actuator kolben zylinder zyl xp "
        "fp vérin verin cilindro シリンダ シリンダー 气缸",
        "body": "body base torso trunk com boom imu pelvis rumpf floating corps cuerpo corpo tronc "
        "胴体 机身",
        "foot": "foot feet toe grf ground fuss fuß pied pie piede 足",
        "valve": "valve valves vlv sol solenoid ventil magnetventil u ue ur vanne électrovanne "
        "electrovanne valvula válvula valvola 電磁弁 バルブ 阀 电磁阀",
        "supply": "supply tank reservoir feed regulator line",
        "axis": "axis drive slide carriage shaft",
    },
    "kind": {
        "position": "q x pos position ang angle theta enc encoder stroke travel displacement "
        "winkel weg laser lvdt pot potentiometer qm xp height course angulo ángulo angolo posicion "
        "posición posizione 位置 角度 位移",
        "torque": "tau torque trq tq effort moment drehmoment tm couple par coppia momento トルク "
        "力矩",
        "force": "f force load loadcell cell kraft transducer grf fp fx fy fz fuerza forza 力",
        "pressure": "p pressure press druck relativdruck absolutdruck pression presion presión "
        "pressione 圧力 压力",
        "speed": "v vel velocity speed rate dx dy dz dq qd dot xdot ydot zdot vx vy vz xd yd zd "
        "omega gyro wm geschwindigkeit twist vitesse velocidad velocità velocita 速度",
        "acceleration": "a acc accel acceleration ax ay az ddx ddy ddz ddq ddot beschleunigung",
        "temperature": "temperature temp temperatur",
        "other": "current currents amp amps volt volts voltage power energy "
        "status flag mode error err residual fault id count counter seq checksum battery duty pwm "
        "covariance variance std sigma",
    },
    "direction": {
        "x": "x horizontal horizontale forward vorschub vx ax fx dx ddx xdot xd tx",
        "z": "z height vertical hoehe höhe altitude hauteur altura altezza "
        "高さ 高度 vz az fz dz ddz zdot zd tz",
        "y": "y vy ay fy dy ddy ydot yd ty",
        "pitch": "pitch tilt theta nick nickwinkel neigung r tangage cabeceo beccheggio "
        "ピッチ 俯仰",
        "roll": "roll phi wank rollwinkel",
        "yaw": "yaw psi heading gier gierwinkel",
    },
    "side": {
        "extend": "extend ext extension ausfahren aus push out cap head ue 1 a sortie extender "
        "estensione 伸 伸出",
        "retract": "retract ret retraction einfahren ein pull in rod ur 2 b rentrée rentree "
        "retraer rientro 縮 缩回",
    },
    "role": {
        "desired": "des desired ref reference target setpoint sp goal soll planned plan cmd "
        "command commanded demand demanded request requested wanted traj trajectory expected "
        "estimate est estimated predicted model sim",
        "measured": "meas measured measurement actual act ist fb feedback sensor",
    },
}
TIMES = (
    "t time timestamp stamp clock epoch elapsed zeit zeitstempel uhrzeit datum date datetime sec "
    "secs tout millis micros uptime temps tiempo tempo datenum 時刻 時間 时间"
)
FILLERS = frozenset(
    "robot header state states joint joints data value values m s log sensors topic float double "
    "int bool du de la le des della del di".split()
)
# what a quantity was read by: it tells columns of one quantity apart, and makes none the better one
SENSORS = frozenset(
    "laser lidar enc encoder imu motor joint qdd mocap vicon optitrack camera ekf kf odom boom "
    "lvdt pot potentiometer".split()
)
LEG_WORDS = {
    "front": "front f fore fr vorn vorne vo avant delantera anteriore ant 前",
    "rear": "rear back hind b r h hinten hi arrière arriere trasera posteriore post 後 后",
    "left": "left l links gauche 左",
    "right": "right r rechts droite 右",
}
ANGLES = frozenset("angle ang theta winkel".split())
ORDER = ("acceleration", "speed")  # a rate of a position is no position
SPELT = {
    "degrees": "deg", "degree": "deg", "Grad": "deg", "grad": "deg", "°": "deg", "radians": "rad",
    "dps": "deg/s", "mps": "m/s", "meters": "m", "metres": "m", "seconds": "s", "newton": "N",
    "C": "degC", "rad_s": "rad/s", "deg_s": "deg/s", "m_s": "m/s", "mm_s": "mm/s", "m_s2": "m/s2",
    "Nmm": "N.mm", "kgfm": "kgf.m", "kgf-m": "kgf.m", "lbft": "lbf.ft", "cNm": "cN.m",
    "mdeg": "deg/1000", "daN": "N*10", "oz-in": "ozf.in",
    **dict.fromkeys("ft-lb ft-lbs ft-lbf lb-ft lbf-ft".split(), "lbf.ft"),
    **dict.fromkeys("in-lb in-lbs in-lbf lb-in lbf-in".split(), "lbf.in"),
    **dict.fromkeys("millimeter millimetre millimeters millimetres".split(), "mm"),
    **dict.fromkeys("centimeter centimetre centimeters centimetres".split(), "cm"),
    **dict.fromkeys(("newtonmeter", "newtonmetre", "newton meters", "newton metres"), "N.m"),
}  # fmt: skip
# a pressure that counts from that of the air, or from none: `barg`, `psi (abs)`, `MPaG`, `bar_ü`
PRESSURE = re.compile(
    r"(?<![A-Za-z])([mk]?bar|psi|[kMh]?Pa)"
    r"(?:\(?([gGaA])\)?|[ _]*\(?(gauge|rel|abs|ü|Ü)\)?)?(?!\w)"
)
AIR = {True: frozenset("gauge g rel relative relativ relativdruck ü überdruck".split()),
       False: frozenset("abs absolute absolut absolutdruck a".split())}  # fmt: skip
CAPITALS = {
    u.upper(): SPELT.get(u, u)
    for u in "mm cm um us ms deg mdeg rad mrad bar mbar psi kPa MPa kN".split()
} | {"NM": "N.m", "MNM": "mN.m"}
UNITS = (
    "ns us µs ms s min um mm cm m in ft deg rad mrad rev turns gon bar mbar kPa MPa Pa psi kN N mN "
    "kgf lbf Nm N.m mN.m mNm mV V K degC"
).split()
INSIDE = frozenset("mm cm deg rad mrad bar mbar kPa MPa Pa psi kN Nm".split())
SWITCHED = frozenset("extend retract ausfahren einfahren".split())  # what valves are told to do
NEGATED = frozenset("closed inverted inv negated not geschlossen zu".split())
COUNTED = frozenset("counts cnt ticks pulses adc lsb".split())  # what a converter gave, no unit
# of minutes, inches, per mille, and factors alone: `[1/100]`
UNIT_MARK = re.compile(r"['\"′″‰]+|[\d\s.]*[/^]\s*-?\d+")
# of a number by which a reading may have been multiplied, or its unit: `[m*1000]`, `pos_x100`
FACTOR = re.compile(r"[*×·] ?\d[\d.e]*|(?<![^\W_])x ?(?:10+|1e\d)(?![^\W_])")
LEGS_IN_BRACKETS = frozenset("L R F B H A".split())  # `(L)` is the left one, not litres
BRACKETS = re.compile(r"\s*(?:\[([^\[\]]*)\]|[({<]([^(){}<>]*)[)}>])")
BEFORE_ANY = (" in ", " / ", ", ", " - ")  # marks before a unit: `Kraft in kN`, `v / mm/s`
BEFORE_USUAL = (" ", "/", ",", ":", ".")  # before one of the usual: `Weg mm`, `F/kN`, `pos.mm`
CAMEL = re.compile(r"(.*[a-z\d])([A-Z][A-Za-z]+)")  # `positionMm`
FLOWS = "valve valves vlv sol solenoid pressure press p"  # what goes `in`, not in inches
WORD = re.compile(r"[A-Z]?(?:[^\W\d_A-Z]|°)+|[A-Z]+(?![a-z])|\d+")
AXES = frozenset("xyz")
Meaning = dict[str, set[str]]


@dataclass(frozen=True)
class Names:
    """The names of a log's columns: the machine's legs, what headerless columns are called, units
    that the file states apart (`below`: those that are none too), columns that say `on` and `off`,
    and the unit of all angles."""

    legs: Sequence[str] = ()
    labels: Mapping[str, str] = field(default_factory=dict)
    below: Mapping[str, str] = field(default_factory=dict)
    switches: Collection[str] = ()
    columns: Collection[str] = ()
    angles: str = ""

    def unit(self, name: str) -> str | None:
        """The unit that a column's name tells, else the one that the file states."""
        stated = self.below.get(name, "")
        return named_unit(self.labels.get(name, name))[1] or (stated if is_unit(stated) else None)

    def from_air(self, name: str) -> bool | None:
        """Whether a pressure counts from that of the air; None where nothing tells."""
        text = f"{self.labels.get(name, name)} {self.below.get(name, '')}"
        said = {word for word in words(text) if len(word) > 1}
        for match in PRESSURE.finditer(text):
            said.add((match[2] or match[3] or "").lower())
        found = [counts for counts, known in AIR.items() if said & known]
        return found[0] if len(found) == 1 else None

    def bare(self, name: str) -> str:
        """A column's name, or what it is called where it has none, without the unit."""
        return named_unit(self.labels.get(name, name))[0]

    def says(self, name: str, sensors: bool = True) -> Meaning:
        """What a column's name may mean: per group, the candidates of its words, those for sensors
        among them or not. `y` is up where no column is `z`; the angle about it is the pitch."""
        bare = self.bare(name)
        found = meaning(bare if sensors else without_sensors(bare), self.legs)
        direction = found.get("direction", set())
        if "y" in direction:
            turning = set(words(name)) & {"rpy", "euler"}
            up = "pitch" if turning else "z" if not self._spatial else "y"
            found["direction"] = {up if d == "y" else d for d in direction}
        return found

    @cached_property
    def _spatial(self) -> bool:
        """Whether there is a position along z, or y and z of another kind: an accelerometer's z
        beside positions x and y tells nothing."""
        vertical = set(WORDS["direction"]["z"].split()) - {"height", "vertical", "altitude"}
        along_y, along_z = (
            {
                kind
                for name in map(self.bare, self.columns)
                if set(words(name)) & axis
                for kind in meaning(name, self.legs).get("kind") or {"position"}
            }
            for axis in (set(WORDS["direction"]["y"].split()), vertical)
        )
        return bool(along_z & {"position", *along_y})


def spelt(text: str) -> str:
    """A unit as pint spells it: `barg` and `bar (abs)` are bar, `MM` is mm."""
    text = text.strip()
    if match := PRESSURE.fullmatch(text):
        text = match[1]
    return SPELT.get(text, CAPITALS.get(text, SPELT.get(text.lower(), text)))


def words(name: str) -> list[str]:
    """The words of a name, in small letters; one that is joined of known ones is these:
    `hiptorque`, `Kolbenweg`, and names of languages without blanks."""
    return [part for word in WORD.findall(name) for part in _parted(word.lower())]


@cache
def _parted(word: str) -> tuple[str, ...]:
    """The known words that a word is joined of; itself where it is known, or is of others."""
    known = _vocabulary()
    if word in known or len(word) < 2:
        return (word,)
    found: dict[int, tuple[str, ...]] = {0: ()}
    for end in range(1, len(word) + 1):
        for begin in range(end):
            part = word[begin:end]
            joins = len(part) > 2 or not part.isascii() or (end == len(word) and part in AXES)
            if begin in found and joins and part in known:
                longer = (*found[begin], part)
                if end not in found or len(longer) < len(found[end]):
                    found[end] = longer
    return found.get(len(word), (word,))


@cache
def _vocabulary() -> frozenset[str]:
    groups = [*(known for group in WORDS.values() for known in group.values()), *LEG_WORDS.values()]
    return frozenset(" ".join([*groups, TIMES]).split()) | FILLERS


def named_unit(name: str) -> tuple[str, str | None]:
    """A column's name without its unit, and the unit: of `pos [mm]`, `pos (mm)`, `pos_mm`,
    `pos in mm`, `pos/mm`, `posMm`. What stands there and is no unit belongs to the name."""
    for match in reversed(list(BRACKETS.finditer(name))):
        square = match[1] is not None
        text = (match[1] if square else match[2]).strip()
        unit = spelt(text)
        spaced = match[0][:1] == " "
        if is_unit(unit, indexed=not spaced) and (square or unit not in LEGS_IN_BRACKETS):
            return (name[: match.start()] + name[match.end() :]).strip(), unit
    for mark in BEFORE_ANY:
        head, _, tail = name.rpartition(mark)
        strange = len(tail) == 1 or tail.lower() in ("foot", "feet")
        if head and (tail in UNITS or (not strange and is_unit(spelt(tail), indexed=True))):
            return head.strip(), spelt(tail)
    pieces = name.split("_")
    for width in (2, 1):
        head, tail = "_".join(pieces[:-width]), "_".join(pieces[-width:])
        if head and pieces[0] and (spelt(tail) != tail or (width == 1 and _is_usual(head, tail))):
            return head, spelt(tail)
    for mark in BEFORE_USUAL:
        head, _, tail = map(str.strip, name.rpartition(mark))
        short = len(tail) == 1 and (mark == "." or tail not in "smN°")
        path = mark == "/" and ("/" in head or not head)
        known = spelt(tail) != tail or tail in UNITS
        if head and known and not (short or path or tail in ("in", "min")):
            return head, spelt(tail)
    if (camel := CAMEL.fullmatch(name)) and camel[2].upper() in CAPITALS:
        return camel[1], CAPITALS[camel[2].upper()]
    inside = [piece for piece in pieces[1:] if piece in INSIDE]
    if len(inside) == 1:
        return "_".join(piece for piece in pieces if piece != inside[0]), inside[0]
    return name, None


def _is_usual(head: str, tail: str) -> bool:
    """Whether what stands behind a name is a usual unit or a rate of units, and no `valve_in`."""
    rate = "/" in tail and is_unit(tail)
    return (rate or tail in UNITS) and not (tail == "in" and set(words(head)) & set(FLOWS.split()))


def is_unit(text: str, indexed: bool = False) -> bool:
    """Whether a text is a unit; `indexed`: a bare number is the place in an array."""
    if not _lettered(text) and (indexed or text != "1"):
        return False
    try:
        parse_unit(text)
    except ValueError:
        return False
    return True


def _lettered(text: str) -> bool:
    return any(sign.isalpha() or sign in "°%" for sign in text)


def strange_unit(name: str, legs: Sequence[str]) -> str | None:
    """What stands like a unit and is none that is known: `pos [foo]`, `pos_counts`."""
    if (last := words(name)[-1:]) and last[0] in COUNTED:
        return last[0]
    for match in BRACKETS.finditer(name):
        text = (match[1] or match[2] or "").strip()
        marked = bool(UNIT_MARK.fullmatch(text))
        if not (marked or _lettered(text)) or named_unit(name)[1] is not None:
            continue
        if marked or unknown(text, legs):
            return text
    return None


def meaning(name: str, legs: Sequence[str]) -> Meaning:
    """What a name may mean: per group, the candidates that its words stand for. Single letters
    count where no longer word of their group does, a rate before what it is the rate of."""
    said = words(name)
    found: Meaning = {}
    for group, entries in _groups(legs).items():
        hits = {
            entry: max(map(len, own))
            for entry, known in entries.items()
            if (own := set(said) & {*known.split(), entry})
        }
        if any(length > 1 for length in hits.values()):
            hits = {entry: length for entry, length in hits.items() if length > 1}
        if group == "kind":
            first = next((kind for kind in ORDER if kind in hits), None)
            hits = {first: 1} if first else hits
            if len(hits) > 1 and set(said) & set(WORDS["kind"]["other"].split()) <= {"current"}:
                hits.pop("other", None)  # the `current position` is no electric one
        if hits:
            found[group] = set(hits)
    if "other" in found.get("kind", ()):
        found["kind"] = {"other"}
    if found.get("part", set()) & {"hip", "piston", "foot", "valve"}:
        _without_leg(found, said, legs)
    if SWITCHED & set(said) and not {"part", "kind"} & found.keys():
        found["part"] = {"valve"}
    if "valve" in found.get("part", ()) and len(found["part"]) > 1 and "u" in said:
        found["part"] -= {"valve"}
    return found


def _without_leg(found: Meaning, said: Sequence[str], legs: Sequence[str]) -> None:
    """Of a part of a leg, take the letter of its leg for nothing else: `CYL_POS_R` is no pitch."""
    letters = {w for leg in legs for w in LEG_WORDS.get(leg, "").split() if len(w) == 1} & set(said)
    for group in ("direction", "kind"):
        by_letter = {e for e in found.get(group, ()) if letters & set(WORDS[group][e].split())}
        rest = {w for w in said if w not in letters}
        alone = {e for e in by_letter if not rest & set(WORDS[group][e].split())}
        if alone:
            found[group] -= alone
            if not found[group]:
                del found[group]


def without_sensors(name: str) -> str:
    """A name without the words that say what it was read by."""
    return WORD.sub(lambda m: "" if m[0].lower() in SENSORS else m[0], name)


def unknown(name: str, legs: Sequence[str]) -> int:
    """How many words of a name say nothing that is known here."""
    known = {
        w
        for group in _groups(legs).values()
        for entry, w_ in group.items()
        for w in (entry, *w_.split())
    }
    return len([w for w in words(name) if w not in known and w not in FILLERS and not w.isdigit()])


def says_time(name: str) -> bool:
    """Whether a name calls a time."""
    return bool(set(words(named_unit(name)[0])) & set(TIMES.split()))


def _groups(legs: Sequence[str]) -> dict[str, dict[str, str]]:
    return {**WORDS, "leg": {leg: LEG_WORDS.get(leg, leg.lower()) for leg in legs}}


QUATERNION = re.compile(r"(?P<stem>.*?)(?P<mark>[qQ](?:uat)?_?)?(?P<axis>[xyzwXYZW])")
NUMBERED = re.compile(r"(?P<stem>.*?q)[\[_/]?(?P<axis>[0-3])\]?")  # w first, as in PX4
UNIT_NORM = 0.02


def quaternions(
    values: Mapping[str, Array], names: Names
) -> tuple[dict[str, Array], Names, dict[str, tuple[str, ...]]]:
    """The columns (n,) without those of quaternions, instead of each the pitch that it is, and the
    four columns x, y, z, w of each pitch. Four that are numbered are one only where the first
    is the larger of the outer two: else w may be the last."""
    found: dict[str, dict[str, str]] = {}
    numbered = set()
    for name in values:
        bare = named_unit(name)[0]
        match = QUATERNION.fullmatch(bare)
        number = NUMBERED.fullmatch(bare)
        if match:
            stem = f"{match['stem']}{match['mark'] or ''}"
            found.setdefault(stem, {})[match["axis"].lower()] = name
        elif number:
            numbered.add(number["stem"])
            found.setdefault(number["stem"], {})["wxyz"[int(number["axis"])]] = name
    left, labels, turned = dict(values), dict(names.labels), {}
    for stem, parts in found.items():
        if set(parts) != set("xyzw"):
            continue
        four = tuple(parts[axis] for axis in "xyzw")
        norm = np.sqrt(sum(values[name] ** 2 for name in four))
        if np.mean(np.abs(norm[np.isfinite(norm)] - 1.0) < UNIT_NORM) < 0.99:
            continue
        last, first = (np.nanmedian(np.abs(values[name])) for name in four[2:])
        if stem in numbered and first < last:
            continue
        for name in four:
            left.pop(name)
        label = f"{stem} (pitch of the quaternion)"
        left[label] = pitch(*(values[name] for name in four))
        labels[label], turned[label] = f"{stem}_pitch_derived", four
    below = {**names.below, **dict.fromkeys(turned, "rad")}
    return left, replace(names, labels=labels, below=below, columns=tuple(left)), turned


def upright(values: Mapping[str, Array], names: Names) -> tuple[Names, list[str]]:
    """Which of the columns (n,) y and z is up: z, unless it stays about zero while y does not."""
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
