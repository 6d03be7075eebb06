"""LLVM IR of runs with located crossings: ``run`` of one segment, between two jumps of the inputs.

Each step of the grid is divided into equal sub-steps, and a sub-step at the crossings of its modes:
where the guard is positive at its end, the first crossing is found by secants and halving, each
trial a Runge-Kutta step to there; the modes are then decided anew and the rest of the sub-step is
taken. Sets side by side locate their crossings at the same time, each at its own. Samples are read
from cubic Hermite polynomials of the states, which never reach across a crossing.
"""

from collections.abc import Sequence
from typing import NamedTuple

from exfit.engine.crossing import MOST_CROSSINGS, TOLERANCE, CrossingSearch
from exfit.engine.driver import ONE, located_runs
from exfit.engine.emit import TracePart, module, rest_function
from exfit.engine.lanes import Slot
from exfit.engine.located import LocatedTrace, located
from exfit.engine.system import System, Trace, trace
from exfit.engine.tangents import Tangents, differentiate, tangents
from exfit.engine.trace import Node, in_order
from exfit.engine.writer import Shape, Values, plan

WINDOW = 32  # steps after which a run is checked for having settled
SETTLED = 1e-9  # pu: by no more will a settled run move until the next segment
EVER = -1e300
STANDS = 1e-200  # 1/s: a guard that moves less has no instant


class _Kind(NamedTuple):
    """The values of a run, or their tangents in several directions: the same steps for either.

    ``given`` are the symbols, and the states within their limits by the natural equations.
    """

    given: Trace | Tangents
    shape: Shape
    mark: str  # of the names of its arrays
    states: tuple[Node, ...]
    slopes: tuple[Node, ...]
    outputs: tuple[Node, ...]
    guard: Node


def simulation(
    system: System,
    outputs: Sequence[str],
    lanes: int,
    free: Sequence[str] | None = None,
    moving: Sequence[str] = (),
) -> str:
    """Return the IR of runs of sets side by side, or of one with ``lanes`` directions."""
    traced = trace(system, outputs)
    derived = None if free is None else differentiate(traced, system, free, moving)
    run = located(traced, system.inputs, system.states)
    shape = Shape(lanes) if derived is None else ONE
    kinds = [_Kind(traced, shape, "", run.states, run.slopes, run.outputs, run.guard)]
    parts = [TracePart(traced, shape)]
    if derived is not None:
        symbols = (*derived.p, *derived.r, *derived.x, *derived.u)
        pairs = zip((*traced.p, *traced.r, *traced.x, *traced.u), symbols, strict=True)
        seeds = {node: tangent for node, tangent in pairs if tangent is not None}
        groups = (run.states, run.slopes, run.outputs, [run.guard])
        states, slopes, moved, guard = (tuple(tangents(group, seeds)) for group in groups)
        kinds.append(_Kind(derived, Shape(lanes), "d", states, slopes, moved, guard[0]))
        parts.append(TracePart(derived, Shape(lanes), "d"))
    body = _Run(run, kinds)
    sizes = (lanes, 0, 0) if derived is None else (1, lanes, len(parts[1].inputs))
    around = located_runs(len(system.states), len(outputs), *sizes)
    return module(parts, {"rest": rest_function(parts)}, body.text + around)


