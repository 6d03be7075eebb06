"""What a report says, as data: built from a fit that is read back, and from its case."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exfit import __version__
from exfit.case.case import Case
from exfit.case.parts import Part
from exfit.case.schema import BumpTest, ChannelSection, PhasesSection, Recording, Unknown, known
from exfit.dsp.features import Features
from exfit.errors import ExfitError
from exfit.exchange.psse.export import export
from exfit.fitting.nuisance import unit_of
from exfit.fitting.setup import ExperimentSetup
from exfit.inference.wording import listed
from exfit.output.report.simulated import Simulated, simulated
from exfit.output.report.sources import Samples, Sources, sources
from exfit.results.io import Saved, read_saved
from exfit.util.text import show

OF_RECORD: Mapping[str, str] = {
    "at": "instant of a step",
    "step": "size of a step",
    "vt0": "voltage before the first step",
    "delay": "delay of the recorder",
    "scale": "factor of a channel",
    "offset": "offset of a channel",
}
BUS, MACHINE_ID = 1, "1"  # what a dynamics file needs and no case has


@dataclass(frozen=True)
class Verdict:
    """What the fit comes to: a word, a sentence, and whether it is good; None where none judges."""

    word: str
    sentence: str
    good: bool | None


@dataclass(frozen=True)
class Tested:
    """A test and its record."""

    name: str
    role: str
    file: str
    plant: str
    done: str
    channels: str
    samples: int
    first: float
    last: float
    spacing: float


@dataclass(frozen=True)
class Described:
    """A model of the study: what it stands for, its title, its drawing."""

    kind: str
    name: str
    title: str
    drawing: str


@dataclass(frozen=True)
class Fitted:
    """A fitted parameter; ``why`` is the reason where there is no interval."""

    name: str
    unit: str
    meaning: str
    start: float
    value: float
    low: float
    high: float
    interval: tuple[float, float] | None
    why: str
    error: float | None
    at_bound: str | None
    of_record: bool


@dataclass(frozen=True)
class Kept:
    """A parameter that the fit did not move, and where its value is from."""

    name: str
    unit: str
    meaning: str
    value: float
    source: str


@dataclass(frozen=True)
class KeptOf:
    """The parameters of a part that the fit did not move."""

    title: str
    rows: tuple[Kept, ...]


@dataclass(frozen=True)
class Signal:
    """How well a signal matches."""

    name: str
    rmse: float
    max_error: float
    fit_percent: float | None


@dataclass(frozen=True, eq=False)
class Match:
    """A record beside the simulation; ``samples`` is None where their table is missing."""

    name: str
    record: str
    rmse: float
    limit: float | None
    accepted: bool
    signals: tuple[Signal, ...]
    measured: Features | None
    simulated: Features | None
    samples: Samples | None


@dataclass(frozen=True)
class Iteration:
    """A line of the history; what is not a finite number is None."""

    number: int
    phase: str
    cost: float | None
    gradient_norm: float | None
    step_norm: float | None
    damping: float | None
    inner: int
    nfev: int
    njev: int
    values: Mapping[str, float]


@dataclass(frozen=True)
class Minimum:
    """A minimum that a search from many starts found."""

    cost: float
    starts: int
    values: Mapping[str, float]


@dataclass(frozen=True)
class Search:
    """How the parameters were found."""

    strategy: str
    message: str
    history: tuple[Iteration, ...]
    minima: tuple[Minimum, ...]
    facts: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Correlation:
    """The correlations of the estimates; None where one has no standard error."""

    names: tuple[str, ...]
    rows: tuple[tuple[float | None, ...], ...]


@dataclass(frozen=True)
class Dynamics:
    """The PSS/E records of the fit and what must be known of them, or why there are none."""

    text: str
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Reproduction:
    """How the report is made again: from which files, by what."""

    commands: tuple[str, ...]
    versions: Mapping[str, str]
    hashes: Mapping[str, tuple[str, str]]
    case: str


@dataclass(frozen=True, eq=False)
class Report:
    """All that a report says."""

    title: str
    about: tuple[tuple[str, str], ...]
    verdict: Verdict
    tests: tuple[Tested, ...]
    models: tuple[Described, ...]
    fitted: tuple[Fitted, ...]
    kept: tuple[KeptOf, ...]
    notes: tuple[str, ...]
    open: tuple[str, ...]
    fits: tuple[Match, ...]
    validations: tuple[Match, ...]
    search: Search
    correlation: Correlation | None
    simulated: Simulated
    dynamics: Dynamics
    reproduction: Reproduction


def report_of(result: Path, case: Path | None = None) -> Report:
    """Return what the report of a fit says, given its result.json or the folder that holds it.

    ``case`` is the case file where it lies elsewhere than the result says. Raises ExfitError where
    the result, the case or a record cannot be used, or is not the one that was fitted.
    """
    saved = read_saved(result)
    found = sources(saved, case)
    fitted = tuple(_fitted(found))
    fits = tuple(_matches(found, "records"))
    validations = tuple(_matches(found, "validation"))
    return Report(
        title=f"{saved.at('model')}: {found.case.path.stem}",
        about=tuple((name, _plain(value)) for name, value in saved.mapping("about").items()),
        verdict=_verdict(saved, fitted, fits, validations),
        tests=tuple(_tests(found)),
        models=tuple(_models(found.case)),
        fitted=fitted,
        kept=tuple(_kept(found)),
        notes=saved.texts("notes"),
        open=() if saved.at("knowledge") is None else saved.texts("knowledge", "sentences"),
        fits=fits,
        validations=validations,
        search=_search(saved),
        correlation=_correlation(saved),
        simulated=simulated(found),
        dynamics=_dynamics(saved),
        reproduction=_reproduction(found),
    )


def _plain(value: Any) -> str:
    return show(value) if isinstance(value, int | float) else str(value)


def _verdict(
    saved: Saved, fitted: Sequence[Fitted], fits: Sequence[Match], validations: Sequence[Match]
) -> Verdict:
    own = [one for one in fitted if not one.of_record]
    vague = [one.name for one in own if one.interval is None]
    rmse = ", ".join(f"{one.rmse:.2e} pu ({one.name})" for one in (*fits, *validations))
    determined = (
        f"{len(vague)} of {len(own)} parameters not determined: {listed(vague)}"
        if vague
        else "every parameter determined"
    )
    # none is judged by them, but a wrong base of one shows nowhere else at a glance
    others = [
        f"{signal.name} of {one.name}"
        for one in fits
        for signal in one.signals
        if signal not in _judging(one) and not _describes(signal)
    ]
    missed = f"; no better than by a constant matched: {listed(others)}" if others else ""
    word, text, good = _judged(saved, fits, validations)
    return Verdict(word, f"{text[:1].upper()}{text[1:]}{missed}; rmse {rmse}; {determined}.", good)


def _judged(
    saved: Saved, fits: Sequence[Match], validations: Sequence[Match]
) -> tuple[str, str, bool | None]:
    message = str(saved.at("message"))
    if saved.at("interrupted"):
        return "Interrupted", "the values are the best until the search was interrupted", False
    if not saved.at("success"):
        return "Not converged", f"the search ended before a minimum: {message}", False
    missed = [one.name for one in fits for signal in _judging(one) if not _describes(signal)]
    if missed:
        names = listed(missed)
        return "No match", f"the response matches {names} no better than a constant would", False
    beyond = [one.name for one in validations if not one.accepted]
    limits = [one.limit for one in validations if one.limit is not None]
    if beyond:
        return "Not accepted", f"beyond rmse {limits[0]:g} pu on {listed(beyond)}", False
    if not validations:
        return "Converged", "no record was kept for a validation", None
    if not limits:
        return "Converged", "the case sets no limit for its validations", None
    return (
        "Accepted",
        f"the search converged, and every validation is within rmse {limits[0]:g} pu",
        True,
    )


def _judging(match: Match) -> Sequence[Signal]:
    """Return the signal by which a match is judged: vt, or the first where there is none."""
    return [one for one in match.signals if one.name == "vt"] or match.signals[:1]


def _describes(signal: Signal) -> bool:
    return signal.fit_percent is not None and signal.fit_percent > 0.0


def _tests(found: Sources) -> Iterator[Tested]:
    case = found.case
    for role, recordings, trials in (
        ("fitted", case.recordings, found.trials),
        ("validation", case.validations, found.validations),
    ):
        for recording, trial in zip(recordings, trials, strict=True):
            yield _tested(case, recording, trial, role)


def _tested(case: Case, recording: Recording, trial: ExperimentSetup, role: str) -> Tested:
    time = trial.record.time
    return Tested(
        name=recording.name,
        role=role,
        file=recording.record.file,
        plant=case.seen_from(recording).kind.title,
        done="; ".join(_done(recording.test)) or "no step of its own",
        channels="; ".join(_channel(*one) for one in recording.record.channels.items()),
        samples=len(time),
        first=float(time[0]),
        last=float(time[-1]),
        spacing=float(time[-1] - time[0]) / (len(time) - 1),
    )


def _done(test: BumpTest) -> Iterator[str]:
    """Yield what was done to the unit, in words."""
    if test.vt0 is not None:
        yield f"vt0 {_known(test.vt0, 'g', 'pu')}"
    for signal in ("vref", "vs", "E"):
        for step in getattr(test, signal):
            yield f"{signal} {_known(step.step, '+g', 'pu')} at {_known(step.at, 'g', 's')}"
    for switch in test.network:
        values = {name: getattr(switch, name) for name in ("R", "X", "E")}
        changed = {name: value for name, value in values.items() if value is not None}
        told = ", ".join(f"{name} {value:g} pu" for name, value in changed.items())
        yield f"network switched at {switch.at:g} s: {told}"


def _channel(signal: str, entry: ChannelSection | PhasesSection) -> str:
    """Return a signal with what 1 pu of it is."""
    return signal if entry.base is None else f"{signal}, 1 pu = {entry.base:g} {entry.unit}"


def _known(value: float | Unknown, form: str, unit: str) -> str:
    """Return a value of a test; one that the fit found stands among the parameters."""
    if not isinstance(value, Unknown):
        return f"{value:{form}} {unit}"
    start = known(value)
    near = "" if start is None else f"about {start:{form}} {unit} "
    return f"{near}(found by the fit)"


def _models(case: Case) -> Iterator[Described]:
    parts = case.parts
    if parts.exciter is not None:
        one = parts.exciter
        yield Described("exciter", one.name, one.title, one.drawing)
    if parts.machine is not None:
        yield Described("machine", parts.machine.name, parts.machine.title, "")
    if parts.stabiliser is not None:
        one = parts.stabiliser
        yield Described("stabiliser", one.name, one.title, one.drawing)


def _fitted(found: Sources) -> Iterator[Fitted]:
    saved, units = found.saved, found.case.units()
    meanings = {
        part.prefix + row.symbol: row.meaning for part in found.case.parts.all for row in part.sheet
    }
    for name in saved.mapping("parameters"):
        at = ("parameters", name)
        of_record = bool(saved.at(*at, "of_record"))
        kind = name.rpartition(".")[2]
        interval = saved.at(*at, "interval")
        yield Fitted(
            name=name,
            unit=units.get(name, unit_of(name)),
            meaning=OF_RECORD.get(kind, "") if of_record else meanings.get(name, "used by ties"),
            start=saved.number(*at, "start"),
            value=saved.number(*at, "value"),
            low=saved.number(*at, "min"),
            high=saved.number(*at, "max"),
            interval=None
            if interval is None
            else (saved.number(*at, "interval", 0), saved.number(*at, "interval", 1)),
            why=str(saved.at(*at, "why") or ""),
            error=saved.number_or_none(*at, "std_error"),
            at_bound=saved.at(*at, "at_bound"),
            of_record=of_record,
        )


def _kept(found: Sources) -> Iterator[KeptOf]:
    """Yield what the fit did not move: part by part, then helpers, then networks of records."""
    saved, case = found.saved, found.case
    sections = {"exciter": "fixed"}
    for part in case.parts.all:
        given = saved.mapping(sections.get(part.kind, part.kind))
        rows = tuple(_kept_rows(saved, part, {part.prefix + key: given[key] for key in given}))
        if rows:
            yield KeptOf(f"{part.kind.capitalize()} {part.name}".replace(" the network", ""), rows)
    own = {row.symbol for part in case.parts.all if part.kind == "exciter" for row in part.sheet}
    helpers = [name for name in saved.mapping("fixed") if name not in own]
    if helpers:
        rows = tuple(
            Kept(name, "", "used by ties", saved.number("fixed", name), _source(saved, name))
            for name in helpers
        )
        yield KeptOf("Helpers", rows)
    for one in (*case.recordings, *case.validations):
        view = case.seen_from(one)
        for part in view.parts.all if view is not case else ():
            if part.kind == "network":
                rows = tuple(_kept_rows(saved, part, view.values()))
                yield KeptOf(f"Network of {one.name}", rows)


def _kept_rows(saved: Saved, part: Part, values: Mapping[str, float]) -> Iterator[Kept]:
    for row in part.sheet:
        name = part.prefix + row.symbol
        if name not in saved.mapping("parameters") and name in values:
            yield Kept(row.symbol, row.unit, row.meaning, values[name], _source(saved, name))


def _source(saved: Saved, name: str) -> str:
    """Return where the value of a parameter is from that the fit did not move."""
    if name in saved.mapping("ties"):
        return f"tied {saved.at('ties', name)}"
    return "typical" if name in saved.entries("typical") else "fixed"


def _matches(found: Sources, key: str) -> Iterator[Match]:
    """Yield the records that a fit was compared with; a limit is for those it never saw."""
    saved = found.saved
    accept = found.case.accept if key == "validation" else None
    for k, one in enumerate(saved.entries(key)):
        at = (key, k)
        name = str(saved.at(*at, "name"))
        yield Match(
            name=name,
            record=str(saved.at(*at, "record")),
            rmse=saved.number(*at, "rmse"),
            limit=None if accept is None else accept.rmse,
            accepted=bool(saved.at(*at, "accepted")),
            signals=tuple(
                Signal(
                    signal,
                    saved.number(*at, "channels", signal, "rmse"),
                    saved.number(*at, "channels", signal, "max_error"),
                    saved.number_or_none(*at, "channels", signal, "fit_percent"),
                )
                for signal in one.get("channels", {})
            ),
            measured=_features(saved, *at, "features", "measured"),
            simulated=_features(saved, *at, "features", "simulated"),
            samples=found.samples(name),
        )


def _features(saved: Saved, *place: str | int) -> Features | None:
    if saved.at(*place) is None:
        return None
    return Features(
        initial_value=saved.number(*place, "initial_value"),
        final_value=saved.number(*place, "final_value"),
        rise_time=saved.number_or_none(*place, "rise_time"),
        overshoot_percent=saved.number(*place, "overshoot_percent"),
        peak_time=saved.number_or_none(*place, "peak_time"),
        settling_time=saved.number_or_none(*place, "settling_time"),
    )


def _search(saved: Saved) -> Search:
    history = tuple(_history(saved))
    minima = () if saved.at("minima") is None else tuple(_minima(saved))
    facts = (
        ("strategy", str(saved.at("strategy"))),
        ("ended because", str(saved.at("message"))),
        ("cost at the start", _pu2(saved.number_or_none("start_cost"))),
        ("cost at the end", _pu2(saved.number_or_none("cost"))),
        ("iterations", show(saved.number("nit"))),
        ("residuals and Jacobians", f"{saved.number('nfev'):g} and {saved.number('njev'):g}"),
        ("simulations", show(saved.number("simulations"))),
        ("sub-steps of a step", show(saved.number("substeps"))),
    )
    return Search(str(saved.at("strategy")), str(saved.at("message")), history, minima, facts)


def _pu2(cost: float | None) -> str:
    return "none" if cost is None else f"{cost:.4e} pu²"


def _history(saved: Saved) -> Iterator[Iteration]:
    for k in range(len(saved.entries("history"))):
        at = ("history", k)
        yield Iteration(
            number=int(saved.number(*at, "number")),
            phase=str(saved.at(*at, "phase")),
            cost=saved.number_or_none(*at, "cost"),
            gradient_norm=saved.number_or_none(*at, "gradient_norm"),
            step_norm=saved.number_or_none(*at, "step_norm"),
            damping=saved.number_or_none(*at, "damping"),
            inner=int(saved.number(*at, "inner")),
            nfev=int(saved.number(*at, "nfev")),
            njev=int(saved.number(*at, "njev")),
            values={
                name: saved.number(*at, "values", name) for name in saved.mapping("parameters")
            },
        )


def _minima(saved: Saved) -> Iterator[Minimum]:
    for k in range(len(saved.at("minima", "minima"))):
        at = ("minima", "minima", k)
        values = {name: saved.number(*at, "values", name) for name in saved.mapping("parameters")}
        yield Minimum(saved.number(*at, "cost"), int(saved.number(*at, "starts")), values)


def _correlation(saved: Saved) -> Correlation | None:
    if saved.at("knowledge") is None:
        return None
    at = ("knowledge", "confidence", "correlation")
    names = saved.texts(*at, "names")
    every = range(len(names))
    return Correlation(
        names,
        tuple(
            tuple(saved.number_or_none(*at, "matrix", row, column) for column in every)
            for row in every
        ),
    )


def _dynamics(saved: Saved) -> Dynamics:
    try:
        found = export(saved.path, BUS, MACHINE_ID)
    except ExfitError as fault:
        return Dynamics("", (_without_path(str(fault), saved),))
    return Dynamics(found.text, tuple(_without_path(one, saved) for one in found.warnings))


def _without_path(text: str, saved: Saved) -> str:
    return text.removeprefix(f"{saved.path}: ")


def _reproduction(found: Sources) -> Reproduction:
    saved, case, folder = found.saved, found.case, found.folder
    given = ["exfit", "fit", str(case.path), "-o", str(folder)]
    if saved.at("strategy") != case.estimate.strategy:
        given += ["--strategy", str(saved.at("strategy"))]
    versions = {name: str(one) for name, one in saved.mapping("versions").items()}
    if versions.get("exfit") != __version__:
        versions["exfit that made this report"] = __version__
    files = {"case": case.path.name, "model": Path(str(case.model)).name}
    trials = (*found.trials, *found.validations)
    labels = [name for name in saved.mapping("inputs") if name not in files]
    files |= {label: one.record.source.name for label, one in zip(labels, trials, strict=True)}
    return Reproduction(
        commands=(shlex.join(given), shlex.join(["exfit", "report", str(folder)])),
        versions=versions,
        hashes={
            label: (files[label], str(sha256)) for label, sha256 in saved.mapping("inputs").items()
        },
        case=case.path.read_text(encoding="utf-8-sig"),
    )
