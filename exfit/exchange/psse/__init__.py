"""PSS/E dynamics files (.dyr): their free format, their records, the units they describe."""

from exfit.exchange.psse.fields import DynamicsFault, located, read_records, text_of
from exfit.exchange.psse.records import (
    Definition,
    alternatives,
    contradictions,
    definition_of,
    definitions,
    read_values,
    record_text,
)
from exfit.exchange.psse.unit import Unit, UnitPart, read_unit

__all__ = [
    "Definition",
    "DynamicsFault",
    "Unit",
    "UnitPart",
    "alternatives",
    "contradictions",
    "definition_of",
    "definitions",
    "located",
    "read_records",
    "read_unit",
    "read_values",
    "record_text",
    "text_of",
]
