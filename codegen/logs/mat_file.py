"""MATLAB logs up to format 7 (7.3 is HDF5): vectors as columns of a log, alone, in a struct or in a matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.logs.description import LogDescription
from codegen.logs.hdf5_file import is_hdf5, open_hdf5
from codegen.logs.log import Array
from codegen.logs.mat_elements import Variable, variables
from codegen.logs.source import Allowance, Columns, Source, Unannotated, listing, read_bytes, shown

EXPECTED = "a MATLAB file (.mat) with one vector a column"


@dataclass(frozen=True)
class MatSource(Unannotated):
    """An opened .mat file.

    Attributes:
        file: name of the file.
        variables: by name.
    """

    file: str
    variables: Mapping[str, Variable]

    @property
    def names(self) -> tuple[str, ...]:
        """Every variable, field of a struct and column of a matrix; ``load`` refuses those that are no vectors."""
        return tuple(self.variables)

    @property
    def place(self) -> Place:
        return Place(self.file)

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted vectors.

        Raises:
            BadInput: for a variable that is not a real vector, or vectors of different length.
        """
        vectors = [self._vector(name) for name in wanted]
        length = len(vectors[0])
        for name, vector in zip(wanted, vectors, strict=True):
            if len(vector) != length:
                found = f"{len(vector)} values"
                raise BadInput(
                    Place(self.file, None, shown(name)),
                    found,
                    f"{length} values as in `{shown(wanted[0])}`",
                    code="LOG011",
                )
        return Columns(self.file, tuple(wanted), np.column_stack(vectors), None)

    def _vector(self, name: str) -> Array:
        variable = self.variables[name]
        place = Place(self.file, None, shown(name))
        words = "×".join(map(str, variable.shape))
        if not variable.numeric:
            inside = [other for other in self.variables if other.startswith((f"{name}.", f"{name}("))]
            expected = f"a vector of real numbers{f', such as {listing(inside, 5)} in it' if inside else ''}"
            raise BadInput(place, f"a {variable.kind} of {words}", expected, code="LOG005")
        if 0 in variable.shape:
            raise BadInput(place, f"an empty array ({words})", "a vector of real numbers", code="LOG005")
        if sum(n != 1 for n in variable.shape) > 1:
            lines = [one.name for one in variable.lines()]
            expected = f"a vector (N×1 or 1×N){f', such as `{lines[0]}` to `{lines[-1]}` of it' if lines else ''}"
            raise BadInput(place, f"an array of {words}", expected, code="LOG005")
        return variable.vector()


def open_mat(path: Path, allowance: Allowance, description: LogDescription) -> Source:
    """Open a .mat file.

    Raises:
        BadInput: if it cannot be read, is damaged, holds no vector or too much.
    """
    file = str(path)
    if is_hdf5(path):
        return open_hdf5(path, allowance, description)
    data = read_bytes(path, EXPECTED)
    try:
        given = variables(data, partial(allowance.take, path, expected=EXPECTED))
        found = {one.name: one for v in given if v.name for one in (v, *v.lines())}
    except ValueError as error:
        raise BadInput(Place(file), f"a damaged file ({shown(str(error), 120)})", EXPECTED, code="LOG001") from None
    if not any(v.numeric and sum(n != 1 for n in v.shape) == 1 for v in found.values()):
        words = listing([f"{v.name} ({v.kind} {'×'.join(map(str, v.shape))})" for v in found.values()])
        raise BadInput(
            Place(file), f"no vector among the variables {words}" if found else "no variable", EXPECTED, code="LOG001"
        )
    return MatSource(file, found)
