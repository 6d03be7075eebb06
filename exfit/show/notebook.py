"""A fit as a notebook shows it: a table of its parameters, a figure of its response."""

from matplotlib.figure import Figure

from exfit.errors import ExfitError
from exfit.results.model import FitResult, FittedParameter
from exfit.show.blocks import interval, number
from exfit.show.figures import overlay
from exfit.util.text import near, percentage

__all__ = ["Figure", "fit_figure", "fit_html"]

TABLE = """\
<div>
<p><b>{{ result.model }}</b> fitted to {{ records }}:
{{ verdict }},
rmse {{ "%.3g" | format(result.rmse) }} pu, fit {{ fit_percent }} %</p>
<table>
<thead><tr>
{% for heading in ("parameter", "start", "fitted", "standard error", "95 % interval", "unit") %}
<th>{{ heading }}</th>
{% endfor %}
</tr></thead>
<tbody>
{% for meaning, cells in rows %}
<tr title="{{ meaning }}">{% for cell in cells %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}
</tbody>
</table>
{% if remarks %}
<ul>
{% for remark in remarks %}
<li>{{ remark }}</li>
{% endfor %}
</ul>
{% endif %}
</div>
"""


def fit_html(result: FitResult) -> str:
    """Return the parameters of a fit and what it leaves unresolved, as HTML."""
    from jinja2 import Environment

    template = Environment(autoescape=True, trim_blocks=True).from_string(TABLE)
    causes = result.verdict.causes
    no_interval = result.verdict.in_place_of_interval
    unresolved = () if result.knowledge is None else result.knowledge.sentences
    return template.render(
        result=result,
        verdict=result.verdict.sentence,
        records=", ".join(comparison.record for comparison in result.comparisons),
        fit_percent=percentage(result.comparison.fit_percent),
        rows=[
            (parameter.meaning, _cells(name, parameter, no_interval))
            for name, parameter in result.parameters.items()
        ],
        remarks=[
            *(cause.sentence for cause in causes),
            *(f"unresolved: {text}" for text in unresolved),
            *result.notes,
        ],
    )


def _cells(name: str, parameter: FittedParameter, no_interval: str) -> tuple[str, ...]:
    """Return what the table says of a parameter; ``no_interval`` in place of its interval."""
    note = f" ({parameter.interval_note})" if parameter.interval_note else ""
    bound = f", on its {parameter.at_bound}" if parameter.at_bound else ""
    return (
        name,
        number(parameter.start),
        f"{parameter.rounded(parameter.value)}{bound}",
        number(parameter.linear_error, 2),
        no_interval or f"{interval(parameter.interval, parameter.rounded)}{note}",
        parameter.unit,
    )


def fit_figure(result: FitResult, record: str | None = None) -> Figure:
    """Return the fitted response beside a record, one of the fit or of its validation by name.

    Raises ExfitError where there is no such record.
    """
    comparisons = {match.name: match for match in (*result.comparisons, *result.validation)}
    name = next(iter(comparisons)) if record is None else record
    if name not in comparisons:
        raise ExfitError(f"{name}: not a record of this fit; {near(name, comparisons)}")
    return overlay(comparisons[name], f"{result.name}: {result.model}, record {name}")
