"""Mirror symmetry: a level task on a symmetric model needs only half of the variables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import casadi as ca
import numpy as np

from kemba.model import Model, Node
from kemba.model.evaluation import Key
from kemba.ocp.task.requirement import Requirement, quantity_expression

Matrix = np.ndarray
PLACES = ("body/x", "hip/x", "knee/x", "foot/x")  # what is turned about the mirror's place


@dataclass(frozen=True)
class Reduction:
    """How a half problem stands for the whole one.

    `B`: matrices (n, nh) with full = B half, for q (and v, a), s, lam and u. `rate`, `pairs`,
    `limits`: indices of the node's rows that the half problem keeps.
    """

    B: dict[str, Matrix]
    rate: list[int]
    pairs: list[int]
    limits: list[int]
    symmetric: bool

    def expand(self, group: str, half: Matrix) -> Matrix:
        """Full values (..., n) of half values (..., nh)."""
        return np.asarray(np.asarray(half) @ self.B[group].T)

    def restrict(self, group: str, full: Matrix) -> Matrix:
        """Half values (..., nh) of symmetric full values (..., n)."""
        b = self.B[group]
        return np.asarray(np.asarray(full) @ (b / np.maximum((b**2).sum(axis=0), 1e-300)))


def whole(node: Node) -> Reduction:
    """No reduction: every variable, every row."""
    sizes = {"q": node.q, "s": node.s, "lam": node.lam, "u": node.u}
    return Reduction(
        {name: np.eye(symbol.numel()) for name, symbol in sizes.items()},
        list(range(node.rate.numel())),
        list(range(node.pair_a.numel())),
        list(range(node.limits.numel())),
        False,
    )


def mirror_names(model: Model) -> dict[str, str]:
    """Mirror image of every variable by column name, "-" prefixed where the sign turns.

    Empty for a mechanism without a mirror, and where an effect acts on one leg only.
    """
    legs = model.mechanism.legs
    names = dict(model.mechanism.mirror)
    if not names:
        return {}
    other: dict[str | None, str | None] = {legs[0]: legs[1], legs[1]: legs[0], None: None}
    groups = (model.states, model.inputs, model.forces)
    quantities = {key: q for group in groups for key, q in group.items()}
    for instance in model.instances:
        for role in ("states", "inputs", "forces"):
            for (leg, symbol), quantity in instance.variables(role).items():
                image = instance.effect.mirror.get(symbol, symbol)
                key = (other[leg], image.lstrip("-"))
                if key not in quantities:
                    return {}
                names[quantity.name] = "-" * image.startswith("-") + quantities[key].name
    rates = {v.name: _rate_image(model, i, names) for i, v in enumerate(model.mechanism.velocities)}
    return {**names, **rates}


def _rate_image(model: Model, index: int, names: Mapping[str, str]) -> str:
    mechanism = model.mechanism
    image = names[mechanism.coordinates[index].name]
    position = [c.name for c in mechanism.coordinates].index(image.lstrip("-"))
    return "-" * image.startswith("-") + mechanism.velocities[position].name


def find_symmetry(model: Model) -> Reduction | None:
    """The half problem of a mirror-symmetric model, or None.

    The mirror that the model declares is checked on its residual at random points.
    """
    names = mirror_names(model)
    if not names:
        return None
    images = image_matrices(model)
    if not _residual_is_symmetric(model, images):
        return None
    B = {name: _basis(matrix) for name, matrix in images.items()}
    return Reduction(B, *_rows_of(model, model.mechanism.legs[0]), True)


def equal_legs(model: Model) -> Reduction | None:
    """One leg for all of them: a robot of more than two legs whose body neither moves along nor
    turns, and whose legs do the same, or its mirror image where their knees fold to the other side.

    What is left out does not vanish, so its plans are starts for the whole robot, no plans. None
    for other robots, and where an effect acts on some legs only.
    """
    mechanism = model.mechanism
    if mechanism.robot is None or len(mechanism.legs) < 3:
        return None
    first, places = mechanism.legs[0], mechanism.robot.legs
    alike = {leg: place.fold == places[first].fold for leg, place in places.items()}
    still = {"body/x", "body/pitch"}
    images = {
        (leg, symbol): instance.effect.mirror.get(symbol, symbol)
        for instance in model.instances
        for role in ("states", "inputs", "forces")
        for leg, symbol in instance.variables(role)
    }

    def followed(keys: Sequence[Key]) -> Matrix | None:
        """Columns (n, nh) for what belongs to no leg or to the first, which the others follow."""
        kept = [key for key in keys if key[0] in (None, first) and key[1] not in still]
        matrix = np.zeros((len(keys), len(kept)))
        for i, (leg, symbol) in enumerate(keys):
            image = symbol if leg is None or alike[leg] else images.get((leg, symbol), f"-{symbol}")
            key = leg and first, image.lstrip("-")
            if symbol not in still and key not in kept:
                return None
            if symbol not in still:
                matrix[i, kept.index(key)] = -1.0 if image.startswith("-") else 1.0
        return matrix

    names = [c.name.partition("/") for c in mechanism.coordinates]
    keys: dict[str, list[Key]] = {
        "q": [(a, c) if a in mechanism.legs else (None, f"{a}/{c}") for a, _, c in names],
        "s": list(model.states), "u": list(model.inputs), "lam": list(model.forces),
    }  # fmt: skip
    B = {group: matrix for group, own in keys.items() if (matrix := followed(own)) is not None}
    return Reduction(B, *_rows_of(model, first), True) if len(B) == len(keys) else None


def _rows_of(model: Model, first: str) -> tuple[list[int], list[int], list[int]]:
    """Indices of the node's rows that belong to no leg but the first: rates, pairs, limits."""
    others, node = [leg for leg in model.mechanism.legs if leg != first], model.node

    def kept(labels: list[str]) -> list[int]:
        return [i for i, label in enumerate(labels) if not any(leg in label for leg in others)]

    return (
        kept([row.label for row in node.rate_rows]),
        kept([row.label for row, _ in node.pair_rows]),
        kept([row.label for row in node.limit_rows]),
    )


