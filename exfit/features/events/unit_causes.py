"""What the case of a grid event says of the unit beside its exciter: swing, controls, transformer.

Each is tried by one more fit of the record, of a unit that is otherwise in this.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from exfit.case.case import Case
from exfit.case.changes import between, freed, number_text
from exfit.case.parts import added_part
from exfit.case.schema import Governor, Stabiliser
from exfit.fitting.parameters import FreeParameter, freed_within
from exfit.fitting.residuals import Residuals, with_freed
from exfit.fitting.system import system_of
from exfit.models import GOVERNORS, STABILISERS
from exfit.models.sheet import Model
from exfit.plants import GOVERNOR, MACHINE, NETWORK, STABILISER
from exfit.results.cause import Cause
from exfit.verdict.causes.evidence import Evidence, Suspicion, likelihood, suspected
from exfit.verdict.causes.exciters import STRUCTURE
from exfit.verdict.causes.trials import refitted, tried

LARGEST_FACTOR = 4.0  # of the inertia
MOST_DAMPING = 20.0  # pu
LARGEST_TRANSFORMER, USUAL_TRANSFORMER = 0.5, 0.1  # pu, reactance
NO_LIMIT = 9.0  # pu
STAND_INS = {  # simple governors: of steam, and of water, whose power at first goes the other way
    "TGOV1": {"VMAX": NO_LIMIT, "VMIN": -NO_LIMIT},
    "HYGOV": {"GMAX": NO_LIMIT, "GMIN": -NO_LIMIT},
}
STARTS = {
    "TGOV1": {"R": 0.05, "T1": 0.5, "T3": 10.0},
    "HYGOV": {"R": 0.05, "Tr": 5.0, "TW": 1.5},
}
NUMBERS_OF_STAND_IN = 3
WIDE = 20.0  # times: from the start to the bounds
MOST_LEFT = 0.5  # of the error beyond the noise, by a stand-in that is like the unit's control
LIKELIER_THAN_MODEL = 1.0  # log-likelihood
INERTIA, DAMPING, REACTANCE = f"{MACHINE}H", f"{MACHINE}D", f"{NETWORK}X"
FORMS = {
    "standard": "the mechanical power is constant, (Pm - D dw) / (1 + dw)",
    "andes": "the mechanical torque is constant, Pm - D dw",
}


def with_plant_keys(case: Case, **keys: Any) -> Case:
    """Return a case with other keys of its plant, such as ``dialect``; they are not checked."""
    return replace(case, plant=case.plant.model_copy(update=keys))


def with_control(
    case: Case,
    prefix: str,
    section: Governor | Stabiliser | None = None,
    model: Model | None = None,
) -> Case:
    """Return a case with another governor or stabiliser; without any by default."""
    kind = prefix.rstrip(".")
    others = tuple(part for part in case.parts.all if part.kind != kind)
    added = () if model is None else (added_part(kind, prefix, model),)
    of_parts: dict[str, Any] = {kind: model, "all": (*others, *added)}
    keys: dict[str, Any] = {kind: section, "parts": case.parts._replace(**of_parts)}
    return replace(case, **keys)


def of_case(evidence: Evidence, other: Case) -> Residuals:
    """Return the residuals of the same records by a unit as another case has it.

    Parameters that this has not are not free; those that it adds have the values of that case.
    """
    own, values = evidence.residuals, other.values()
    experiments = [
        replace(
            experiment, simulator=experiment.simulator.remade(system=system_of(other, recording))
        )
        for experiment, recording in zip(own.experiments, other.recordings, strict=True)
    ]
    lost = evidence.case.values().keys() - values.keys()
    free = [parameter for parameter in own.free if parameter.name not in lost]
    names = {parameter.name for parameter in free}
    fixed = {name: value for name, value in {**values, **own.fixed}.items() if name not in names}
    return replace(own, experiments=experiments, free=free, fixed=fixed, counter=None)


def other_swing(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the form of the equation of the speed."""
    own = getattr(evidence.case.plant, "dialect", "standard")
    form = "standard" if own == "andes" else "andes"
    cause = Cause(
        f"the equation of the speed: dialect: {form} would match (the case has {own})",
        f"right where the record is that of a simulator in which {FORMS[form]}",
        form,
        {"plant.dialect": form},
    )
    residuals = of_case(evidence, with_plant_keys(evidence.case, dialect=form))
    yield from tried(evidence, residuals, cause)


