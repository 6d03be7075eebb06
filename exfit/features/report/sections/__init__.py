"""The sections of a report in their order: a module with what it says, a template, a row here."""

from collections.abc import Callable
from typing import Any, NamedTuple

from exfit.features.report.sections.against import against
from exfit.features.report.sections.as_found import as_found, as_found_of_validation
from exfit.features.report.sections.criteria import criteria
from exfit.features.report.sections.dynamics import dynamics
from exfit.features.report.sections.findings import findings
from exfit.features.report.sections.form import form, form_of_validation
from exfit.features.report.sections.identifiability import identifiability
from exfit.features.report.sections.limits import limits
from exfit.features.report.sections.matches import fitted_matches, validation_matches
from exfit.features.report.sections.model import model
from exfit.features.report.sections.parameters import parameters
from exfit.features.report.sections.reproduction import reproduction, reproduction_of_validation
from exfit.features.report.sections.search import search
from exfit.features.report.sections.signatures import signatures
from exfit.features.report.sections.small_signal import small_signal
from exfit.features.report.sections.unit_and_test import unit_and_test
from exfit.features.report.sections.usability import usability_table


class ReportSection(NamedTuple):
    """A section of a report: its id, its heading, what it says of a fit, its template."""

    key: str
    heading: str
    content: Callable[..., Any]
    template: str


FORM = "The form of a verification report"
SECTIONS = (
    ReportSection("form", FORM, form, "form"),
    ReportSection("criteria", "Criteria", criteria, "blocks"),
    ReportSection("test", "Unit and test", unit_and_test, "blocks"),
    ReportSection("model", "Model", model, "model"),
    ReportSection("parameters", "Parameters", parameters, "blocks"),
    ReportSection("as-found", "As found and verified", as_found, "as_found"),
    ReportSection("findings", "Notes and unresolved findings", findings, "blocks"),
    ReportSection("fit", "Fitted records", fitted_matches, "fit"),
    ReportSection(
        "validation", "Validation on records that were not fitted", validation_matches,
        "validation",
    ),
    ReportSection("flat", "Usability", usability_table, "blocks"),
    ReportSection("search", "Search", search, "search"),
    ReportSection("identifiability", "Identifiability", identifiability, "identifiability"),
    ReportSection("small", "Small-signal view", small_signal, "blocks"),
    ReportSection("limits", "Limits that were hit", limits, "blocks"),
    ReportSection("dyr", "PSS/E dynamics records", dynamics, "blocks"),
    ReportSection("reproduction", "Reproduction", reproduction, "reproduction"),
    ReportSection("signatures", "Revision and signatures", signatures, "signatures"),
)  # fmt: skip
# of values that were compared and not fitted; a section with nothing in it is left out
OF_VALIDATION = (
    ReportSection("form", FORM, form_of_validation, "form"),
    ReportSection("criteria", "Criteria", criteria, "blocks"),
    ReportSection("test", "Unit and test", unit_and_test, "blocks"),
    ReportSection("model", "Model", model, "model"),
    ReportSection("parameters", "Parameters", parameters, "blocks"),
    ReportSection("as-found", "As found and compared", as_found_of_validation, "as_found"),
    ReportSection("findings", "Notes", findings, "blocks"),
    ReportSection("fit", "Records that the values were fitted to", fitted_matches, "fit"),
    ReportSection("validation", "Recorded and simulated", validation_matches, "fit"),
    ReportSection("flat", "Usability", usability_table, "blocks"),
    ReportSection("small", "Small-signal view", small_signal, "blocks"),
    ReportSection("limits", "Limits that were hit", limits, "blocks"),
    ReportSection("reproduction", "Reproduction", reproduction_of_validation, "reproduction"),
    ReportSection("signatures", "Revision and signatures", signatures, "signatures"),
)
AGAINST = ReportSection("against", "Beside another fit", against, "against")