def met_alike(
    model: Model, requirements: Sequence[Requirement], reduction: Reduction
) -> list[Requirement]:
    """The requirements of quantities that `equal_legs` can change."""
    rng = np.random.default_rng(2)
    names = list(dict.fromkeys(w.quantity.name for w in requirements))
    values = _values(model, names)
    q = np.array([model.mechanism.standing[c.name] for c in model.mechanism.coordinates])

    def drawn() -> Matrix:
        sizes = {group: matrix.shape[1] for group, matrix in reduction.B.items()}
        full = {g: reduction.expand(g, rng.uniform(0.1, 1.0, size)) for g, size in sizes.items()}
        rates = reduction.expand("q", rng.normal(size=sizes["q"]))
        point = (q + 0.1 * full["q"], rates, full["s"], full["lam"], full["u"])
        return np.array(values(*point)).ravel()

    changes = np.ptp([drawn() for _ in range(3)], axis=0) > 1e-9
    return [w for w in requirements if changes[names.index(w.quantity.name)]]


def _values(model: Model, names: Sequence[str]) -> ca.Function:
    """Quantities (names,) by q, v, s, lam and u."""
    node, wanted = model.node, [quantity_expression(model, name) for name in names]
    return ca.Function("values", [node.q, node.v, node.s, node.lam, node.u], [ca.vertcat(*wanted)])


def image_matrices(model: Model) -> dict[str, Matrix]:
    """The mirror as signed permutations of q, s, lam and u; the model must have one."""
    names = mirror_names(model)
    columns = {group: [q.name for q in model.groups[group]] for group in ("q", "s", "lam", "u")}
    return {group: _image_matrix(own, names) for group, own in columns.items()}


def _image_matrix(columns: list[str], names: Mapping[str, str]) -> Matrix:
    matrix = np.zeros((len(columns), len(columns)))
    for i, column in enumerate(columns):
        image = names[column]
        matrix[columns.index(image.lstrip("-")), i] = -1.0 if image.startswith("-") else 1.0
    return matrix


def _basis(image: Matrix) -> Matrix:
    """Columns that span the symmetric subspace: each variable with its image, once."""
    columns: list[Matrix] = []
    for i in range(len(image)):
        column = np.sign(np.eye(len(image))[:, i] + image[:, i])
        if np.any(column) and not any(np.array_equal(np.abs(column), np.abs(c)) for c in columns):
            columns.append(column)
    return np.array(columns).T if columns else np.zeros((len(image), 0))


