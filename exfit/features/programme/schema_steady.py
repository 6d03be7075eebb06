"""The sections of a programme about tests at rest: points that were read from instruments."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WrapSerializer

from exfit.case.messages import FILE_NAME
from exfit.case.schema.estimate import Limit
from exfit.case.schema.values import (
    Findable,
    FreeSection,
    Frozen,
    Number,
    Positive,
    Section,
    Text,
    nothing,
    thawed,
)
from exfit.signals import FIELDS, TERMINALS
from exfit.util.file_names import LONGEST_NAME

MOST_POINTS = 1000  # of a list; a longer one is a file
POINT_SIGNALS = (*TERMINALS, *FIELDS)

if TYPE_CHECKING:
    PointSignal = str
else:
    PointSignal = Literal[POINT_SIGNALS]


def _column(value: Any) -> Any:
    return {"column": value} if isinstance(value, str) else value


class PointColumn(Section):
    """A column of points and its conversion to per unit: column / base * scale."""

    column: Text | None = Field(
        default=None, description="Name of the column; none with points in place of a file."
    )
    unit: Text | None = Field(
        default=None,
        description="Unit of the column, such as MW, Mvar, kV, A, V, pu or %; default: that of the "
        "file, else pu.",
    )
    base: Findable | None = Field(
        default=None,
        description="Value of 1 pu in that unit: of p and q the rated MVA of the machine; of ifd "
        "and efd what gives 1 pu of voltage on the air-gap line, or {start, min, max} to fit it, "
        "where start: auto needs no bounds.",
    )
    scale: Number = Field(default=1.0, description="Factor, such as -1; not zero.")
    noise: Positive | None = Field(
        default=None,
        description="Standard deviation of the readings of ifd or efd, pu; default: that of the "
        "residuals.",
    )


class SteadyTest(Section):
    """Points of the V-curves: field current, or voltage, of the machine at rest on load."""

    kind: Literal["steady"] = Field(description="Kind of test.")
    name: str = Field(
        pattern=FILE_NAME,
        max_length=LONGEST_NAME,
        description="Name of letters, digits, - _ and .; files are named after it.",
    )
    file: Text | None = Field(
        default=None, description="File of the points, in any format of a record."
    )
    sheet: Text | None = Field(
        default=None, description="Sheet of a workbook; default: the only one with a table."
    )
    points: (
        Annotated[tuple[tuple[Number, ...], ...], Field(min_length=1, max_length=MOST_POINTS)]
        | None
    ) = Field(
        default=None,
        description="In place of a file: [p, q, vt, ifd] or [p, q, vt, ifd, efd] of each point.",
    )
    columns: Annotated[
        Mapping[
            PointSignal,
            Annotated[
                PointColumn, BeforeValidator(_column, json_schema_input_type=Text | PointColumn)
            ],
        ],
        AfterValidator(MappingProxyType),
        WrapSerializer(thawed),
    ] = Field(
        default_factory=nothing,
        description="Columns of p, q, vt and of ifd, efd or both: a name, or a mapping. p and q "
        "are positive where the machine gives power and is overexcited.",
    )
    free: Frozen[FreeSection] = Field(
        default_factory=nothing,
        description="Machine data that the points are fitted for: Xd, Xq, S10, S12, Xl, as under "
        "parameters.free.",
    )
    accept: Limit | None = Field(
        default=None,
        description="Limit of the rms difference of each field signal, pu; beyond it the points "
        "are not matched. Default: 2 % of its rms, or 3 times its noise where that is larger.",
    )
