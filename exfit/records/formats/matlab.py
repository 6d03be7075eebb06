"""MATLAB files, versions 4 to 7.2, by SciPy."""

import hashlib
import io
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats import mat4, mat5
from exfit.records.formats.columns import Columns, sound
from exfit.records.formats.heads import units_of
from exfit.records.formats.memory import MemoryLimit, memory_limit
from exfit.records.formats.table import Array, Table, column_error, read_bytes

HDF5 = b"\x89HDF\r\n\x1a\n"
HDF5_OFFSET = 512  # of the HDF5 signature in a file of version 7.3
MATLAB = "a MATLAB file"
DEEPEST = 8  # structs in structs

NamedVector = tuple[str, NDArray[Any]]


def read_mat(path: Path, memory: float | None = None) -> Table:
    """Return the table of a .mat file: its vectors, and the columns of its matrices.

    Columns are called as in MATLAB: ``Ut`` for a vector, ``data(:,2)`` for a column of a matrix,
    ``s.Ut`` for a field of a struct and ``s(2).Ut`` where there are several. What Simulink saves
    as a structure with time gives ``s.time``, and each of its signals by its label: ``s.Ut``, else
    ``s.signals(1).values``. Scalars are left out. Vectors may differ in length, as long as those
    requested together do not; complex numbers and text are refused when they are requested.

    ``memory`` (GB) is what reading may take. Raises RecordError for a file that is damaged or needs
    more, is of version 7.3 (HDF5), or without any vector.
    """
    limit = memory_limit(path, memory)
    data = read_bytes(path)
    if data.startswith(HDF5) or data[HDF5_OFFSET:].startswith(HDF5):
        raise RecordError(
            f"{path}: version 7.3 (HDF5) is not read; in MATLAB: save('{path.name}', '-v7')"
        )
    vectors = [
        vector
        for name, value in _loaded(path, data, limit).items()
        for vector in _vectors(name, value)
    ]
    names = tuple(name for name, _ in vectors)
    lengths = {name: len(values) for name, values in vectors}
    held = len(data) + sum(values.nbytes for _, values in vectors)
    if not any(_is_real(values) for _, values in vectors):
        raise RecordError(f"{path}: no vector of numbers in it; objects such as timeseries are not")
    return Columns(
        path=path,
        sha256=hashlib.sha256(data).hexdigest(),
        names=names,
        units=units_of(names),
        fetch=lambda at: _numbers(path, *vectors[at]),
        where=lambda row: f"{path}: sample {row + 1}",
        refuse_larger=lambda columns: limit.check_columns(
            [lengths.get(name, 0) for name in columns], held
        ),
    )


def _loaded(path: Path, data: bytes, limit: MemoryLimit) -> dict[str, Any]:
    """Return the variables of the file, in its order."""
    from scipy.io import loadmat

    if mat5.is_mat5(data):
        sound(path, MATLAB, lambda: mat5.check(data, limit))
    elif mat4.is_mat4(data):
        sound(path, MATLAB, lambda: mat4.check(data, limit))
    else:
        raise RecordError(f"{path}: not {MATLAB}, or damaged: no head of version 4 to 7.2")
    stream: Any = io.BytesIO(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of objects that SciPy cannot read
        variables = sound(path, MATLAB, lambda: loadmat(stream))
    return {name: value for name, value in variables.items() if not name.startswith("__")}


def _vectors(name: str, value: Any, depth: int = 0) -> Iterator[NamedVector]:
    """Yield what may be columns in a variable, by name."""
    if not isinstance(value, np.ndarray) or depth > DEEPEST:
        return
    if value.dtype.names:
        yield from _of_structs(name, value, depth)
    elif value.ndim == 2 and value.size > 1 and value.dtype.kind != "O":
        if 1 in value.shape:
            yield name, value.ravel()
        else:
            yield from ((f"{name}(:,{at + 1})", value[:, at]) for at in range(value.shape[1]))
    elif value.ndim == 3 and value.shape[:2] == (1, 1):  # as Simulink saves a scalar signal
        yield name, value.ravel()


def _of_structs(name: str, value: NDArray[Any], depth: int) -> Iterator[NamedVector]:
    """Yield the columns in the fields of a struct, or of several."""
    structs = value.ravel()
    for at, struct in enumerate(structs):
        own = name if structs.size == 1 else f"{name}({at + 1})"
        fields = {field: struct[field] for field in value.dtype.names or ()}
        signals = fields.pop("signals", None) if "time" in fields else None
        for field, inner in fields.items():
            yield from _vectors(f"{own}.{field}", inner, depth + 1)
        if isinstance(signals, np.ndarray) and signals.dtype.names:
            yield from _signals(own, signals, depth)
        elif signals is not None:
            yield from _vectors(f"{own}.signals", signals, depth + 1)


def _signals(name: str, signals: NDArray[Any], depth: int) -> Iterator[NamedVector]:
    """Yield the signals of a structure with time, by their labels where they have one."""
    structs = signals.ravel()
    for at, signal in enumerate(structs):
        fields = signals.dtype.names or ()
        label = _text(signal["label"]) if "label" in fields else ""
        number = f"({at + 1})" if structs.size > 1 else ""
        own = f"{name}.{label}" if label else f"{name}.signals{number}.values"
        if "values" in fields:
            yield from _vectors(own, signal["values"], depth + 1)


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.dtype.kind == "U" and value.size == 1:
        return str(value.ravel()[0]).strip()
    return ""


def _is_real(values: NDArray[Any]) -> bool:
    return values.dtype.kind in "fiub"


def _numbers(path: Path, name: str, values: NDArray[Any]) -> Array:
    if not _is_real(values):
        kind = "complex numbers" if values.dtype.kind == "c" else "text"
        raise column_error(path, name, f"{kind}, not numbers")
    return np.asarray(values, np.float64)