def _residual_is_symmetric(model: Model, images: Mapping[str, Matrix]) -> bool:
    residual, rng = model.node.residual, np.random.default_rng(0)
    standing = np.array([model.mechanism.standing[c.name] for c in model.mechanism.coordinates])
    for _ in range(3):
        draw = {key: rng.uniform(0.1, 1.0, len(image)) for key, image in images.items()}
        q = standing + 0.1 * draw["q"]
        v, a = rng.normal(size=len(q)), rng.normal(size=len(q))
        s = draw["s"] * [x.scale for x in model.states.values()]
        sd = draw["s"][::-1].copy()
        lam, u = draw["lam"] * 50.0, draw["u"]
        m, point = images, (q, v, a, s, sd, lam, u)
        motion = (_mirrored(model, m, q), m["q"] @ v, m["q"] @ a)
        image = (*motion, m["s"] @ s, m["s"] @ sd, m["lam"] @ lam, m["u"] @ u)
        here, there = (
            [np.array(part).ravel() for part in residual(*at, [])] for at in (point, image)
        )
        same = [(m["q"] @ here[0], there[0]), (m["s"] @ here[1], there[1])]
        same.append((np.sort(here[2] * here[3]), np.sort(there[2] * there[3])))  # of pairs
        same.append((np.sort(here[4]), np.sort(there[4])))  # of limits
        if not all(np.allclose(*pair) for pair in same):
            return False
    return True


def _mirrored(model: Model, images: Mapping[str, Matrix], q: Matrix) -> Matrix:
    """Coordinates (n,) in the mirror that stands where the mechanism stands."""
    origin = np.array(model.mechanism.origin)
    return np.asarray(origin + images["q"] @ (q - origin))


def requirements_are_symmetric(model: Model, requirements: Sequence[Requirement]) -> bool:
    """Whether every requirement has its mirror image among the requirements."""
    return len(mirrored_requirements(model, requirements)) == len(requirements)


def mirrored_requirements(model: Model, requirements: Sequence[Requirement]) -> list[Requirement]:
    """The requirements whose mirror image is required too, tried at a random point."""
    images = image_matrices(model)
    parts = [[w.quantity.name, *([w.minus.name] if w.minus else ())] for w in requirements]
    names = list(dict.fromkeys(name for part in parts for name in part))
    values, rng = _values(model, names), np.random.default_rng(1)
    q = [model.mechanism.standing[c.name] for c in model.mechanism.coordinates]
    draw = {k: rng.uniform(0.1, 1.0, len(m)) for k, m in images.items()}
    point = {**draw, "q": q + 0.1 * draw["q"], "v": rng.normal(size=len(q))}
    image = {k: images.get(k, images["q"]) @ x for k, x in point.items()}
    image["q"] = _mirrored(model, images, point["q"])
    order = ("q", "v", "s", "lam", "u")
    zero = np.array([model.mechanism.origin[0] * name.endswith(PLACES) for name in names])
    here = np.array(values(*(point[k] for k in order))).ravel() - zero
    there = np.array(values(*(image[k] for k in order))).ravel() - zero

    def beyond(w: Requirement) -> tuple[float, float]:
        at = 0.0 if w.minus else float(zero[names.index(w.quantity.name)])
        return w.lower - at, w.upper - at

    asked = {
        (*(names.index(name) for name in part), *_when(w), *beyond(w))
        for w, part in zip(requirements, parts, strict=True)
    }

    def images_of(w: Requirement, sign: int) -> set[tuple[object, ...]]:
        part = [w.quantity.name, *([w.minus.name] if w.minus else ())]
        alike = [np.flatnonzero(np.isclose(here, sign * there[names.index(n)])) for n in part]
        lower, upper = beyond(w)
        ends = (lower, upper) if sign > 0 else (-upper, -lower)
        return {(*each, *_when(w, sign), *ends) for each in product(*alike)}

    return [w for w in requirements if asked & (images_of(w, 1) | images_of(w, -1))]


def _when(w: Requirement, sign: int = 1) -> tuple[object, ...]:
    """When a requirement holds, and whether the quantity or its negative is to be large."""
    return w.at, w.minus and w.minus.at, w.during, sign * w.aim