class _Run(CrossingSearch):
    """Writes the function of one segment."""

    def __init__(self, run: LocatedTrace, kinds: Sequence[_Kind]) -> None:
        self.run, self.kinds, self.traced = run, kinds, run.traced
        super().__init__(kinds[0].shape, kinds[-1].shape)
        self.wide = kinds[1] if len(kinds) > 1 else None
        self.shape_of = {x: kind.shape for kind in kinds for x in kind.given.x}
        of_inputs = self.wide.given.u if self.wide else ()
        self.moving = [node for node in of_inputs if node is not None]
        self._write()

    def inputs(self, s: str, rates: bool = False) -> Values:
        """Write the inputs at a fraction of the step, with their slopes where these are wanted."""
        w, nodes = self.w, self.traced.u
        values: Values = {}
        base = w.address("%u", w.let(f"mul i64 {self.get(self.k)}, {4 * len(nodes)}"))
        h = self.splat(self.get(self.step))
        for row, (node, slope) in enumerate(zip(nodes, self.run.v, strict=True)):
            c = [w.spread(w.load(base, 4 * row + power, ONE), self.narrow) for power in range(4)]
            value = w.add_product(self.narrow, c[2], c[3], s)
            value = w.add_product(self.narrow, c[1], value, s)
            values[node] = w.add_product(self.narrow, c[0], value, s)
            if rates:
                slope_value = w.add_product(
                    self.narrow,
                    self.op("fmul", self.number(2.0), c[2]),
                    self.op("fmul", self.number(3.0), c[3]),
                    s,
                )
                slope_value = w.add_product(self.narrow, c[1], slope_value, s)
                values[slope] = self.op("fdiv", slope_value, h)
        if self.moving:
            shape, count = self.broad, len(self.moving)
            place = w.let(f"mul i64 {self.get(self.k)}, {count * shape.lanes}")
            first = w.address("%du", place)
            share = w.spread(s, shape)
            for row, node in enumerate(self.moving):
                a, b = w.load(first, row, shape), w.load(first, count + row, shape)
                values[node] = w.add_product(shape, a, w.arithmetic("fsub", shape, b, a), share)
        return values

    def values_of(self, slots: dict[Node, Slot]) -> Values:
        return {node: self.get(slot) for node, slot in slots.items()}

    def modes_now(self) -> Values:
        return self.values_of(self.modes) | self.values_of(self.signs)

    def nodes(self, group: str) -> list[Node]:
        """The nodes of a group of all kinds: states, slopes or outputs."""
        return [node for kind in self.kinds for node in getattr(kind, group)]

    def of_states(self, group: str, values: Values) -> Values:
        """What is written of a group, under the symbols of the states."""
        results: Values = {}
        for kind in self.kinds:
            written = self.w.results(getattr(kind, group), values, kind.shape)
            results.update(zip(kind.given.x, written, strict=True))
        return results

    def _write(self) -> None:
        w = self.w
        self.fixed = self._fixed()
        share = self._allocate()
        w.put("br label %settle")
        self._attempt()
        self.shrink()
        self._commit()
        self.advance()
        self._settle()
        self._next(share)
        w.label("done")
        for kind in self.kinds:
            for row, node in enumerate(kind.given.x):
                w.store(self.get(self.x[node]), f"%{kind.mark}x", row, kind.shape)
        if self.wide:
            # the next segment may begin at an instant that moves
            u = self.inputs(self.number(1.0), rates=True)
            values = {**self.fixed, **u, **self.values_of(self.x), **self.modes_now()}
            w.prepare(self.run.rates, values)
            for row, rate in enumerate(w.results(self.run.rates, values, self.narrow)):
                w.store(rate, "%f", row, self.narrow)
        w.put("ret void")
        arrays = ["p", "r", "x", "f", "out"]
        if self.wide:
            arrays += ["dp", "dr", "dx", "df", "dtau", "dout", "change", "du"]
        arguments = [f"ptr noalias %{a}" for a in (*arrays, "u", "h", "pos")]
        arguments += [f"i64 %{c}" for c in ("n", "m", "count", "constant")]
        declared = f"declare {self.one} @llvm.fabs.{self.narrow.suffix}({self.one})\n"
        head = declared + f"define internal void @located({', '.join(arguments)}) "
        head += '"prefer-vector-width"="512" "stackrealign" {'
        self.text = "\n".join([head, "entry:", *w.lines, "}", ""])

    def _fixed(self) -> Values:
        """Write what stays the same in a whole run."""
        w, run = self.w, self.run
        fixed: Values = {
            node: w.load(f"%{kind.mark}{array}", row, kind.shape)
            for kind in self.kinds
            for array in "pr"
            for row, node in enumerate(getattr(kind.given, array))
            if node is not None
        }
        targets = [
            *(node for group in ("states", "slopes", "outputs") for node in self.nodes(group)),
            *(node for kind in self.kinds for node in (kind.guard, *kind.given.clamped)),
            *run.modes.first,
            *run.modes.final,
        ]
        if self.wide:
            targets += [run.guard_rate, *run.rates, *run.output_rates, *run.clamp_rates]
        w.prepare([n for n in in_order(targets) if not n.varies and n.op != "symbol"], fixed)
        return fixed

    def _allocate(self) -> str:
        """Write the variables of the loop, and the share of a step that a sub-step is."""
        w, run = self.w, self.run
        self.x: dict[Node, Slot] = {}
        self.f: dict[Node, Slot] = {}
        self.xn: dict[Node, Slot] = {}
        self.fn: dict[Node, Slot] = {}
        for kind in self.kinds:
            for row, node in enumerate(kind.given.x):
                for slots, array in ((self.x, "x"), (self.f, "f")):
                    start = w.load(f"%{kind.mark}{array}", row, kind.shape)
                    slots[node] = self.slot(kind.shape.type, start)
                for slots in (self.xn, self.fn):
                    slots[node] = self.slot(kind.shape.type, kind.shape.number(0.0))
        self.kept = {node: self.slot(self.one, self.get(self.x[node])) for node in self.traced.x}
        self.modes = {bit: self.slot(self.truth, self.false) for bit in run.modes.bits}
        self.signs = {sign: self.slot(self.one, self.number(1.0)) for sign in run.signs}
        m = w.let("sitofp i64 %m to double")
        share = w.let(f"fdiv double {ONE.number(1.0)}, {m}")
        self.allocate_search(share)
        self.after = self.slot(self.one, self.number(EVER))  # samples up to there are read
        self.fresh = self.slot("i1", "true")
        self.k, self.j, self.sample = (self.slot("i64", "0") for _ in range(3))
        self.step = self.slot("double", w.load("%h", 0, ONE))
        self.length = self.slot(self.one, self.splat(self.get(self.step)))
        return share

    def _attempt(self) -> None:
        """Write a Runge-Kutta step from tb to te, with the guard at its end."""
        w, run = self.w, self.run
        w.label("attempt")
        tb, te = self.get(self.tb), self.get(self.te)
        h = self.op("fmul", self.op("fsub", te, tb), self.get(self.length))
        fractions: dict[str, dict[Shape, str]] = {}
        for name, value in (("h", 1), ("2", 1 / 2), ("3", 1 / 3), ("6", 1 / 6)):
            share = self.op("fmul", h, self.number(value))
            fractions[name] = {kind.shape: self.spread(share, kind.shape) for kind in self.kinds}

        def part(name: str, node: Node) -> str:
            return fractions[name][self.shape_of[node]]

        middle = self.inputs(self.op("fmul", self.op("fadd", tb, te), self.number(0.5)))
        end = self.inputs(te, rates=bool(set(run.v) & set(in_order([run.guard]))))
        x, slope = self.values_of(self.x), self.values_of(self.f)
        modes = self.modes_now()
        targets, nodes = self.nodes("slopes"), [*self.shape_of]
        total: Values = {}
        for n in nodes:
            total[n] = w.add_product(self.shape_of[n], x[n], part("6", n), slope[n])
        steps = plan(targets, self.fixed | middle | x | modes)
        for advance, level, weight in (("2", middle, "3"), ("2", middle, "3"), ("h", end, "6")):
            values = {**self.fixed, **level, **modes}
            for n in nodes:
                values[n] = w.add_product(self.shape_of[n], x[n], part(advance, n), slope[n])
            w.follow(steps, values)
            slope = self.of_states("slopes", values)
            for n in nodes:
                total[n] = w.add_product(self.shape_of[n], total[n], part(weight, n), slope[n])
        values = {**self.fixed, **end, **modes, **total}
        w.prepare(self.nodes("states"), values)
        placed = self.of_states("states", values)
        values = {**self.fixed, **end, **modes, **placed}
        w.prepare([*targets, run.guard], values)
        slope = self.of_states("slopes", values)
        for n in nodes:
            self.put(self.xn[n], placed[n])
            self.put(self.fn[n], slope[n])
        guard = w.results([run.guard], values, self.narrow)[0]
        # what is no number is beyond any limit
        for n in self.traced.x:
            guard = w.add_product(self.narrow, guard, slope[n], self.number(0.0))
        self.put(self.g, guard)
        bad = self.both(self.test("ugt", guard, self.number(TOLERANCE)), self.get(self.alive))
        locating = self.test("ogt", self.get(self.count), self.number(0.0))
        over = self.test("oge", self.get(self.met), self.number(MOST_CROSSINGS))
        busy = self.some(self.either(self.either(bad, locating), over))
        self.put(self.committed, self.true)
        for slot in (self.settling, self.going, self.ended):
            self.put(slot, self.false)
        w.put(f"br i1 {busy}, label %slow, label %commit")

    def _commit(self) -> None:
        """Write the samples of a part of a step that is done, and move to its end."""
        w = self.w
        w.label("commit")
        tb, te, after = (self.get(s) for s in (self.tb, self.te, self.after))
        x, f, xn, fn = (self.values_of(s) for s in (self.x, self.f, self.xn, self.fn))
        committed, modes = self.get(self.committed), self.modes_now()
        k = w.let(f"sitofp i64 {self.get(self.k)} to double")
        end = w.let(f"fadd double {k}, {self.get(self.end)}")
        first = self.get(self.sample)
        length = self.op("fsub", te, tb)
        h = self.op("fmul", length, self.get(self.length))
        before = w.block
        w.put("br label %samples")
        w.label("samples")
        w.put(f"%s.k = phi i64 [{first}, %{before}], [%s.next, %sampled.end]")
        w.put(f"br i1 {w.let('icmp slt i64 %s.k, %count')}, label %samples.at, label %samples.done")
        w.label("samples.at")
        position = w.load("%pos", "%s.k", ONE)
        due = w.let(f"fcmp ole double {position}, {end}")
        w.put(f"br i1 {due}, label %sampled, label %samples.done")
        w.label("sampled")
        s, last = w.let(f"fsub double {position}, {k}"), self.get(self.end)
        # the sum of k and the end may be rounded up to the sample, which this difference exceeds
        past = w.let(f"fcmp ogt double {s}, {last}")
        s = self.splat(w.let(f"select i1 {past}, double {last}, double {s}"))
        inside = self.both(self.test("ole", s, te), self.test("ogt", s, after))
        inside = self.both(inside, committed)
        way = self.op("fdiv", self.op("fsub", s, tb), length)
        way = self.pick(self.test("ogt", way, self.number(0.0)), way, self.number(0.0))
        way = self.pick(self.test("olt", way, self.number(1.0)), way, self.number(1.0))
        self._write_sample(s, way, h, (x, f, xn, fn), modes, inside)
        w.put("br label %sampled.end")
        w.label("sampled.end")
        w.put("%s.next = add i64 %s.k, 1")
        w.put("br label %samples")
        w.label("samples.done")
        for slots, old, new in ((self.x, x, xn), (self.f, f, fn)):
            for node, slot in slots.items():
                value = new[node]
                if self.narrow.lanes > 1:
                    value = self.pick(committed, value, old[node])
                self.put(slot, value)
        for slot, value in ((self.tb, te), (self.after, te), (self.g0, self.get(self.g))):
            self.put(slot, self.pick(committed, value, self.get(slot)))
        w.put("br label %advance")

    def _write_sample(
        self,
        s: str,
        way: str,
        h: str,
        ends: tuple[Values, Values, Values, Values],
        modes: Values,
        inside: str,
    ) -> None:
        """Write the outputs at one sample, from the cubic polynomials of the states."""
        w, run = self.w, self.run
        x, f, xn, fn = ends
        left, square = self.line(1.0, -1.0, way), self.op("fmul", way, way)
        both = self.op("fmul", left, left)
        cubic = (
            self.op("fmul", both, self.line(1.0, 2.0, way)),
            self.op("fmul", square, self.line(3.0, -2.0, way)),
            self.op("fmul", h, self.op("fmul", way, both)),
            self.op("fmul", h, self.op("fmul", square, self.line(-1.0, 1.0, way))),
        )
        rates = run.output_rates if self.wide else ()
        needed = set(in_order([*self.nodes("outputs"), *rates]))
        at: Values = {}
        for node in (n for n in self.x if n in needed):
            shape = self.shape_of[node]
            weights = [self.spread(each, shape) for each in cubic]
            value = w.arithmetic("fmul", shape, x[node], weights[0])
            for weight, end in zip(weights[1:], (xn[node], f[node], fn[node]), strict=True):
                value = w.add_product(shape, value, weight, end)
            at[node] = value
        moves = self.test("one", h, self.number(0.0))
        for node, slope in zip(self.traced.x, run.w, strict=True):
            if rates and slope in needed:
                # 6 t (1 - t) of the way there, and what the slopes at both ends add
                change = self.op("fdiv", self.op("fsub", xn[node], x[node]), h)
                turn = self.op("fmul", self.op("fmul", self.number(6.0), way), left)
                value = self.op("fmul", turn, change)
                first = self.op("fmul", left, self.line(1.0, -3.0, way))
                last = self.op("fmul", way, self.line(-2.0, 3.0, way))
                value = w.add_product(self.narrow, value, first, f[node])
                value = w.add_product(self.narrow, value, last, fn[node])
                at[slope] = self.pick(moves, value, self.number(0.0))
        values = {**self.fixed, **modes, **self.inputs(s, bool(rates)), **at}
        w.prepare([*self.nodes("outputs"), *rates], values)
        for kind in self.kinds:
            results = w.results(kind.outputs, values, kind.shape)
            self._write_row(f"%{kind.mark}out", results, kind.shape, inside)
        if rates:
            results = w.results(rates, values, self.narrow)
            self._write_row("%change", results, self.narrow, inside)

    def _write_row(self, array: str, results: Sequence[str], shape: Shape, inside: str) -> None:
        """Write a sample where it lies inside of what is done."""
        w = self.w
        base = w.address(array, w.let(f"mul i64 %s.k, {len(results) * shape.lanes}"))
        for row, value in enumerate(results):
            old = w.load(base, row, shape)
            kept = w.let(f"select {self.truth} {inside}, {shape.type} {value}, {shape.type} {old}")
            w.store(kept, base, row, shape)

    def _settle(self) -> None:
        """Write how the modes are decided, and the states and tangents behind a crossing."""
        w, run, traced = self.w, self.run, self.traced
        w.label("settle")
        u = self.inputs(self.get(self.tb), rates=True)
        x, f = self.values_of(self.x), self.values_of(self.f)
        old, mask = self.modes_now(), self.get(self.settling)
        shift = self._shifted(u, x, f, old)
        values = {**self.fixed, **u, **x}
        w.prepare([n for kind in self.kinds for n in kind.given.clamped], values)
        at: Values = {}
        at.update(zip(traced.x, w.results(traced.clamped, values, self.narrow), strict=True))
        dx = self._clamped_tangents(values, shift)
        modes = self._decide({**self.fixed, **u, **at}, old, mask)
        if self.narrow.lanes > 1:
            at = {n: self.pick(mask, at[n], x[n]) for n in traced.x}
        values = {**self.fixed, **u, **at, **modes}
        w.prepare(run.states, values)
        placed: Values = {}
        placed.update(zip(traced.x, w.results(run.states, values, self.narrow), strict=True))
        values = {**self.fixed, **u, **modes, **placed}
        w.prepare([*run.slopes, run.guard], values)
        slopes = dict(zip(traced.x, w.results(run.slopes, values, self.narrow), strict=True))
        guard = w.results([run.guard], values, self.narrow)[0]
        for n in traced.x:
            self.put(self.x[n], self.pick(mask, placed[n], x[n]))
            self.put(self.f[n], self.pick(mask, slopes[n], f[n]))
        self.put(self.g0, self.pick(mask, guard, self.get(self.g0)))
        if self.wide:
            shape, symbols = self.broad, self.wide.given.x
            back = w.negative(shape, shift)
            for n, d in zip(traced.x, symbols, strict=True):
                dx[d] = w.add_product(shape, dx[d], back, w.spread(slopes[n], shape))
            values = {**self.fixed, **u, **at, **modes, **dx}
            w.prepare(self.wide.states, values)
            dx.update(zip(symbols, w.results(self.wide.states, values, shape), strict=True))
            values = {**self.fixed, **u, **modes, **placed, **dx}
            w.prepare(self.wide.slopes, values)
            for d, slope in zip(symbols, w.results(self.wide.slopes, values, shape), strict=True):
                self.put(self.x[d], dx[d])
                self.put(self.f[d], slope)
        self.put(self.fresh, "false")
        w.put("br label %whole")

    def _shifted(self, u: Values, x: Values, f: Values, old: Values) -> str:
        """Write the tangents of the instant, and move those of the states before it by that.

        The instant of a crossing is where the guard stays zero; that of a jump is given.
        """
        if self.wide is None:
            return ""
        w, run, shape = self.w, self.run, self.broad
        values = {**self.fixed, **u, **x, **old}
        w.prepare([self.wide.guard, run.guard_rate, *run.rates], values)
        rate = w.results([run.guard_rate], values, self.narrow)[0]
        moves = self.test("ogt", self.size(rate), self.number(STANDS))
        inverse = self.op("fdiv", self.number(-1.0), self.pick(moves, rate, self.number(1.0)))
        inverse = self.pick(moves, inverse, self.number(0.0))
        guard = w.results([self.wide.guard], values, shape)[0]
        crossing = w.arithmetic("fmul", shape, guard, w.spread(inverse, shape))
        given = w.load("%dtau", 0, shape)
        fresh = self.get(self.fresh)
        shift = w.let(f"select i1 {fresh}, {shape.type} {given}, {shape.type} {crossing}")
        rates = w.results(run.rates, values, self.narrow)
        for n, rate, d in zip(self.traced.x, rates, self.wide.given.x, strict=True):
            slope = self.pick(fresh, f[n], rate)
            x[d] = w.add_product(shape, x[d], shift, w.spread(slope, shape))
        return shift

    def _clamped_tangents(self, values: Values, shift: str) -> Values:
        """Write the tangents of the states that are put back within their limits."""
        tangents_there: Values = {}
        if self.wide:
            w, shape = self.w, self.broad
            w.prepare(self.run.clamp_rates, values)
            rates = w.results(self.run.clamp_rates, values, shape)
            moved = w.results(self.wide.given.clamped, values, shape)
            for d, value, rate in zip(self.wide.given.x, moved, rates, strict=True):
                tangents_there[d] = w.add_product(shape, value, rate, shift)
        return tangents_there

    def _decide(self, given: Values, old: Values, mask: str) -> Values:
        """Write the modes at a state, where they are decided anew."""
        w, run, truth = self.w, self.run, self.truth
        values = {**given}
        w.prepare(run.modes.first, values)
        first: Values = {}
        first.update((b, values[n]) for b, n in zip(run.modes.bits, run.modes.first, strict=True))
        values = {**given, **first, **self._signs(first)}
        w.prepare(run.modes.final, values)
        bits: Values = {}
        for bit, node in zip(run.modes.bits, run.modes.final, strict=True):
            new = f"{truth} {values[node]}, {truth} {old[bit]}"
            bits[bit] = w.let(f"select {truth} {mask}, {new}")
            self.put(self.modes[bit], bits[bit])
        signs = self._signs(bits)
        for sign, slot in self.signs.items():
            self.put(slot, signs[sign])
        return bits | signs

    def _signs(self, bits: Values) -> Values:
        return {
            sign: self.pick(bits[bit], self.number(-1.0), self.number(1.0))
            for sign, bit in zip(self.run.signs, self.run.modes.bits, strict=False)
        }

    def _next(self, share: str) -> None:
        """Write the way to the next sub-step, the next step, or the end where all has settled."""
        w = self.w
        w.label("next")
        k = w.let(f"sitofp i64 {self.get(self.k)} to double")
        end = w.let(f"fadd double {k}, {self.get(self.end)}")
        first, before = self.get(self.sample), w.block
        w.put("br label %passed")
        w.label("passed")
        w.put(f"%q.k = phi i64 [{first}, %{before}], [%q.next, %passed.at]")
        w.put(f"br i1 {w.let('icmp slt i64 %q.k, %count')}, label %passed.at, label %passed.done")
        w.label("passed.at")
        w.put("%q.next = add i64 %q.k, 1")
        due = w.let(f"fcmp ole double {w.load('%pos', '%q.k', ONE)}, {end}")
        w.put(f"br i1 {due}, label %passed, label %passed.done")
        w.label("passed.done")
        self.put(self.sample, "%q.k")
        j = w.let(f"add i64 {self.get(self.j)}, 1")
        more = w.let(f"icmp slt i64 {j}, %m")
        self.put(self.tb, self.splat(self.get(self.end)))
        self.put(self.after, self.number(EVER))  # what is read is passed
        w.put(f"br i1 {more}, label %substep, label %step")

        w.label("step")
        k = w.let(f"add i64 {self.get(self.k)}, 1")
        w.put(f"br i1 {w.let(f'icmp slt i64 {k}, %n')}, label %step.next, label %done")
        w.label("step.next")
        self.put(self.k, k)
        self.put(self.step, w.load("%h", k, ONE))
        for slot in (self.tb, self.after):
            self.put(slot, self.number(0.0))
        rest = w.let(f"and i64 {k}, {WINDOW - 1}")
        now = w.let(f"icmp eq i64 {rest}, 0")
        check = w.let(f"and i1 {now}, {w.let('icmp ne i64 %constant, 0')}")
        w.put(f"br i1 {check}, label %settled, label %lengths")
        w.label("settled")
        left = w.let(f"sitofp i64 {w.let(f'sub i64 %n, {k}')} to double")
        limit = self.splat(w.let(f"fdiv double {ONE.number(SETTLED * WINDOW)}, {left}"))
        still = self.get(self.still)
        quiet = ""
        for node in self.traced.x:
            x, kept = self.get(self.x[node]), self.get(self.kept[node])
            self.put(self.kept[node], x)
            moved, size = self.size(self.op("fsub", x, kept)), self.size(x)
            size = self.pick(self.test("ogt", size, self.number(1.0)), size, self.number(1.0))
            little = self.test("ole", moved, self.op("fmul", limit, size))
            quiet = self.both(quiet, little) if quiet else little
        if quiet:
            still = self.either(still, quiet)
        self.put(self.still, still)
        w.put(f"br i1 {self.every(still)}, label %skip, label %lengths")
        w.label("skip")
        self.put(self.k, w.let("sub i64 %n, 1"))
        self.put(self.after, self.number(EVER))
        w.put("br label %lengths")
        w.label("lengths")
        h = self.splat(self.get(self.step))
        self.put(self.length, self.pick(self.get(self.still), self.number(0.0), h))
        w.put("br label %substep")

        w.label("substep")
        j = w.let(f"phi i64 [{j}, %passed.done], [0, %lengths]")
        self.put(self.j, j)
        following = w.let(f"add i64 {j}, 1")
        number = w.let(f"sitofp i64 {following} to double")
        part = w.let(f"fmul double {number}, {share}")
        last = w.let(f"icmp eq i64 {following}, %m")
        end = w.let(f"select i1 {last}, double {ONE.number(1.0)}, double {part}")
        self.put(self.end, end)
        self.put(self.te, self.splat(end))
        for slot in (self.count, self.met):
            self.put(slot, self.number(0.0))
        self.put(self.fine, self.false)
        w.put("br label %attempt")
