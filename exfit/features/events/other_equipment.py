"""A case with another plant, governor or stabiliser beside its exciter."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from exfit.case.case import Case
from exfit.case.parts import Parts, added_part
from exfit.case.schema import Governor, Stabiliser
from exfit.models import GOVERNORS, STABILISERS
from exfit.plants import GOVERNOR, STABILISER

Data = Mapping[str, float]


def with_plant_keys(case: Case, **keys: Any) -> Case:
    """Return a case with other keys of its plant, such as ``swing``; they are not checked."""
    return replace(case, plant=case.plant.model_copy(update=keys))


def with_governor(case: Case, name: str, data: Data) -> Case:
    """Return a case that has a governor too, of the catalogue; the rest of its data is typical."""
    model = GOVERNORS[name]
    parts = (*case.parts.all, added_part("governor", GOVERNOR, model))
    return replace(
        case,
        governor=Governor(model=name, parameters=dict(data)),
        parts=replace(case.parts, governor=model, all=parts),
    )


def with_stabiliser(case: Case, name: str, inputs: tuple[Any, ...], data: Data) -> Case:
    """Return a case that has a stabiliser too, which listens to ``inputs``."""
    model = STABILISERS[name]
    parts = (*case.parts.all, added_part("stabiliser", STABILISER, model))
    return replace(
        case,
        stabiliser=Stabiliser(model=name, inputs=inputs, parameters=dict(data)),
        parts=replace(case.parts, stabiliser=model, all=parts),
    )


def without_governor(case: Case) -> Case:
    """Return a case without its governor."""
    return replace(case, governor=None, parts=replace(_without(case, "governor"), governor=None))


def without_stabiliser(case: Case) -> Case:
    """Return a case without its stabiliser."""
    parts = replace(_without(case, "stabiliser"), stabiliser=None)
    return replace(case, stabiliser=None, parts=parts)


def _without(case: Case, kind: str) -> Parts:
    rest = tuple(part for part in case.parts.all if part.kind != kind)
    return replace(case.parts, all=rest)
