"""Whether a record contradicts what its case holds fixed: a score test of each such value."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from math import erfc, exp, hypot, inf, log, sqrt
from typing import NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.case.given_errors import given_std_errors
from exfit.errors import SimulationError
from exfit.fitting.nuisances import Nuisance, NuisanceKind
from exfit.fitting.parameters import LARGEST_FACTOR, freed_within
from exfit.fitting.residuals import MOST_NUMBERS_AT_ONCE, Residuals, with_freed
from exfit.fitting.system import parameters_of
from exfit.fitting.uncertainty import slices, slopes_of, spread_of, spread_of_errors
from exfit.inference.whitening import BIAS_KNOWN_TO
from exfit.plants import REFERENCES, SPEED, VT0
from exfit.registry import parts
from exfit.results.cause import Cause, Remedy
from exfit.results.intervals.averages import averaged_residuals, unstated
from exfit.results.intervals.value_errors import Refinement, influence_of_values
from exfit.results.verdict import REJECTED
from exfit.util.arrays import Array
from exfit.util.text import LARGEST, digits, listed
from exfit.verdict.causes import Evidence
from exfit.verdict.causes.channels import check_zero, is_found, measured_vt0, rescaled
from exfit.verdict.causes.trials import (
    LinearFit,
    Opened,
    linear_model,
    moving,
    with_opened,
)
from exfit.verdict.causes.unit import RARE, SATURATION, of_machine, remedy_of

SAME = 1e-6  # of a direction: what other parameters leave of it is rounding below
ALIKE = 4.0  # chi-square: what explains no less is not told apart
LEAST_SHARE = 0.5  # of the largest chi-square: what has less is explained by that
SMALL = 0.1  # change of a logarithm that is given in per cent
LARGEST_CHANGE = log(LARGEST_FACTOR)  # of a logarithm: no given value is farther off


class Held(NamedTuple):
    """A value that a case holds fixed, or one that it takes from the record (``words`` empty).

    ``size`` is by how much it is changed for a derivative; without ``unit`` that is its own size.
    ``rare`` is by how much (log-likelihood) it is less often wrong than other values. ``std_error``
    is that of the value, as the case gives it or by its kind, of its size. ``names`` are those of
    given values, none for what belongs to a test or a record.
    """

    words: str = ""
    remedy: Callable[[], Remedy] = partial(Remedy, "")
    size: float = 1.0
    unit: str = ""
    rare: float = 0.0
    std_error: float = 0.0
    names: tuple[str, ...] = ()

    def better(self, change: float) -> str:
        """Word the change that would match better."""
        if self.unit == "s":
            return f"{1e3 * abs(change):.2g} ms {'later' if change > 0.0 else 'earlier'}"
        if self.unit:
            return f"{change:+.2g} {self.unit}"
        if abs(change) < SMALL:
            return f"{digits(100.0 * abs(change))} % {'more' if change > 0.0 else 'less'}"
        return f"{exp(change):.2g} times"


class Contradiction(NamedTuple):
    """A value that the record contradicts, and which change would match better.

    ``change`` is that change, in the size of the value, uncertain by ``by_record``.
    """

    held: Held
    change: float
    by_record: float

    @property
    def chi_square(self) -> float:
        """Chi-square of the change, against its error and that of the value."""
        return (self.change / hypot(self.by_record, self.held.std_error)) ** 2

    @property
    def gain(self) -> float:
        """By how much chi-square falls where the value is fitted with its standard error.

        That of a test or a record has none that limits it; it is less often wrong than a value.
        """
        by_record = (self.change / self.by_record) ** 2
        if not self.held.names:
            return by_record - 2.0 * self.held.rare
        return by_record * self.held.std_error**2 / (self.held.std_error**2 + self.by_record**2)

    @property
    def explains(self) -> float:
        """By how much chi-square falls: that by the record where nothing is given of it."""
        return self.gain if self.held.names else self.gain + 2.0 * self.held.rare

    @property
    def reason(self) -> str:
        """The value that the record contradicts, with chi-square."""
        return f"the record contradicts {self.held.words} (chi-square {digits(self.chi_square)})"

    @property
    def cause(self) -> Cause:
        """The change that would match better, with a remedy."""
        better = self.held.better(self.change)
        return Cause(f"{self.held.words}: {better} would match better", *self.held.remedy())

    @property
    def likelihood(self) -> float:
        """Log-likelihood that this value is wrong: by the record, and beforehand."""
        return 0.5 * self.chi_square - self.held.rare


class Refuted(NamedTuple):
    """A given value that the record contradicts: it lies ``moved`` of its standard errors off."""

    name: str
    given: float
    found: float
    moved: float
    case: Case

    @property
    def reason(self) -> str:
        """The value that the record contradicts."""
        return f"the record contradicts {self.name} = {self.given:g}"

    @property
    def cause(self) -> Cause:
        """The value that the record gives, with a remedy."""
        words = (
            f"{self.name} is {self.found:.4g}, not {self.given:g} ({self.moved:+.1f} of its errors)"
        )
        check = "check where it comes from, or fit it without its error"
        return Cause(words, *remedy_of(self.case, {self.name: self.found}, check))

    @property
    def likelihood(self) -> float:
        """Log-likelihood that this value is wrong."""
        return 0.5 * self.moved**2


def refuted(evidence: Evidence) -> Iterator[Refuted]:
    """Yield the given values that the fit moved by more than their errors allow."""
    std_errors, asked = given_std_errors(evidence.case), evidence.case.free()
    alone = [free for free in evidence.residuals.free if free.name not in asked]
    given = {free.name: free.prior.mean for free in alone if free.prior}
    for name, value in {**given, **evidence.refined.given}.items():
        found = evidence.values[name]
        moved = (found - value) / std_errors[name]
        if _is_significant(moved**2, max(len(evidence.refined.given), 1)):
            yield Refuted(name, value, found, moved, evidence.case)


def contradictions(evidence: Evidence) -> list[Contradiction]:
    """Test what the case of a record holds fixed, and list what it contradicts, likeliest first.

    The residuals are projected on what a value does that the free parameters cannot do, in their
    own variances: chi-square of one degree of freedom, if the value is right. It may be exceeded
    with 1 %, divided by the number of values (Bonferroni). A value that is given with a standard
    error may be off by that as well.

    Where the errors are weighted by the noise of what drives the simulation, the bias that it has
    by each value is taken out, too; it is as uncertain as the variance of that noise.

    Source: Rao 1948, the score test (Proc. Camb. Phil. Soc. 44, 50-57).
    """
    scores = _scores(evidence)
    rejected = [each for each in scores if _is_significant(each.chi_square, len(scores))]
    largest = max((each.chi_square for each in rejected), default=0.0)
    rejected = [each for each in rejected if each.chi_square > LEAST_SHARE * largest]
    return sorted(rejected, key=lambda each: -each.likelihood)


def value_that_the_record_refines(evidence: Evidence) -> Refinement:
    """Return the given value whose fit with its standard error would explain most, if any.

    It is tested against what it would leave of the errors, which may be far from white before.
    None, too, where what a test or a record holds would explain more, beyond what all values do.
    """
    try:
        linear, directions, shift = _linearised(evidence)
    except SimulationError:
        return Refinement(by_rival=inf)
    tested = [*directions]
    residuals = evidence.residuals

    def scored(spread: Array) -> list[tuple[Contradiction, Array]]:
        pairs = ((_score(held, each, linear, spread, shift), each) for held, each in tested)
        return [(score, each) for score, each in pairs if score is not None]

    scores = scored(spread_of_errors(residuals, linear.beyond(linear.errors), white=True))
    scores.sort(key=lambda each: -each[0].gain)
    rivals, value = list[tuple[Contradiction, Array]](), None
    for best, direction in scores:
        left = spread_of_errors(residuals, linear.beyond(linear.errors + best.change * direction))
        best = _score(best.held, direction, linear, left, shift) or best
        if best.held.names and _is_significant(best.gain, len(scores)):
            value = best
            break
        if not best.held.names:
            rivals.append((best, direction))
    beyond = () if value is None else _beyond_values(evidence, linear, rivals)
    if value is None or any(_is_significant(gain, len(scores)) for gain in beyond):
        return Refinement(by_rival=max((rival.gain for rival, _ in rivals), default=0.0))
    tested += _of_speed(evidence)
    alike = [each for each, _ in scored(left) if each.explains > value.gain - ALIKE]
    rest = [*_averages(evidence, linear, left, value.gain)]
    return _refinement(value.held.names, sorted(alike, key=lambda each: -each.explains), rest)


def _refinement(
    names: tuple[str, ...], alike: Sequence[Contradiction], rest: Sequence[str]
) -> Refinement:
    """Return the refinement of a value beside what explains the record ``alike``."""
    held = [each.held for each in alike if each.held.names != names]
    return Refinement(
        names,
        others=tuple(listed(each.names) for each in held if each.names),
        rivals=(*(each.words for each in held if not each.names), *rest),
    )


def _beyond_values(
    evidence: Evidence, linear: LinearFit, rivals: Sequence[tuple[Contradiction, Array]]
) -> Iterator[float]:
    """Yield by how much chi-square falls with each rival beyond all values within their errors.

    The values are as uncertain as these, all at once: with G their effects in standard errors the
    covariance of the errors is 1 + G G', and the rival's score is taken of that.
    """
    residuals, std_errors = evidence.residuals, given_std_errors(evidence.case)
    of_values = {name: std_errors[name] for name in std_errors if name in residuals.fixed}
    influence = influence_of_values(residuals, evidence.solution.x, of_values) if rivals else None
    whole = linear.beyond(linear.errors)
    columns = np.empty((len(whole), 0))
    if influence is not None:
        columns = linear.beyond(influence.beyond[: len(whole)])
    for rival, direction in rivals:
        own, left = linear.beyond(direction), whole
        for white in (True, False):  # then against what it would leave
            spread = spread_of_errors(residuals, left, white)
            known, moved = columns / spread[:, None], own / spread
            posterior = np.linalg.inv(np.eye(known.shape[1]) + known.T @ known) @ known.T
            score = moved - known @ (posterior @ moved)
            square = float(score @ moved)
            change = -float(score @ (whole / spread)) / square
            left = whole + change * own
            left = left - columns @ (posterior @ (left / spread))
        yield change**2 * square - 2.0 * rival.held.rare


def _of_speed(evidence: Evidence) -> Iterator[tuple[Held, Array]]:
    """Yield what another speed does to the errors, one at rest and one that changes evenly."""
    from exfit.verdict.causes.speed import turning  # of most fits nothing is refined

    count = len(evidence.solution.x)
    for number, residuals, opened in turning(evidence):
        extended = with_opened(residuals, number, opened)
        theta = np.append(evidence.solution.x, extended.start[count:])
        try:
            _, columns = extended.errors(theta, range(count, count + len(opened)))
        except SimulationError:
            continue
        columns /= slopes_of(extended, theta)[count:]
        for words, column in zip(("the speed", "a falling speed"), columns.T, strict=True):
            if np.isfinite(column).all():
                yield Held(f"{words}{evidence.name_of(number)}", unit="pu"), column


def _averages(evidence: Evidence, linear: LinearFit, spread: Array, gain: float) -> Iterator[str]:
    """Yield averages of the recorder, if they explain the errors as well as a value that gains."""
    numbers = [*unstated(evidence.case, evidence.residuals)]
    before = float(np.sum((linear.beyond(linear.errors) / spread) ** 2))
    for _, _, averaged in averaged_residuals(evidence.residuals, numbers) if numbers else ():
        try:
            errors = averaged(evidence.solution.x)[: averaged.count]
        except SimulationError:
            return
        if before - float(np.sum((linear.beyond(errors) / spread) ** 2)) > gain - ALIKE:
            yield "a recorder that averages"
            return


def _is_significant(chi_square: float, tests: int) -> bool:
    """Test chi-square of one degree of freedom, the largest of several tests (Bonferroni)."""
    return erfc(sqrt(0.5 * max(chi_square, 0.0))) * tests < REJECTED


def _scores(evidence: Evidence) -> list[Contradiction]:
    """Test each value that the case holds fixed and that does something."""
    if evidence.uncertainty is None:
        return []
    try:
        linear, directions, shift = _linearised(evidence)
    except SimulationError:
        return []
    spread = spread_of(evidence.residuals, evidence.uncertainty.confidence.noise)
    scores = (_score(held, direction, linear, spread, shift) for held, direction in directions)
    return [score for score in scores if score is not None]


def _score(
    held: Held, direction: Array, linear: LinearFit, spread: Array, shift: Array
) -> Contradiction | None:
    """Test a value, None if it does nothing or too much; ``shift`` (M,) was taken for the bias."""
    own = linear.beyond(direction)
    square = float(own @ own)
    if not square > (SAME**2) * float(direction @ direction):
        return None
    size = sqrt(square)
    by_bias = BIAS_KNOWN_TO * float(own @ shift) / size
    by_record = hypot(float(np.linalg.norm(spread * (own / size))), by_bias) / size
    change = -float(own @ linear.errors) / square
    if not held.unit and max(hypot(by_record, held.std_error), abs(change)) > LARGEST_CHANGE:
        return None
    return Contradiction(held, change, by_record)


def _linearised(evidence: Evidence) -> tuple[LinearFit, Iterator[tuple[Held, Array]], Array]:
    """Return the linear model, and what each value that the case holds fixed does to the errors.

    As many derivatives as fit in memory are taken at once. A voltage that the test takes from the
    record is as uncertain as a parameter.
    """
    extended, of_test, fixed = _left_open(evidence)
    count = len(evidence.solution.x)
    theta = np.append(evidence.solution.x, extended.start[count:])
    if evidence.weighted_by_noise:
        setups = [record.setup for record in evidence.records]
        extended, _ = parts("INPUT_NOISE")["without bias"].load()(extended, setups, theta)
    sizes = slopes_of(extended, theta)
    errors, slopes = extended.errors(theta, range(count + len(of_test)))
    slopes /= sizes[: slopes.shape[1]]
    directions = [
        (held, held.size * each)
        for held, each in zip(of_test, slopes[:, count:].T, strict=True)
        if _is_seen(each)
    ]
    place = {free.name: k for k, free in enumerate(extended.free)}
    from_record = [direction for held, direction in directions if not held.words]
    if refined := [*evidence.refined.given]:  # as likely as the free parameters to be elsewhere
        from_record += [*extended.errors(theta, [place[name] for name in refined])[1].T]
    known = np.column_stack([slopes[:, :count][:, moving(evidence)], *from_record])
    influence, _ = evidence.residuals.influence(errors)

    def tested() -> Iterator[tuple[Held, Array]]:
        yield from (each for each in directions if each[0].words)
        for several in _at_once(_together([*fixed]), MOST_NUMBERS_AT_ONCE // len(errors)):
            names = [name for each in several for name in each]
            _, own = extended.errors(theta, [place[name] for name in names])
            column = dict(zip(names, own.T, strict=True))
            for each in several:
                by_name = [fixed[name] / sizes[place[name]] * column[name] for name in each]
                direction = np.sum(by_name, axis=0)
                if _is_seen(direction):
                    yield _held_value(evidence, each), direction
        yield from _of_channels(evidence, errors)

    return linear_model(influence, known), tested(), extended.bias


def _is_seen(direction: Array) -> bool:
    """Test whether what a value does is a number, and its square."""
    return bool(np.max(np.abs(direction)) < LARGEST)


def _at_once(together: Iterable[tuple[str, ...]], most: int) -> Iterator[list[tuple[str, ...]]]:
    """Yield what belongs together in lists of no more names than ``most``, but one at least."""
    several = list[tuple[str, ...]]()
    for names in together:
        if several and sum(map(len, several)) + len(names) > most:
            yield several
            several = []
        several.append(names)
    if several:
        yield several


def _left_open(evidence: Evidence) -> tuple[Residuals, list[Held], dict[str, float]]:
    """Return residuals that leave open what is tested: that of the tests first, fixed values."""
    extended, of_test = evidence.residuals, list[Held]()
    for number in range(len(evidence.records)):
        for held, opened in _of_test(evidence, number):
            extended = with_opened(extended, number, [opened])
            of_test.append(held)
    rows, used = evidence.case.rows(), parameters_of(evidence.case)
    fixed = {  # what the responses depend on, but for zeros
        name: value
        for name, value in evidence.residuals.fixed.items()
        if value and name in rows and name in used
    }
    freed = [freed_within(name, value, LARGEST_FACTOR) for name, value in fixed.items()]
    tested = {name: value for name, value in fixed.items() if name not in evidence.refined.given}
    return with_freed(extended, freed), of_test, tested


def _together(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Yield names, those of a saturation as one: they come from the same curve."""
    saturation = tuple(name for name in SATURATION if name in names)
    if saturation:
        yield saturation
    yield from ((name,) for name in names if name not in saturation)


