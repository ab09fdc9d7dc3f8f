"""MATLAB logs up to format 7 (7.3 is HDF5): vectors as columns of a log, alone, in a struct or in a matrix."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from codegen.base.arrays import Array
from codegen.base.input_files import opened
from codegen.base.user_text import shown
from codegen.logs.description import LogDescription
from codegen.logs.hdf5_file import MAGIC, Hdf5File
from codegen.logs.mat_elements import OBJECT, variables
from codegen.logs.source import LARGEST_STREAM, Allowance, Columns, LogFile, listing

UNPACKED = "in MATLAB, of a timeseries `t = ts.Time; q = ts.Data; save log t q`"


class MatFile(LogFile):
    """An opened .mat file: its variables, fields of structs and columns of matrices; vectors can be loaded."""

    expected = "a MATLAB file (.mat) with one vector a column"

    def find(self) -> None:
        try:
            given = variables(self.read_bytes(), self.take)
            self._variables = {one.name: one for v in given if v.name for one in (v, *v.lines())}
        except ValueError as error:
            raise self.fault(f"a damaged file ({shown(str(error), 120)})") from None
        self.names = tuple(self._variables)
        found = self._variables.values()
        if not any(v.numeric and sum(n != 1 for n in v.shape) == 1 for v in found):
            words = listing([f"{v.name} ({v.kind} {'×'.join(map(str, v.shape))})".replace(" )", ")") for v in found])
            expected = f"{self.expected}; {UNPACKED}" if any(v.kind.startswith(OBJECT) for v in found) else ""
            raise self.fault(f"no vector among the variables {words}" if found else "no variable", expected)

    def load(self, wanted: Sequence[str]) -> Columns:
        vectors = {name: self._vector(name) for name in wanted}
        self.require_equal({name: len(vector) for name, vector in vectors.items()})
        return Columns(str(self.path), tuple(wanted), np.column_stack([vectors[name] for name in wanted]))

    def _vector(self, name: str) -> Array:
        variable = self._variables[name]
        words = "×".join(map(str, variable.shape))
        if not variable.numeric:
            inside = [other for other in self.names if other.startswith((f"{name}.", f"{name}("))]
            if variable.kind.startswith(OBJECT):
                raise self.fault(f"an {variable.kind}", f"a vector of real numbers; {UNPACKED}", name, "LOG005")
            expected = f"a vector of real numbers{f', such as {listing(inside, 5)} in it' if inside else ''}"
            raise self.fault(f"a {variable.kind} of {words}", expected, name, "LOG005")
        if 0 in variable.shape:
            raise self.fault(f"an empty array ({words})", "a vector of real numbers", name, "LOG005")
        if sum(n != 1 for n in variable.shape) > 1:
            lines = [one.name for one in variable.lines()]
            expected = f"a vector (N×1 or 1×N){f', such as `{lines[0]}` to `{lines[-1]}` of it' if lines else ''}"
            raise self.fault(f"an array of {words}", expected, name, "LOG005")
        return variable.vector()


def open_mat(path: Path, allowance: Allowance, description: LogDescription) -> LogFile:
    """Open a .mat file of either kind; one of format 7.3 is HDF5, perhaps behind 512 bytes of MATLAB's."""
    with opened(path, MatFile.expected, LARGEST_STREAM) as stream:
        head = stream.read(512 + len(MAGIC))
    kind = Hdf5File if MAGIC in (head[:8], head[512:]) else MatFile
    return kind(path, allowance, description)
