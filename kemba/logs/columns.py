"""Column maps: how the columns of another program become ours."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from kemba.config import Section, find_config, load_yaml, parse, shipped_configs
from kemba.errors import ConfigErrors, KembaError
from kemba.quantity import Param, Quantity, convert
from kemba.trajectory import TIME
from kemba.units import read_si, to_si

SEPARATORS = {"tab": "\t", "whitespace": r"\s+"}
Number = float | str
Named = str | int


class AddedColumn(Section):
    """A column that is added to another one: the nanoseconds of a time stamp."""

    source: Named = Field(description="header of the foreign column, or its number from 1")
    unit: str | None = Field(None, description="unit of the foreign column; else our unit")


class ColumnSource(Section):
    """Where a column comes from: ours = sign * scale * source [converted to SI] + offset.

    A column with `threshold` is a valve: 1 where the source lies above it, else 0. Four sources
    are a quaternion x, y, z, w: the pitch that it turns by.
    """

    source: Named | tuple[Named, Named, Named, Named] = Field(
        description="header of the foreign column, or its number from 1; four for a quaternion"
    )
    unit: str | None = Field(None, description="unit of the foreign column; else our unit")
    add: AddedColumn | None = Field(None, description="a second column that is added to the first")
    scale: float = Field(1.0, description="factor")
    sign: Literal[-1, 1] = Field(1, description="-1 where the foreign column counts backwards")
    offset: Number = Field(0.0, description="added last, with a unit: `-90 deg`")
    delay: Annotated[float, Param("s", doc="how late the column is")] = 0.0
    unwrap: bool | None = Field(
        None,
        description="an angle that begins anew after each turn is joined; by its leaps if unsaid",
    )
    threshold: Number | None = Field(
        None, description="of a valve: on above it, in the foreign column's unit"
    )

    @model_validator(mode="after")
    def _threshold_alone(self) -> ColumnSource:
        if self.threshold is not None and (self.scale != 1 or self.offset != 0 or self.add):
            raise ValueError("goes with no scale, offset or second column: 'threshold'")
        if isinstance(self.source, tuple) and (self.unit or self.add or self.threshold is not None):
            raise ValueError("a quaternion goes with no unit, second column or threshold")
        return self

    @property
    def names(self) -> tuple[Named, ...]:
        """The foreign columns that are read."""
        own = self.source if isinstance(self.source, tuple) else (self.source,)
        return (*own, self.add.source) if self.add else own

    def offset_in(self, unit: str) -> float:
        """The offset in our unit. Raises ValueError where its dimension is another."""
        return to_si(self.offset, unit)

    def level(self) -> float:
        """The threshold in the foreign column's own numbers."""
        if isinstance(self.threshold, str):
            return to_si(self.threshold, self.unit) if self.unit else read_si(self.threshold)[0]
        return float(self.threshold or 0.0)


class ColumnMap(Section):
    """A map file: our header (`piston/x [m]`, `time [s]`) -> the foreign column.

    Columns that it does not name are ignored, whatever they hold.
    """

    kind: Literal["robot", "bench", "cylinder", "drive", "vessel"] | None = Field(
        None, description="of log; else by columns"
    )
    notes: str = ""
    separator: str = Field(",", min_length=1, description="`;`, `tab`, `whitespace`, ...")
    decimal: Literal[".", ","] = Field(".", description="the decimal sign")
    skip_rows: int = Field(0, ge=0, description="rows above the header that are no table")
    skip_below: int = Field(0, ge=0, description="rows below the header that are no data: units")
    header: bool | Annotated[int, Field(ge=1, le=9)] = Field(
        True, description="false: no header, sources are column numbers; 2: names in two rows"
    )
    missing: tuple[Number, ...] = Field(
        (), description="texts and numbers that say that there is no reading: `[OVER, 9999]`"
    )
    origin: Literal["first"] | None = Field(
        None, description="`first`: time counts from the first row, as for stamps since 1970"
    )
    columns: dict[str, ColumnSource] = Field(
        min_length=2, description="our header -> foreign column"
    )

    @model_validator(mode="after")
    def _separator_is_not_decimal(self) -> ColumnMap:
        if self.separator == self.decimal:
            raise ValueError(f"separator and decimal sign are both '{self.decimal}'")
        return self

    @property
    def pattern(self) -> str:
        """The separator as pandas takes it."""
        return SEPARATORS.get(self.separator, self.separator)


def load_map(name: str | Path) -> ColumnMap:
    """The map YAML `name`, a path or one shipped in configs/maps. Raises KembaError."""
    path = find_config(str(name), "maps")
    found = parse(load_yaml(path), ColumnMap)
    check_map(found, str(path))
    return found


Columns = ColumnMap | str | Path | None  # a column map, the file of one, or none


def map_of(columns: Columns) -> ColumnMap | None:
    """The map that is given by itself or by its file. Raises KembaError."""
    return load_map(columns) if isinstance(columns, str | Path) else columns


def shipped_maps(names: Collection[str]) -> list[str]:
    """The shipped maps all of whose columns are among `names`."""
    own = {name: load_map(name).columns.values() for name in shipped_configs("maps")}
    return [
        name.removesuffix(".yaml")
        for name, columns in own.items()
        if {source for column in columns for source in column.names} <= set(names)
    ]


def check_map(found: ColumnMap, where: str) -> None:
    """Raise all the errors of a map: no time, a malformed header, a unit that does not fit."""
    errors = []
    if TIME not in found.columns:
        what = f"columns: '{TIME}' is not mapped"
        errors.append(KembaError(where, what, "every log needs its time"))
    for header, source in found.columns.items():
        try:
            unit = "s" if header == TIME else Quantity.from_header(header).unit
            _check_units(source, unit)
            source.offset_in(unit)
            source.level()
        except KembaError as error:
            errors.append(KembaError(where, f"columns: {error.what}", error.expected, error.hint))
        except ValueError as error:
            errors.append(KembaError(where, f"columns: '{header}': {error}"))
    if errors:
        raise ConfigErrors(errors)


def _check_units(source: ColumnSource, ours: str) -> None:
    """Raise ValueError where a unit is unknown or of another dimension, or an offset could be in
    their unit or in ours."""
    for part in (source, source.add):
        unit = part.unit if part is not None else None
        if unit is not None and (part is not source or source.threshold is None):
            try:
                convert(1.0, unit, ours)
            except ValueError as error:
                raise ValueError(f"unit '{unit}' {error}") from None
    bare = not isinstance(source.offset, str) and source.offset != 0.0
    other = source.unit is not None and source.threshold is None
    if bare and other and convert(1.0, source.unit or ours, ours) != 1.0:
        value = f"{source.offset:g}"  # it could be in theirs or in ours
        either = f"'{value} {source.unit}' or '{value} {ours}'"
        raise ValueError(f"offset {value} needs a unit: {either}")