def _held_value(evidence: Evidence, names: tuple[str, ...]) -> Held:
    """Return the test of fixed values; those of a curve err as the one that errs most."""
    fixed, std_errors = evidence.residuals.fixed, given_std_errors(evidence.case)
    words = listed([f"{name} = {fixed[name]:.4g}" for name in names])
    return Held(
        words,
        partial(remedy_of, evidence.case, {name: fixed[name] for name in names}),
        rare=0.0 if of_machine(names) else RARE,
        std_error=max(std_errors.get(name, 0.0) / abs(fixed[name]) for name in names),
        names=names,
    )


def _of_test(evidence: Evidence, number: int) -> Iterator[tuple[Held, Opened]]:
    """Yield the steps of a test, their delay, and the voltage that it starts from."""
    experiment, of_record = evidence.residuals.experiments[number], evidence.name_of(number)
    found = {(nuisance.kind, nuisance.step) for nuisance in experiment.nuisances}
    kinds = {kind for kind, _ in found}

    def opened(kind: NuisanceKind, value: float, step: int = 0) -> Opened:
        nuisance = Nuisance(f"held{number}.{kind}{step}", kind, step)
        return Opened(nuisance, value, value - 1.0, value + 1.0)

    steps = experiment.simulator.inputs.steps
    if evidence.case.kind.finds_rest:  # the others are jumps of what is recorded
        steps = tuple(step for step in steps if step.signal in REFERENCES)
    for place, step in enumerate(steps):
        if step.step and step.signal != SPEED and ("step", place) not in found:
            words = f"the size of the step, {step.step:+g} pu{of_record}"
            yield (
                Held(words, _of_steps(evidence, number, {place: step.step}), step.step),
                opened("step", step.step, place),
            )
    if not kinds & {"at", "shift", "delay"} and steps:
        held = Held(f"the time of the step{of_record}", _of_steps(evidence, number, {}), unit="s")
        yield held, opened("delay", experiment.simulator.delay)
    if VT0 in experiment.own and "vt0" not in kinds:
        given = evidence.records[number].given_vt0
        voltage = Held()
        if given:
            remedy = partial(measured_vt0, evidence, number)
            voltage = Held(f"vt0 = {given:g}{of_record}", remedy, unit="pu")
        yield voltage, opened("vt0", experiment.own[VT0])


