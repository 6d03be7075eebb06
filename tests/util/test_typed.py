"""Data classes as plain data and back: nothing is lost, what is wrong is named with its place."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isnan, nan
from pathlib import Path
from typing import Annotated, ClassVar, Literal, NamedTuple, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from exfit.util.typed import IN_FILE, KEY, plain
from exfit.util.typed_reading import FormError, read


class Pair(NamedTuple):
    low: float
    high: Annotated[float, inf]


@dataclass(frozen=True, eq=False)
class Whole:
    DERIVED: ClassVar = {"double": "twice"}

    name: str
    count: int
    share: Annotated[float, nan]
    side: Literal["min", "max"] | None
    pair: Pair
    named: tuple[tuple[str, float], ...]
    by_name: Mapping[str, tuple[int, ...]]
    samples: Annotated[NDArray[np.float64], inf]
    response: NDArray[np.complex128]
    pole: complex
    fact: float | str = 1.0
    path: Path = field(default=Path("a"), metadata={KEY: "file"})
    long: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0), metadata=IN_FILE)

    @property
    def twice(self) -> int:
        return 2 * self.count


WHOLE = Whole(
    name="Höllental",
    count=3,
    share=nan,
    side="max",
    pair=Pair(-1.0, inf),
    named=(("b", 1.0), ("a", 2.0)),
    by_name={"x": (1, 2), "y": ()},
    samples=np.array([[0.1, inf], [3.0, 4.0]]),
    response=np.array([1.0 + 2.0j, -3.0j]),
    pole=-1.0 + 0.5j,
    fact="text",
    path=Path("b/c"),
    long=np.array([1.0, nan]),
)


def data():
    return json.loads(json.dumps(plain(WHOLE, whole=True), allow_nan=False))


def test_what_is_written_is_read_back():
    found = read(Whole, data())
    for name in ("name", "count", "side", "pair", "named", "by_name", "pole", "fact", "path"):
        assert getattr(found, name) == getattr(WHOLE, name), name
    assert isnan(found.share)
    for name in ("samples", "response", "long"):
        np.testing.assert_array_equal(getattr(found, name), getattr(WHOLE, name))


def test_figures_have_what_is_derived_and_not_what_is_only_in_files():
    figures = plain(WHOLE)
    assert figures["double"] == 6
    assert "long" not in figures
    assert figures["file"] == str(Path("b/c"))
    assert figures["named"] == {"b": 1.0, "a": 2.0}
    assert figures["pair"] == {"low": -1.0, "high": None}


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (["name"], 1, "name: 1 is not a text"),
        (["count"], 1.5, "count: 1.5 is not a whole number"),
        (["count"], True, "count: true is not a whole number"),
        (["share"], "x", "share: 'x' is not a number"),
        (["side"], "left", "side: 'left' is none of min, max"),
        (["pair", "low"], None, "pair.low: None is not a number"),
        (["pair", "low"], 1e999, "pair.low: inf is not a number"),
        (["pair"], [1.0, 2.0], "pair: a list is not a mapping"),
        (["named", "a"], False, "named.a: false is not a number"),
        (["by_name", "x", 1], "2", "by_name.x[1]: '2' is not a whole number"),
        (["samples", 1], [3.0], "samples: its rows differ in length"),
        (["samples", 1, 0], "3", "samples[1][0]: '3' is not a number"),
        (["long"], {}, "long: a mapping is not a list of numbers"),
        (["long", 0], True, "long[0]: true is not a number"),
        (["response", "imag"], [1.0], "response: real and imag differ in length"),
        (["pole"], [1.0], "pole: not a pair of real and imaginary part"),
        (["file"], 3, "file: 3 is not a text"),
    ],
)
def test_what_has_another_form_is_refused_with_its_place(place, value, words):
    content = data()
    section = content
    for key in place[:-1]:
        section = section[key]
    section[place[-1]] = value
    with pytest.raises(FormError) as refused:
        read(Whole, content)
    assert str(refused.value) == words


def test_what_is_missing_is_refused_though_it_has_a_default():
    content = data()
    del content["pair"]["low"]
    with pytest.raises(FormError, match=r"^pair\.low: missing$"):
        read(Whole, content)
    del content["fact"]
    with pytest.raises(FormError, match=r"missing$"):
        read(Whole, content)


@pytest.mark.parametrize("key", ["pair", "long"])
def test_a_whole_number_too_large_for_a_double_is_no_number(key):
    content = data()
    content[key] = {"low": 10**400, "high": None} if key == "pair" else [0, 10**400]
    with pytest.raises(FormError, match="is not a number"):
        read(Whole, content)


def test_whole_numbers_are_numbers():
    assert read(Whole, {**data(), "long": [1, 2.5, None]}).long[:2].tolist() == [1.0, 2.5]


def test_an_alias_is_read_as_what_it_stands_for_as_newer_interpreters_have_them():
    scalar = TypeVar("scalar", bound=np.generic)
    array = np.ndarray[tuple[int, ...], np.dtype[scalar]]
    alias = TypeAliasType("alias", array, type_params=(scalar,))
    assert read(alias[np.float64], [1.0, 2.0]).tolist() == [1.0, 2.0]
    assert read(Annotated[alias[np.float64], inf], [None]).tolist() == [inf]
    assert read(alias[np.complex128], {"real": [1.0], "imag": [2.0]}).tolist() == [1.0 + 2.0j]
