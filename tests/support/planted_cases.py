"""Cases of eight exciters whose truth is known, in which something that the case gives is wrong.

A draw simulates the test of a unit, adds noise, and makes a case of the record: given values are
off, the recorder or the stimulus is not as the case says, or the model is another one of its
family; or nothing is wrong. What one of the first causes should name stands beside each fault.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, replace
from itertools import cycle

import numpy as np
from faulty_cases import (
    AT,
    DURATION,
    NOISES,
    SAMPLINGS,
    Content,
    Draft,
    Signals,
    content_of,
    free_near,
    noisy,
    other_signal,
    past_mean,
    recorded,
    scaled,
)
from faulty_units import AC1A, AC8B, BRUSHLESS, PLANT, ST1A, Unit
from scipy.signal import butter, lfilter, lfilter_zi

from exfit.case.case import Case
from exfit.case.schema import CaseDocument
from exfit.errors import ExfitError
from exfit.models import MODELS
from exfit.models.sheet import typical
from exfit.records.record import Record
from exfit.results.cause import Cause
from exfit.util.vocabulary import SOURCES

CERTIFIED = 1e-3  # standard error of a value with a certificate, of the value
CERTIFICATE = "certificate" if "certificate" in SOURCES else "measured"
OFF_BY_PLANNER = (0.03, 0.14)
OFF = ((0.02, 0.05), (0.05, 0.10), (0.10, 0.15))  # by strength: how far a given value is off
COUNTS = (1, 2, 4)  # of given values that are off
SETTLED = 4  # turns of the iteration by which vt follows the speed
NODES = 40  # of a table behind the step, denser where the voltage moves
VT_ALONE = 0.5  # of the records of a unit that has another channel, too
QUOTIENT = 1e-3  # of the logarithm of a parameter
STEPS, LONGEST = 5, 0.3  # of Gauss-Newton, in these logarithms
MACHINE: Mapping[str, tuple[str, ...]] = {"Tpd0": ("Tpd0",), "saturation": ("S10", "S12")}
Noise = Mapping[str, float]
VT: Noise = {"vt": 1.0}
VT_EFD: Noise = {"vt": 1.0, "efd": 50.0}


def unit_of(
    model: str, noise: Noise, fixed: Mapping[str, float], free: Mapping[str, float], rival: str
) -> Unit:
    """Return a unit that has typical values, but for those stated."""
    held = {**typical(MODELS[model].sheet), **fixed}
    held = {name: value for name, value in held.items() if name not in free}
    return Unit(model, held, free, noise, (rival,), "", (0.0, 0.0))


EXCITER_GIVEN = {
    "AC1A": "TE KC KD KE",
    "AC8B": "TE KC KD KE VRMAX",
    "EXAC1": "TE TC TB KC KD KE",
    "REXS": "TE KF TF KC KD KE",
    "DC4B": "TE TA KE VRMAX",
    "ST1A": "TC TB TR KC",
    "ST3A": "TC TB TM KP KC",
    "ST6B": "KG TG TR",
}  # what the case gives of each, which may be wrong, beside T'd0 and the saturation
WITHOUT_TE = {name: value for name, value in BRUSHLESS.items() if name != "TE"}
PID = {"KPR": 78.84, "KIR": 6.0, "KDR": 30.0, "TDR": 0.1638}
UNITS = {
    "AC1A": unit_of("AC1A", {"vt": 1.0, "ifd": 10.0}, {**AC1A, "TE": 1.6724}, WITHOUT_TE, "AC8B"),
    "AC8B": unit_of("AC8B", VT, {**AC8B, "TE": 1.4044, "VRMAX": 8.0}, PID, "AC1A"),
    "EXAC1": unit_of(
        "EXAC1", VT, {"TC": 0.6, "TB": 3.0}, {"KA": 300.0, "KF": 0.03, "TF": 1.2}, "AC8B"
    ),
    "REXS": unit_of("REXS", VT, {}, {"KVP": 30.0, "KVI": 25.0, "KIP": 5.0}, "AC1A"),
    "DC4B": unit_of("DC4B", VT_EFD, {}, {"KP": 40.0, "KI": 15.0, "KD": 10.0}, "DC1A"),
    "ST1A": unit_of("ST1A", VT_EFD, {**ST1A, "TB": 8.0, "TC": 1.0}, {"KA": 190.0, "TA": 0.03},
                    "ST6B"),
    "ST3A": unit_of("ST3A", VT_EFD, {}, {"KM": 7.93, "KA": 150.0}, "ST6B"),
    "ST6B": unit_of("ST6B", VT_EFD, {}, {"KPA": 18.0, "KIA": 30.0, "KM": 1.0}, "ST1A"),
}  # fmt: skip
RIVALS = {
    **UNITS,
    "DC1A": unit_of(
        "DC1A", VT, {"KE": 1.0, "VRMAX": 8.0, "VRMIN": -8.0},
        {"KA": 100.0, "KF": 0.05, "TF": 1.0, "TE": 0.6}, "",
    ),
}  # fmt: skip
TWO_CHANNELS = tuple(name for name, unit in UNITS.items() if len(unit.noise) > 1)
LEAD_LAG = ("EXAC1", "ST1A", "ST3A")
WITHOUT_SUPPLY = ("AC1A", "AC8B", "EXAC1", "REXS", "ST1A")  # vt enters as what is regulated alone


def averages(draft: Draft, level: int, centred: bool) -> None:
    window = (0.04, 0.1, 0.2)[level]
    length = round(window / min(SAMPLINGS))
    every = length if draft.rng.random() < 0.5 else round(draft.sampling / min(SAMPLINGS))
    draft.sampling = min(SAMPLINGS)
    first = length // 2 if centred else 0

    def mean(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        means = {name: past_mean(y, length)[first::every] for name, y in signals.items()}
        return time[: len(time) - first : every], means

    draft.spoil = mean
    place = "centred" if centred else "trailing"
    draft.words = f"{place} means over {window:g} s, one in {every * draft.sampling:g} s"


def filtered(draft: Draft, level: int) -> None:
    cutoff = (10.0, 4.0, 1.5)[level]
    b, a = butter(2, cutoff, fs=1.0 / draft.sampling)

    def low(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        at_rest = lfilter_zi(b, a)
        return time, {name: lfilter(b, a, y, zi=at_rest * y[0])[0] for name, y in signals.items()}

    draft.spoil, draft.words = low, f"filter of second order at {cutoff:g} Hz"


def polarity(draft: Draft, level: int) -> None:
    scaled(draft, other_signal(draft), -1.0)


def base(draft: Draft, level: int) -> None:
    low, high = ((1.01, 1.02), (1.03, 1.06), (1.08, 1.2))[level]
    scaled(draft, str(draft.rng.choice([*draft.of.noise])), draft.factor(low, high))


def clipped(draft: Draft, level: int) -> None:
    signal, share = [*draft.of.noise][-1], (0.95, 0.85, 0.7)[level]

    def cut(time: np.ndarray, signals: Signals) -> Signals:
        own = signals[signal]
        rest = float(own[0])
        most = rest + share * float((own - rest)[np.argmax(np.abs(own - rest))])
        return {**signals, signal: (np.minimum if most > rest else np.maximum)(own, most)}

    draft.cut, draft.words = cut, f"{signal} clipped at {share:.0%} of its way"


def ripple(draft: Draft, level: int) -> None:
    height = draft.noise * (1.0, 3.0, 10.0)[level]
    frequency, phase = draft.rng.uniform(49.8, 50.2), draft.rng.uniform(0.0, 2.0 * np.pi)

    def hum(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        wave = height * np.sin(2.0 * np.pi * frequency * time + phase)
        return time, {**signals, "vt": signals["vt"] + wave}

    draft.spoil, draft.words = hum, f"ripple of {frequency:.2f} Hz, {height:.1e} pu"


def clock(draft: Draft, level: int) -> None:
    factor = (1e3, 1e-3, 60.0)[level]
    draft.spoil = lambda time, signals: (time * factor, signals)
    draft.words = f"time column times {factor:g}"


def step_of_unit(draft: Draft) -> Content:
    step: Content = draft.unit["test"]["vref"][0]
    return step


def ramp(draft: Draft, level: int) -> None:
    step_of_unit(draft)["ramp"] = (0.05, 0.2, 0.5)[level]
    draft.words = f"ramp over {step_of_unit(draft)['ramp']:g} s"


def delay(draft: Draft, level: int) -> None:
    late = draft.sign() * (0.01, 0.03, 0.1)[level]
    step_of_unit(draft)["at"] += late
    draft.words = f"step {late:+g} s late"


def size(draft: Draft, level: int) -> None:
    factor = 1.0 + draft.sign() * (0.02, 0.05, 0.15)[level]
    step_of_unit(draft)["step"] *= factor
    draft.words = f"step times {factor:g}"


def further_step(draft: Draft, level: int) -> None:
    step = draft.sign() * (0.001, 0.003, 0.01)[level]
    at = float(draft.rng.uniform(3.0, 6.5))
    draft.unit["test"]["vref"].append({"at": at, "step": step})
    draft.words = f"a second step, {step:+g} pu at {at:.2f} s"


def off_nominal(draft: Draft, level: int) -> None:
    follow_speed(draft, 1.0 + draft.sign() * (0.01, 0.02, 0.04)[level], 0.0)


def falling(draft: Draft, level: int) -> None:
    follow_speed(draft, 1.0, (0.005, 0.02, 0.04)[level])


def follow_speed(draft: Draft, at_start: float, lost: float) -> None:
    """Let the voltage be speed times flux, which the regulator sees as well.

    The flux is what is simulated: what the speed adds to it enters as a signal at the summing
    point, of the last response; each turn leaves some hundredth of the error.
    """
    nodes = np.array([0.0, *(AT + (DURATION - AT) * np.linspace(0.0, 1.0, NODES) ** 2)])
    draft.unit["test"]["vt0"] /= at_start

    def speed(time: np.ndarray) -> np.ndarray:
        return at_start - lost * time / DURATION

    for _ in range(SETTLED):
        more = -(speed(nodes) - 1.0) * recorded(draft.unit, nodes)["vt"]
        draft.unit["test"]["vs"] = {"table": np.column_stack([nodes, more]).tolist()}
    draft.spoil = lambda time, y: (time, {**y, "vt": speed(time) * y["vt"]})
    draft.words = f"speed {at_start:.3f} to {at_start - lost:.3f}"


def wrong_model(draft: Draft, level: int) -> None:
    rival = RIVALS[draft.of.rivals[0]]
    draft.case["model"], draft.words = rival.model, f"{rival.model} for {draft.of.model}"
    draft.case["parameters"] = {
        "fixed": dict(rival.fixed), "free": free_near(rival.free, draft.rng)
    }  # fmt: skip


@dataclass(frozen=True)
class Kind:
    """A kind of fault: its group, how it is made, by what words a cause names it at a strength."""

    group: str
    make: Callable[[Draft, int], None]
    words: tuple[str, ...]
    units: tuple[str, ...] = tuple(UNITS)
    weak_words: tuple[str, ...] = ()


AVERAGES = ("averag", "filter")  # a filter looks like a mean over some window
INSTANT = ("time of the step", "delay")
KINDS = {
    "centred means": Kind("recorder", lambda d, n: averages(d, n, centred=True), AVERAGES),
    "trailing means": Kind("recorder", lambda d, n: averages(d, n, centred=False), AVERAGES),
    "filter": Kind("recorder", filtered, AVERAGES, weak_words=INSTANT),
    "polarity": Kind("recorder", polarity, ("inverted", "polarity"), TWO_CHANNELS),
    "base": Kind("recorder", base, ("base",)),
    "clipped": Kind("recorder", clipped, ("clipped",)),
    "ripple": Kind("recorder", ripple, ("ripple",)),
    "clock": Kind("recorder", clock, ("time column",)),
    "ramp": Kind("stimulus", ramp, ("ramp",), weak_words=INSTANT),
    "delay": Kind("stimulus", delay, INSTANT),
    "size": Kind("stimulus", size, ("size of the step",)),
    "further step": Kind("stimulus", further_step, ("further step",)),
    "speed": Kind("stimulus", off_nominal, ("speed",), WITHOUT_SUPPLY),
    "falling speed": Kind("stimulus", falling, ("speed",), WITHOUT_SUPPLY),
    "model": Kind("model", wrong_model, ("the model", "type of exciter")),
}
REPEATS = {"recorder": 4, "stimulus": 4, "model": 13}  # of each strength


@dataclass(frozen=True)
class Task:
    """What is drawn: a kind (of `KINDS`, right, values, planner), its strength, a unit, a seed."""

    kind: str
    level: int
    unit: str
    seed: tuple[int, ...]

    @property
    def group(self) -> str:
        """The group of the kind."""
        return KINDS[self.kind].group if self.kind in KINDS else self.kind

    @property
    def key(self) -> str:
        """What no other task is called."""
        return f"{self.kind} {self.level} {self.unit} {'.'.join(map(str, self.seed))}"


def tasks(seed: int) -> list[Task]:
    """List the 400 draws of a seed, mixed so that the first of them are of all kinds."""
    drawn: list[Task] = []

    def add(kind: str, level: int, unit: str) -> None:
        drawn.append(Task(kind, level, unit, (seed, len(drawn))))

    for number in range(64):
        add("right", 0, [*UNITS][number % len(UNITS)])
    for number in range(129):
        add("values", number % len(OFF), [*UNITS][number // len(OFF) % len(UNITS)])
    for kind, of in KINDS.items():
        units = cycle(of.units)
        for number in range(len(OFF) * REPEATS[of.group]):
            add(kind, number % len(OFF), next(units))
    order = np.random.default_rng(0).permutation(len(drawn))
    return [drawn[place] for place in order]


def planner_tasks(seed: int) -> list[Task]:
    """List twelve units whose planner has TC and TB off."""
    units = cycle(LEAD_LAG)
    return [Task("planner", 0, next(units), (seed, number)) for number in range(12)]


@dataclass(frozen=True, eq=False)
class WrongCase:
    """A drawn case: in words what is wrong, and what a cause should name.

    ``exact`` is the same case with all it gives as exact, of a right case; ``truth`` by parameter;
    ``noise`` by signal (pu), ``chance`` its chi-square in this record. ``seen`` is the chi-square
    that the fault leaves in the record beside the best values of the free parameters; None where
    the truth is not among them.
    """

    words: str
    case: Case
    exact: Case | None
    truth: Mapping[str, float]
    names: tuple[str, ...]
    noise: Mapping[str, float]
    chance: float
    seen: float | None


def drawn(task: Task) -> WrongCase:
    """Return the case of a task."""
    rng, unit = np.random.default_rng(task.seed), UNITS[task.unit]
    if rng.random() < VT_ALONE and task.kind != "polarity":
        unit = replace(unit, noise=VT)
    noise, sampling = float(rng.choice(NOISES)), float(rng.choice(SAMPLINGS))
    weights = {signal: 1.0 / times for signal, times in unit.noise.items()}
    step = float(rng.choice((0.05, 0.03, -0.05)))
    case = content_of(unit, weights, step)
    own = deepcopy(case)
    own["test"]["vt0"] = float(rng.uniform(0.98, 1.02))
    case["test"]["vt0"] = {"start": "auto"}  # as exfit new writes it
    del case["given"]  # exact in the other studies
    case["parameters"] = {"fixed": dict(unit.fixed), "free": free_near(unit.free, rng)}
    draft = Draft(rng, unit, noise, sampling, own, case)
    names: tuple[str, ...] = ()
    if task.kind == "values":
        names = values_off(draft, task.level)
    elif task.kind == "planner":
        names = planner_off(draft)
    elif task.kind == "right":
        certify(draft)
    else:
        kind = KINDS[task.kind]
        kind.make(draft, task.level)
        names = kind.words + (kind.weak_words if task.level == 0 else ())
    time = np.arange(0.0, DURATION, draft.sampling)
    instants, spoilt = draft.spoil(time, recorded(draft.unit, time))
    exact = draft.cut(instants, spoilt)
    white = {signal: noise * times * rng.standard_normal(len(instants))
             for signal, times in unit.noise.items()}  # fmt: skip
    record = Record.from_arrays(instants, draft.cut(instants, noisy(spoilt, white)))
    stated = Case.from_dict(draft.case, record, name=task.kind)
    as_exact = None
    if task.kind == "right":
        as_exact = Case.from_dict(without_errors(draft.case), record, name="exact")
    has_truth = task.kind not in ("model", "clock", "right")
    return WrongCase(
        words=draft.words,
        case=stated,
        exact=as_exact,
        truth={} if task.kind == "model" else truth_of(unit),
        names=names,
        noise={signal: noise * times for signal, times in unit.noise.items()},
        chance=sum(
            float(np.sum((white[name] / (noise * unit.noise[name])) ** 2)) for name in white
        ),
        seen=seen(draft, instants, exact) if has_truth else None,
    )


def truth_of(unit: Unit) -> dict[str, float]:
    """Return the true value of every parameter, by its name in a result."""
    machine = {f"machine.{name}": value for name, value in PLANT["parameters"].items()}
    return {**unit.fixed, **unit.free, **machine}


def given_of(draft: Draft) -> Iterator[tuple[Content, tuple[str, ...]]]:
    """Yield what the case gives and may be wrong: where it stands, and its names."""
    for name in EXCITER_GIVEN[draft.of.model].split():
        yield draft.case["parameters"]["fixed"], (name,)
    for names in MACHINE.values():
        yield draft.case["plant"]["parameters"], names


def values_off(draft: Draft, level: int) -> tuple[str, ...]:
    """Put one, two or four given values off; return patterns of their names."""
    given, texts, patterns = [*given_of(draft)], [], list[str]()
    for place in draft.rng.choice(len(given), int(draft.rng.choice(COUNTS)), replace=False):
        section, names = given[place]
        factor = 1.0 + draft.sign() * draft.rng.uniform(*OFF[level])
        section.update({name: section[name] * factor for name in names})
        texts.append(f"{' '.join(names)} times {factor:.3f}")
        patterns += [rf"\b{name}\b" for name in names]
    draft.words = ", ".join(texts)
    return tuple(patterns)


def planner_off(draft: Draft) -> tuple[str, ...]:
    """Put TC and TB off, in a case of which all is from a planner; return patterns of names."""
    fixed, texts = draft.case["parameters"]["fixed"], []
    draft.case["parameters"]["sources"] = dict.fromkeys(fixed, "planner")
    plant = draft.case["plant"]
    plant["sources"] = dict.fromkeys(plant["parameters"], "planner")
    for name in ("TC", "TB"):
        factor = 1.0 + draft.sign() * draft.rng.uniform(*OFF_BY_PLANNER)
        fixed[name] *= factor
        texts.append(f"{name} times {factor:.3f}")
    draft.words = ", ".join(texts)
    return (r"\bTC\b", r"\bTB\b")


def certify(draft: Draft) -> None:
    """State the source of all that is given, and the errors of some, which they have then."""
    sections = (
        (draft.case["parameters"], draft.case["parameters"]["fixed"]),
        (draft.case["plant"], draft.case["plant"]["parameters"]),
    )
    for part, values in sections:
        part["sources"], part["std_errors"] = dict.fromkeys(values, CERTIFICATE), {}
    for of, names in given_of(draft):
        part = next(part for part, values in sections if values is of)
        for name in names:
            part["std_errors"][name] = CERTIFIED * abs(of[name])
            of[name] += part["std_errors"][name] * draft.rng.standard_normal()
    draft.words = "nothing"


def without_errors(case: Content) -> Content:
    """Return a case in which all that it gives is exact."""
    exact = deepcopy(case)
    for section in (exact["parameters"], exact["plant"]):
        section.pop("std_errors", None)
        section.pop("sources", None)
    return {**exact, "given": "exact"} if "given" in CaseDocument.model_fields else exact


def seen(draft: Draft, time: np.ndarray, exact: Signals) -> float:
    """Return the chi-square of what the fault leaves in the record beside the best values.

    These are found by a few steps of Gauss-Newton from the truth, over the logarithms of the free
    parameters and the level of vt.
    """
    unit, content = draft.of, deepcopy(draft.case)

    def weighted(signals: Signals) -> np.ndarray:
        return np.concatenate(
            [signals[name] / (draft.noise * times) for name, times in unit.noise.items()]
        )

    def response(moves: np.ndarray) -> np.ndarray:
        free = np.array([*unit.free.values()]) * np.exp(moves[:-1])
        values = {**draft.case["parameters"]["fixed"], **dict(zip(unit.free, free, strict=True))}
        content["test"]["vt0"] = float(exact["vt"][0] * np.exp(moves[-1]))
        return weighted(recorded({**content, "parameters": {"fixed": values}}, time))

    moves, least = np.zeros(len(unit.free) + 1), np.inf
    with suppress(ExfitError):  # a step led to where nothing responds
        for _ in range(STEPS):
            at = response(moves)
            left = weighted(exact) - at
            least = min(least, float(left @ left))
            slopes = [response(moves + QUOTIENT * one) - at for one in np.eye(len(moves))]
            best = np.linalg.lstsq(np.column_stack(slopes) / QUOTIENT, left, rcond=None)[0]
            moves = moves + np.clip(best, -LONGEST, LONGEST)
    return least


def cause_line(names: Sequence[str], causes: Sequence[Cause]) -> int:
    """Return the line, from 1 on, of the first cause that has one of these names, else 0."""
    for line, cause in enumerate(causes, 1):
        if any(re.search(name, cause.cause) for name in names):
            return line
    return 0
