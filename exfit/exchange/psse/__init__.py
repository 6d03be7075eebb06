"""PSS/E dynamics files (.dyr): their free format, their records, the units they describe."""

from exfit.exchange.psse.fields import Fault, located, read_records, text_of
from exfit.exchange.psse.records import (
    Definition,
    alternatives,
    contradictions,
    definition_of,
    definitions,
    read_values,
    record_text,
)
from exfit.exchange.psse.unit import Part, Unit, read_unit

__all__ = [
    "Definition",
    "Fault",
    "Part",
    "Unit",
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