def _of_steps(evidence: Evidence, number: int, sizes: Mapping[int, float]) -> Callable[[], Remedy]:
    """Make what gives the remedy for the sizes of steps, or for their time where there are none."""

    def remedy() -> Remedy:
        from exfit.verdict.causes.steps import correct_instant, correct_step

        if sizes:
            return correct_step(evidence, number, sizes)
        delay = evidence.residuals.experiments[number].simulator.delay
        return correct_instant(evidence, number, delay)

    return remedy


def _of_channels(evidence: Evidence, errors: Array) -> Iterator[tuple[Held, Array]]:
    """Yield scale and offset of each channel, by what is simulated: a record has noise.

    None of errors that the noise of what drives weighs: what is simulated has that noise, too.
    """
    if evidence.weighted_by_noise:
        return
    places = iter(slices(evidence.residuals.sizes))
    for number, _, experiment, channel in evidence.channels:
        rows, place = next(places), f"{channel.signal}{evidence.name_of(number)}"
        measured = experiment.measured(channel, evidence.values)
        simulated, constant = np.zeros(len(errors)), np.zeros(len(errors))
        simulated[rows] = -errors[rows] - channel.weight * channel.filtered(measured)
        constant[rows] = -channel.weight
        if not is_found(experiment, channel, "scale"):
            rare = RARE if channel.signal == "vt" else 0.0
            remedy = partial(rescaled, evidence, number, channel)
            yield Held(f"the base of {place}", remedy, rare=rare), simulated
        if channel.signal != "vt" and not is_found(experiment, channel, "offset"):
            yield (
                Held(
                    f"the zero of {place}",
                    partial(check_zero, evidence, number, channel),
                    unit="pu",
                ),
                constant,
            )
