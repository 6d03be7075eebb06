"""What a case file says, checked as a whole: its sections, the models it names, its ties."""

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from exfit.case.checks.content import contradictions
from exfit.case.open_values import TO_BE_FILLED_IN, open_places
from exfit.case.parts import Parts, parts_of, ties_of
from exfit.case.schema import CaseDocument
from exfit.case.ties import Ties
from exfit.case.yaml import Fault
from exfit.registry import parts
from exfit.util.text import Place

Document = TypeVar("Document", bound=CaseDocument)


@dataclass(frozen=True)
class CheckedContent:
    """The content of a case file without a fault."""

    document: CaseDocument
    parts: Parts
    ties: Ties


def check_content(
    content: dict[str, Any], folder: Path, faults: list[Fault], model_sha256: str = ""
) -> CheckedContent | None:
    """Return the checked content of a case file; None, and faults added, where it has any.

    The files that it names are relative to ``folder``; ``faults`` holds those found before. A
    user's own model is run only if its file has the hash given, where one is.
    """
    for key, section in parts("SECTIONS").items():
        if key in content:
            faults.append(Fault((key,), section.load().not_of_a_case))
            return None
    still_open = [Fault(place, TO_BE_FILLED_IN) for place in open_places(content)]
    models = parts_of(content, folder, faults, model_sha256)
    ties = ties_of(content, models, faults)
    places = {fault.place for fault in still_open}
    faults[:] = [*still_open, *(fault for fault in faults if fault.place not in places)]
    document = validated_document(content, faults, CaseDocument)
    places = {fault.place for fault in faults}
    faults += [
        fault for fault in contradictions(content, models, ties) if fault.place not in places
    ]
    if faults or document is None:
        return None
    return CheckedContent(document, models, ties)


def validated_document(
    content: dict[str, Any], faults: list[Fault], form: type[Document]
) -> Document | None:
    """Read the sections if all have the right form; add a fault for each that has not."""
    try:
        return form.model_validate(content)
    except ValidationError as error:
        from exfit.case.json_schema import json_schema
        from exfit.case.messages import form_faults

        places = {fault.place for fault in faults}
        wrong_forms = form_faults(error.errors(include_url=False), json_schema())
        faults += [fault for fault in wrong_forms if fault.place not in places]
        return None


def plain_content(value: Any, faults: list[Fault], place: Place = ()) -> Any:
    """Return Python data as a case file holds it: mappings, lists, numbers and text.

    Tuples become lists, NumPy's numbers floats and integers, paths text; a None is a fault.
    """
    if value is None:
        faults.append(Fault(place, "has no value"))
    if isinstance(value, Mapping):
        return {
            str(key): plain_content(entry, faults, (*place, str(key)))
            for key, entry in value.items()
        }
    if isinstance(value, list | tuple):
        return [plain_content(entry, faults, (*place, k)) for k, entry in enumerate(value)]
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, bool) or not isinstance(value, Real):
        return value
    return int(value) if isinstance(value, Integral) else float(value)