def missing_governor(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a missing governor, by the one of two simple ones that matches better."""
    if evidence.case.parts.governor is not None:
        return
    trials = {}
    for name, data in STAND_INS.items():
        section = Governor(model=name, parameters=data)
        governed = with_control(evidence.case, GOVERNOR, section, GOVERNORS[name])
        opened = [
            FreeParameter(f"{GOVERNOR}{symbol}", at, at / WIDE, at * WIDE, logarithmic=True)
            for symbol, at in STARTS[name].items()
        ]
        trial = refitted(evidence, with_freed(of_case(evidence, governed), opened))
        if trial is not None:
            trials[name] = trial
    if not trials:
        return
    name = min(trials, key=lambda name: trials[name].cost)
    trial = trials[name]
    data = STAND_INS[name] | {each: trial.values[f"{GOVERNOR}{each}"] for each in STARTS[name]}
    cause = Cause(
        f"a governor that the case lacks: P follows the speed; a {name} would match",
        "if one was in service, add it, by its own model if that is known",
        "governor",
        {"governor": f"{{model: {name}, {_parameters(data)}}}"},
    )
    prior = of_stand_in(evidence, trial.cost)
    yield from suspected(evidence, trial.cost, len(STARTS[name]), cause, prior)


def _parameters(data: Mapping[str, float]) -> str:
    """Write parameters in the form of a case."""
    values = ", ".join(f"{name}: {number_text(value)}" for name, value in data.items())
    return f"parameters: {{{values}}}"


def of_stand_in(evidence: Evidence, cost: float) -> float:
    """Gain in likelihood of a control over its simple stand-in, at the cost with that.

    Where the stand-in explains most, the rest may show that the unit's control is of another kind.
    """
    noise = evidence.noise_cost
    if cost - noise > MOST_LEFT * (evidence.cost - noise):
        return 0.0
    own = likelihood(evidence, noise + STRUCTURE * (evidence.cost - noise))
    return max(0.0, own + LIKELIER_THAN_MODEL - likelihood(evidence, cost, NUMBERS_OF_STAND_IN))


def missing_stabiliser(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect a missing stabiliser, by a simple one of speed or power that would match."""
    case = evidence.case
    recorded = any("vs" in recording.record.channels for recording in case.recordings)
    if case.parts.stabiliser is not None or recorded:
        return
    gain, washout, lead = (f"{STABILISER}{name}" for name in ("K_T", "T", "T1_T3"))
    for heard, start, low, high in (("speed", 5.0, 0.0, 200.0), ("p", -0.1, -20.0, 0.0)):
        data = {"HLIM": NO_LIMIT, "T2_T4": 1.0, "T1_T3": 2.0}
        section = Stabiliser(model="STAB1", inputs=(heard,), parameters=data)
        other = with_control(case, STABILISER, section, STABILISERS["STAB1"])
        opened = [
            FreeParameter(gain, start, low, high, logarithmic=False),
            FreeParameter(washout, 3.0, 0.3, 30.0, logarithmic=True),
            FreeParameter(lead, 2.0, 0.1, 50.0, logarithmic=True),
        ]

        if trial := refitted(evidence, with_freed(of_case(evidence, other), opened)):
            of_model = {
                name.removeprefix(STABILISER): trial.values[name] for name in (gain, washout, lead)
            }
            found = data | of_model
            amplification = trial.values[gain] * trial.values[washout]
            cause = Cause(
                f"a stabiliser that the case lacks: one with input {heard} and a gain of "
                f"{amplification:.2g} would match",
                "if one was in service, add it, by its own model if that is known, or give its "
                "output as channel vs",
                "stabiliser",
                {"stabiliser": f"{{model: STAB1, inputs: [{heard}], {_parameters(found)}}}"},
            )
            prior = of_stand_in(evidence, trial.cost)
            yield from suspected(evidence, trial, len(opened), cause, prior)


def idle_control(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the governor or the stabiliser of the case of being out of service."""
    case = evidence.case
    tied = [name for tie in case.ties.by_name.values() for name in tie.names]
    controls = {GOVERNOR: case.parts.governor, STABILISER: case.parts.stabiliser}
    for prefix, model in controls.items():
        if model is None or any(name.startswith(prefix) for name in tied):
            continue
        kind = prefix.rstrip(".")
        cause = Cause(
            f"the {kind} {model.name}: the record would match without it",
            "was it in service?",
            f"without-{kind}",
            {kind: ""},
        )
        residuals = of_case(evidence, with_control(case, prefix))
        yield from tried(evidence, residuals, cause)


def other_motion(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the inertia or the damping of the machine."""
    fixed = evidence.residuals.fixed
    inertia, damping = fixed.get(INERTIA), fixed.get(DAMPING)
    parameters = []
    if inertia:
        parameters.append(freed_within(INERTIA, inertia, LARGEST_FACTOR))
    if damping is not None:
        high = MOST_DAMPING + damping
        low = min(0.0, damping)
        parameters.append(FreeParameter(DAMPING, damping, low, high, logarithmic=False))
    for parameter in parameters:
        yield from _other_number(evidence, parameter, "check the data of the machine and turbine")


def other_transformer(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the transformer, or the side of it on which powers are recorded."""
    case, reactance = evidence.case, evidence.residuals.fixed.get(REACTANCE)
    if reactance is None:
        return
    own = getattr(case.plant, "power_at", "recorded-voltage")
    place = "terminals" if own == "recorded-voltage" else "recorded-voltage"
    other = of_case(evidence, with_plant_keys(case, power_at=place))
    largest = LARGEST_TRANSFORMER + reactance
    start = reactance or USUAL_TRANSFORMER
    open_value = FreeParameter(REACTANCE, start, 0.0, largest, logarithmic=False)
    check = "check on which side of the step-up transformer vt is recorded, and its X on this base"
    yield from _other_number(evidence, open_value, check)
    if reactance:
        cause = Cause(
            f"the place of p and q: power_at: {place} would match (the case has {own})",
            "check on which side of the step-up transformer they are recorded",
            place,
            {"plant.power_at": place},
        )
        yield from tried(evidence, other, cause)
        return

    if trial := refitted(evidence, with_freed(other, [open_value])):
        text = (
            f"vt is recorded behind a transformer, p and q at the {place}: network.X "
            f"{trial.values[REACTANCE]:.3g} with power_at: {place} would match"
        )
        changes = {
            "plant.power_at": place,
            **freed(case, {REACTANCE: trial.values[REACTANCE]}),
        }
        yield from suspected(evidence, trial, 2, Cause(text, check, "transformer", changes))


def _other_number(evidence: Evidence, parameter: FreeParameter, check: str) -> Iterator[Suspicion]:
    """Suspect a fixed number, if another one would match."""
    given = evidence.residuals.fixed[parameter.name]
    if trial := refitted(evidence, with_freed(evidence.residuals, [parameter])):
        found, name = trial.values[parameter.name], parameter.name
        text = f"{name} {found:.3g} would match (given {given:g})"
        words, changes = "" if name == REACTANCE else ", or free it", dict[str, str]()
        changes |= freed(evidence.case, {name: found})
        if name == DAMPING:  # it may be 0
            found_between = between(found, parameter.low, parameter.high)
            changes |= {"plant.free.D": f"{found_between[:-1]}, scale: linear}}"}
        yield from suspected(evidence, trial, 1, Cause(text, check + words, name, changes))
