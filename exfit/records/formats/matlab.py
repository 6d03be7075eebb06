"""MATLAB files, versions 4 to 7.2, by SciPy."""

import hashlib
import io
import struct
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.cells import units_of
from exfit.records.formats.columns import Columns, sound
from exfit.records.formats.table import column_error, read_bytes

HEAD, TAG = 128, 8  # bytes of a file's head and of an element's, in version 5
ORDERS = {b"IM": "<", b"MI": ">"}  # of bytes, by the last two of the head
HDF5 = b"\x89HDF\r\n\x1a\n"
HDF5_OFFSET = 512  # of the HDF5 signature in a file of version 7.3
MATLAB = "a MATLAB file"
DEEPEST = 8  # structs in structs
REAL = "fiub"  # kinds of arrays of numbers

NamedVector = tuple[str, NDArray[Any]]


def read(path: Path) -> Columns:
    """Read a .mat file: its vectors, and the columns of its matrices.

    Columns are called as in MATLAB: ``Ut`` for a vector, ``data(:,2)`` for a column of a matrix,
    ``s.Ut`` for a field of a struct and ``s(2).Ut`` where there are several. What Simulink saves
    as a structure with time gives ``s.time``, and each of its signals by its label: ``s.Ut``, else
    ``s.signals(1).values``. Scalars are left out. Vectors may differ in length, as long as those
    requested together do not; complex numbers and text are refused when they are requested.

    Raises RecordError for a file that is damaged, of version 7.3 (HDF5), or without any vector.
    """
    data = read_bytes(path)
    if data.startswith(HDF5) or data[HDF5_OFFSET:].startswith(HDF5):
        raise RecordError(
            f"{path}: version 7.3 (HDF5) is not read; in MATLAB: save('{path.name}', '-v7')"
        )
    variables = _loaded(path, data).items()
    vectors = [vector for name, value in variables for vector in _vectors(name, value)]
    names = tuple(name for name, _ in vectors)
    if not any(values.dtype.kind in REAL for _, values in vectors):
        raise RecordError(f"{path}: no vector of numbers in it; objects such as timeseries are not")

    def fetch(at: int) -> NDArray[Any]:
        name, values = vectors[at]
        if values.dtype.kind not in REAL:
            kind = "complex numbers" if values.dtype.kind == "c" else "text"
            raise column_error(path, name, f"{kind}, not numbers")
        return np.asarray(values, np.float64)

    return Columns(
        path=path,
        sha256=hashlib.sha256(data).hexdigest(),
        names=names,
        units=units_of(names),
        lengths=[len(values) for _, values in vectors],
        fetch=fetch,
        sample=f"{path}: sample",
    )


def _loaded(path: Path, data: bytes) -> dict[str, Any]:
    """Return the variables of a file by name.

    SciPy takes what it finds of a file of version 5 that is cut off; so its elements are counted
    before. Source: MathWorks, "MAT-File Format", chapter 1.
    """
    from scipy.io import loadmat

    if b"\0" not in data[:4]:
        if data[HEAD - 2 : HEAD] not in ORDERS:
            raise RecordError(f"{path}: not {MATLAB}, or damaged: no head of version 4 to 7.2")
        at = HEAD
        while at + TAG <= len(data):
            kind, size = struct.unpack_from(ORDERS[data[HEAD - 2 : HEAD]] + "II", data, at)
            # a small element has its size in the upper half
            at += TAG if kind >> 16 else TAG + size
        if at != len(data):
            raise RecordError(f"{path}: not {MATLAB}, or damaged: its elements do not end with it")
    stream: Any = io.BytesIO(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of objects that SciPy cannot read
        variables = sound(path, MATLAB, lambda: loadmat(stream))
    return {name: value for name, value in variables.items() if not name.startswith("__")}


def _vectors(name: str, value: Any, depth: int = 0) -> Iterator[NamedVector]:
    """Find the columns in a variable, by name; also those in the fields of structs."""
    if not isinstance(value, np.ndarray) or depth > DEEPEST:
        return
    if value.dtype.names:
        for own, fields in _structs(name, value):
            signals = fields.pop("signals", None) if "time" in fields else None
            for field, inner in fields.items():
                yield from _vectors(f"{own}.{field}", inner, depth + 1)
            yield from _signals(f"{own}.signals", signals, depth + 1)
    elif value.ndim == 2 and value.size > 1 and value.dtype.kind != "O":
        if 1 in value.shape:
            yield name, value.ravel()
        else:
            yield from ((f"{name}(:,{at + 1})", value[:, at]) for at in range(value.shape[1]))
    elif value.ndim == 3 and value.shape[:2] == (1, 1):  # as Simulink saves a scalar signal
        yield name, value.ravel()


def _signals(name: str, signals: Any, depth: int) -> Iterator[NamedVector]:
    """Yield the signals of a structure with time, by their labels where they have one."""
    if not isinstance(signals, np.ndarray) or not signals.dtype.names:
        yield from _vectors(name, signals, depth)
        return
    for own, signal in _structs(name, signals):
        label: Any = signal.get("label")
        is_text = isinstance(label, np.ndarray) and label.dtype.kind == "U" and label.size == 1
        text = str(label.ravel()[0]).strip() if is_text else ""
        called = f"{name.removesuffix('signals')}{text}" if text else f"{own}.values"
        yield from _vectors(called, signal.get("values"), depth)


def _structs(name: str, value: NDArray[Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the structs in an array, each with its name and its fields."""
    structs = value.ravel()
    for at, one in enumerate(structs):
        own = name if structs.size == 1 else f"{name}({at + 1})"
        yield own, {field: one[field] for field in value.dtype.names or ()}
