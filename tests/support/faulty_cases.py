"""Cases with one fault each, drawn at random, and what a fit of each should be called.

A draw takes one of four units whose parameters are known, simulates its test, and adds noise. Then
one thing is made wrong: in the case, in the record, or in what the unit is. What the verdict should
be, and which cause it should name, stands in KINDS, beside the fault and not in view of any fit.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from faulty_units import OF_MODEL, PLANT, UNITS, Unit

from exfit.case.case import Case
from exfit.fitting.build import build_experiments
from exfit.records.record import Record
from exfit.results.cause import Cause

Content = dict[str, Any]
Signals = dict[str, np.ndarray]

GOOD, MATCHES = "good", "matches, not all determined"
MISSES, NO_MATCH, NOT_CONVERGED = "misses the record", "no match", "not converged"
REFUSED = "refused"  # before any fit

NOISES = (5e-5, 1e-4, 3e-4)  # pu, of vt
SAMPLINGS = (0.005, 0.01, 0.02)  # s
AT, DURATION = 1.0, 8.0  # s: the step, and the record
START_ASIDE = 0.3  # how far the logarithm of a start may be from the truth
RANGE = 10.0  # from a bound to the start


@dataclass
class Draft:
    """A case and its record while they are drawn.

    ``unit`` is the content of the case that makes the record, ``case`` of the one that is fitted;
    ``spoil`` changes the record before noise is added, ``cut`` after it.
    """

    rng: np.random.Generator
    of: Unit
    noise: float
    sampling: float
    unit: Content
    case: Content
    spoil: Callable[[np.ndarray, Signals], tuple[np.ndarray, Signals]] = lambda t, y: (t, y)
    cut: Callable[[np.ndarray, Signals], Signals] = lambda t, y: y
    words: str = ""

    @property
    def step(self) -> Content:
        """The step of the case."""
        step: Content = self.case["test"]["vref"][0]
        return step

    def sign(self) -> float:
        """Return one or minus one."""
        return float(self.rng.choice((-1.0, 1.0)))

    def factor(self, low: float, high: float) -> float:
        """Return a factor between two that are above one, or its inverse."""
        return float(self.rng.uniform(low, high) ** self.sign())


@dataclass(frozen=True)
class Kind:
    """A kind of fault: how many are drawn, the verdicts that are right, and the causes.

    Several causes are right where the record looks the same by each of them.
    """

    count: int
    verdicts: tuple[str, ...]
    causes: tuple[str, ...]
    make: Callable[[Draft], None]
    units: tuple[str, ...] = tuple(UNITS)
    steps: tuple[float, ...] = (0.05, 0.03, -0.05)  # pu


@dataclass(frozen=True, eq=False)
class FaultyCase:
    """A case with a fault, the same without it, and the noise of a weighted error.

    ``exact`` is the faulty record before noise was added, ``content`` that of its case.
    """

    kind: str
    words: str
    unit: str
    faulty: Case
    sound: Case
    noise: float
    exact: Signals
    content: Content


def wrong_model(draft: Draft) -> None:
    rival = str(draft.rng.choice(draft.of.rivals))
    fixed, free = OF_MODEL[rival]
    draft.case["model"], draft.words = rival, f"{rival} for {draft.of.model}"
    draft.case["parameters"] = {"fixed": dict(fixed), "free": free_near(free, draft.rng)}


def flipped_sign(draft: Draft) -> None:
    draft.step["step"] *= -1.0
    draft.words = f"step {draft.step['step']:+.3g} pu"


def step_size(draft: Draft) -> None:
    draft.step["step"] *= 1.0 + 0.2 * draft.sign()
    draft.words = f"step {draft.step['step']:+.3g} pu"


def instant(draft: Draft) -> None:
    late = draft.sign() * draft.rng.uniform(0.02, 0.08)
    draft.step["at"] += late
    draft.words = f"step {late:+.3f} s off"


def recorder_delay(draft: Draft) -> None:
    delay = draft.rng.uniform(0.02, 0.1)

    def late(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        return time, {name: np.interp(time - delay, time, y) for name, y in signals.items()}

    draft.spoil, draft.words = late, f"recorder {delay:.3f} s late"


def scaled(draft: Draft, signal: str, factor: float, offset: float = 0.0) -> None:
    def other(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        return time, {**signals, signal: factor * signals[signal] + offset}

    draft.spoil, draft.words = other, f"{signal} times {factor:.3g}, {offset:+.3g} pu"


def base_of_vt(draft: Draft) -> None:
    scaled(draft, "vt", float(draft.rng.choice((1.0 / np.sqrt(3.0), np.sqrt(3.0), 0.92, 1.08))))


def base_of_efd(draft: Draft) -> None:
    scaled(draft, "efd", draft.factor(1.1, 2.5))


def base_of_ifd(draft: Draft) -> None:
    scaled(draft, "ifd", draft.factor(1.1, 2.5))


def other_signal(draft: Draft) -> str:
    return next(name for name in draft.of.noise if name != "vt")


def inverted(draft: Draft) -> None:
    scaled(draft, other_signal(draft), -1.0)


def offset(draft: Draft) -> None:
    scaled(draft, other_signal(draft), 1.0, draft.sign() * draft.rng.uniform(0.05, 0.3))


def machine_value(*names: str, most: float) -> Callable[[Draft], None]:
    def make(draft: Draft) -> None:
        factor = draft.factor(1.2, most)
        own = draft.case["plant"]["parameters"]
        own.update({name: own[name] * factor for name in names})
        draft.words = f"{', '.join(names)} times {factor:.2f}"

    return make


def limit_not_in_case(draft: Draft) -> None:
    ceiling = float(draft.rng.uniform(*draft.of.ceilings))
    draft.unit["parameters"]["fixed"][draft.of.ceiling] = ceiling
    draft.words = f"the unit has {draft.of.ceiling} {ceiling:.2f}"


def limit_not_of_unit(draft: Draft) -> None:
    ceiling = float(draft.rng.uniform(*draft.of.ceilings))
    draft.case["parameters"]["fixed"][draft.of.ceiling] = ceiling
    draft.words = f"the case has {draft.of.ceiling} {ceiling:.2f}"


def wrong_vt0(draft: Draft) -> None:
    own = draft.unit["test"]["vt0"]
    draft.case["test"]["vt0"] = own + draft.sign() * draft.rng.uniform(0.003, 0.03)
    draft.words = f"vt0 {draft.case['test']['vt0']:.4f} for {own:.4f}"


def ripple(draft: Draft) -> None:
    frequency, phase = draft.rng.uniform(49.8, 50.2), draft.rng.uniform(0.0, 2.0 * np.pi)
    height = draft.noise * draft.rng.uniform(1.0, 10.0)

    def hum(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        wave = height * np.sin(2.0 * np.pi * frequency * time + phase)
        return time, {**signals, "vt": signals["vt"] + wave}

    draft.spoil, draft.words = hum, f"ripple of {frequency:.1f} Hz, {height:.1e} pu"


def drift(draft: Draft) -> None:
    way = draft.sign() * draft.noise * draft.rng.uniform(5.0, 50.0)

    def drifting(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        return time, {**signals, "vt": signals["vt"] + way * time / time[-1]}

    draft.spoil, draft.words = drifting, f"vt drifts by {way:+.1e} pu"


def clipped(draft: Draft) -> None:
    share = draft.rng.uniform(0.7, 0.95)
    signal = [*draft.of.noise][-1]

    def cut(time: np.ndarray, signals: Signals) -> Signals:
        level, own = float(np.mean(signals[signal][time < AT])), signals[signal]
        most = level + share * float((own - level)[np.argmax(np.abs(own - level))])
        return {**signals, signal: (np.minimum if most > level else np.maximum)(own, most)}

    draft.cut, draft.words = cut, f"{signal} clipped at {share:.0%} of its way"


def averaging(draft: Draft) -> None:
    window = max(2, round(draft.rng.uniform(0.04, 0.3) / draft.sampling))

    def mean(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        return time, {name: past_mean(y, window) for name, y in signals.items()}

    draft.spoil, draft.words = mean, f"mean over {window * draft.sampling:.2f} s before the sample"


def past_mean(samples: np.ndarray, window: int) -> np.ndarray:
    """Return the mean over the last samples; noise, added later, is that of the recorder."""
    padded = np.concatenate([np.full(window - 1, samples[0]), samples])
    return np.convolve(padded, np.full(window, 1.0 / window), "valid")


def spikes(draft: Draft) -> None:
    count = int(draft.rng.integers(3, 11))
    height = draft.noise * draft.rng.uniform(8.0, 50.0)

    def spiky(time: np.ndarray, signals: Signals) -> tuple[np.ndarray, Signals]:
        rng = np.random.default_rng(count)
        rows = rng.choice(len(time), count, replace=False)
        heights = np.zeros(len(time))
        heights[rows] = height * rng.choice((-1.0, 1.0), count)
        return time, {**signals, "vt": signals["vt"] + heights}

    draft.spoil, draft.words = spiky, f"{count} spikes of {height:.1e} pu"


def excluded_by_bound(draft: Draft) -> None:
    name = str(draft.rng.choice([*draft.of.free]))
    truth, beyond = draft.of.free[name], draft.rng.uniform(1.5, 3.0)
    low, high = (truth * beyond, truth * 10.0) if draft.sign() > 0 else (truth / 10, truth / beyond)
    draft.case["parameters"]["free"][name] = {
        "start": float(np.sqrt(low * high)), "min": low, "max": high,
    }  # fmt: skip
    draft.words = f"{name} {low:.3g} ... {high:.3g} for {truth:.3g}"


def second_step(draft: Draft) -> None:
    at = float(draft.rng.uniform(3.0, 6.5))
    size = float(draft.sign() * draft.rng.uniform(0.001, 0.01))
    draft.unit["test"]["vref"].append({"at": at, "step": size})
    draft.words = f"a second step, {size:+.4f} pu at {at:.2f} s"


def milliseconds(draft: Draft) -> None:
    factor = float(draft.rng.choice((1e-3, 1e3)))
    draft.spoil = lambda time, signals: (time * factor, signals)
    draft.words = f"time column times {factor:g}"


def few_iterations(draft: Draft) -> None:
    draft.case["estimate"] = {"iterations": 2, "search": "local", "strategy": "dgn"}
    draft.words = "2 iterations"


UP = (0.05, 0.03)  # pu: steps that reach a ceiling
SMALL = (MISSES, MATCHES)  # what disturbs the record, not the response: either says so
OTHER_SIGNAL = (MISSES, NO_MATCH)  # vt, by which a match is judged, may suffer or not
KINDS = {
    "wrong model": Kind(16, (MISSES,), ("model",), wrong_model),
    "sign of the step": Kind(12, (NO_MATCH,), ("sign",), flipped_sign),
    "step off by 20 %": Kind(12, (MISSES,), ("size",), step_size),
    "instant": Kind(10, (MISSES,), ("instant",), instant),
    "delay of the recorder": Kind(8, (MISSES,), ("instant",), recorder_delay),
    "base of vt": Kind(10, (MISSES,), ("base", "size"), base_of_vt),
    "base of efd": Kind(8, OTHER_SIGNAL, ("base",), base_of_efd, ("ST1A",)),
    "base of ifd": Kind(8, OTHER_SIGNAL, ("base",), base_of_ifd, ("AC1A, ifd",)),
    "inverted channel": Kind(8, OTHER_SIGNAL, ("inverted",), inverted, ("ST1A", "AC1A, ifd")),
    "offset of a channel": Kind(6, OTHER_SIGNAL, ("base", "offset"), offset, ("ST1A", "AC1A, ifd")),
    "Tpd0": Kind(10, (MISSES,), ("machine",), machine_value("Tpd0", most=1.8)),
    "saturation": Kind(8, (MISSES,), ("machine",), machine_value("S10", "S12", most=3.0)),
    "limit not in the case": Kind(8, (MISSES,), ("limit",), limit_not_in_case, steps=UP),
    "limit not of the unit": Kind(6, (MISSES,), ("limit",), limit_not_of_unit, steps=UP),
    "vt0": Kind(8, (MISSES,), ("vt0",), wrong_vt0),
    "ripple": Kind(10, SMALL, ("ripple",), ripple),
    "drift": Kind(8, SMALL, ("drift",), drift),
    "clipped record": Kind(6, (MISSES,), ("clipped",), clipped),
    "averaging recorder": Kind(8, (MISSES,), ("averages", "instant"), averaging),
    "spikes": Kind(8, SMALL, ("spikes",), spikes),
    "bound excludes the truth": Kind(10, (MISSES,), ("bound",), excluded_by_bound),
    "second step": Kind(6, (MISSES,), ("second step",), second_step),
    "time in ms": Kind(4, (REFUSED, NO_MATCH), ("clock",), milliseconds),
    "too few iterations": Kind(2, (NOT_CONVERGED,), ("iterations",), few_iterations),
}
# by which words of a cause, in the first two lines, it is the right one
WORDS = {
    "model": ("the model",),
    "sign": ("the other way",),
    "size": ("size of the step", "step size"),
    "instant": ("instant", "delay", "later", "earlier"),
    "base": ("base",),
    "inverted": ("inverted", "polarity", "sign of"),
    "offset": ("offset",),
    "machine": ("Tpd0", "S10", "S12", "machine"),
    "limit": ("VRMAX", "VAMAX", "ceiling", "limit"),
    "vt0": ("vt0",),
    "ripple": ("ripple",),
    "drift": ("drift",),
    "clipped": ("clipped", "flat"),
    "averages": ("average",),
    "spikes": ("spike",),
    "bound": ("bound", "on its min", "on its max"),
    "second step": ("further step", "second step", "another step"),
    "clock": ("time column",),
    "iterations": ("iterations",),
}


def free_near(values: Mapping[str, float], rng: np.random.Generator) -> Content:
    """Return free parameters that start near the truth, between wide bounds."""
    starts = {
        name: truth * float(np.exp(rng.uniform(-START_ASIDE, START_ASIDE)))
        for name, truth in values.items()
    }
    return {
        name: {"start": start, "min": start / RANGE, "max": start * RANGE}
        for name, start in starts.items()
    }


def content_of(unit: Unit, weights: Mapping[str, float], step: float) -> Content:
    """Return the case of a unit without free parameters."""
    return {
        "model": unit.model,
        "saturation": "quadratic",
        "given": "exact",
        "plant": deepcopy(PLANT),
        "test": {"vref": [{"at": AT, "step": step}]},
        "record": {"channels": {name: {"weight": weight} for name, weight in weights.items()}},
        "parameters": {"fixed": {**unit.fixed, **unit.free}},
    }


def recorded(content: Content, time: np.ndarray) -> Signals:
    """Return the signals of a unit without noise."""
    signals = dict.fromkeys(content["record"]["channels"], np.ones(len(time)))
    case = Case.from_dict(content, Record.from_arrays(time, signals))
    values = case.values()
    response = build_experiments(case)[0].with_enough_substeps(values).response(values)
    return {name: np.array(response.signals[name]) for name in signals}


def drawn(name: str, seed: tuple[int, ...]) -> FaultyCase:
    """Return a case with a fault of this kind, and the same without it."""
    kind, rng = KINDS[name], np.random.default_rng(seed)
    label = str(rng.choice(kind.units))
    unit = UNITS[label]
    noise, sampling = float(rng.choice(NOISES)), float(rng.choice(SAMPLINGS))
    weights = {signal: 1.0 / times for signal, times in unit.noise.items()}
    described = content_of(unit, weights, float(rng.choice(kind.steps)))
    truth = deepcopy(described)
    truth["test"]["vt0"] = float(rng.uniform(0.98, 1.02))
    case = deepcopy(described)
    case["parameters"] = {"fixed": dict(unit.fixed), "free": free_near(unit.free, rng)}
    sound, draft = deepcopy(case), Draft(rng, unit, noise, sampling, deepcopy(truth), case)
    kind.make(draft)
    time = np.arange(0.0, DURATION, sampling)
    white = {signal: noise * times * rng.standard_normal(len(time))
             for signal, times in unit.noise.items()}  # fmt: skip
    clock, spoilt = draft.spoil(time, recorded(draft.unit, time))
    faulty = Record.from_arrays(clock, draft.cut(clock, noisy(spoilt, white)))
    plain = Record.from_arrays(time, noisy(recorded(truth, time), white))
    return FaultyCase(
        kind=name,
        words=draft.words,
        unit=f"{label}, {noise:g} pu, {1e3 * sampling:g} ms",
        faulty=Case.from_dict(draft.case, faulty, name=name),
        sound=Case.from_dict(sound, plain, name=name),
        noise=noise,
        exact=draft.cut(clock, spoilt),
        content=draft.case,
    )


def noisy(signals: Signals, noise: Signals) -> Signals:
    """Return signals with noise."""
    return {name: samples + noise[name] for name, samples in signals.items()}


def all_faults(seed: int, share: float = 1.0) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield the kind and the seed of every fault, or of a share of each kind."""
    for number, (name, kind) in enumerate(KINDS.items()):
        for repeat in range(max(1, round(share * kind.count))):
            yield name, (seed, number, repeat)


def cause_rank(expected: Sequence[str], causes: Sequence[Cause]) -> int:
    """Return the line, from 1 on, of the first cause that is expected, by its words; else 0."""
    words = [word for cause in expected for word in WORDS[cause]]
    for line, cause in enumerate(causes, 1):
        if any(word in cause.sentence for word in words):
            return line
    return 0
