"""The search for the instant at which a mode ends, by each set for itself.

A part of a sub-step goes from ``tb`` to ``te``, shares of the step; ``g`` is the guard at its end,
``g0`` that at its beginning. While ``count`` is not zero a crossing lies between ``lo`` and ``hi``.
"""

from exfit.engine.driver import ONE
from exfit.engine.lanes import Lanes

TOLERANCE = 1e-10  # pu: a mode holds until its margin is passed by more,
AIM, ENOUGH = 3e-10, 1e-9  # and a crossing is where it is passed by so much, or up to that
CLOSE = 1e-10  # of a step: as near as a crossing is located
MOST_TRIALS = 60.0  # steps that locate one crossing
MOST_CROSSINGS = 12.0  # in a sub-step; each part of the rest begins with its own modes
MINI = 1.0 / 8.0  # of a sub-step: the parts of one in which there is a crossing


class CrossingSearch(Lanes):
    """Writes how a crossing is located, and where the next trial ends."""

    def allocate_search(self, share: str) -> None:
        """Write the variables of the search; ``share`` of a step is the first sub-step's end."""
        zero, end = self.number(0.0), self.splat(share)
        self.tb, self.te = self.slot(self.one, zero), self.slot(self.one, end)
        self.g, self.g0, self.next = (self.slot(self.one, zero) for _ in range(3))
        self.lo, self.hi, self.hi2 = (self.slot(self.one, zero) for _ in range(3))
        self.glo, self.ghi, self.ghi2 = (self.slot(self.one, zero) for _ in range(3))
        self.count, self.side, self.met = (self.slot(self.one, zero) for _ in range(3))
        self.alive, self.committed, self.settling = (
            self.slot(self.truth, self.true) for _ in range(3)
        )
        self.still, self.going, self.ended = (self.slot(self.truth, self.false) for _ in range(3))
        self.fine = self.slot(self.truth, self.false)
        self.end = self.slot("double", share)

    def shrink(self) -> None:
        """Write how the bracket of a crossing shrinks, and where the next trial ends."""
        w = self.w
        w.label("slow")
        tb, te, g = self.get(self.tb), self.get(self.te), self.get(self.g)
        count, side, met = self.get(self.count), self.get(self.side), self.get(self.met)
        lo, hi, glo, ghi = (self.get(s) for s in (self.lo, self.hi, self.glo, self.ghi))
        locating = self.test("ogt", count, self.number(0.0))
        bad = self.both(self.test("ugt", g, self.number(TOLERANCE)), self.get(self.alive))
        over = self.both(self.no(locating), self.test("oge", met, self.number(MOST_CROSSINGS)))
        bad = self.both(bad, self.no(over))
        fine = self.get(self.fine)
        new, above = self.both(bad, self.no(locating)), self.both(bad, locating)
        # a crossing is located within a short part, at whose end the slopes are more exact
        self.put(self.fine, self.either(fine, new))
        new = self.both(new, fine)
        below = self.both(locating, self.no(bad))
        shifted = self.op("fsub", g, self.number(AIM))
        start = self.op("fsub", self.get(self.g0), self.number(AIM))
        start = self.pick(self.test("olt", start, self.number(-AIM)), start, self.number(-AIM))
        half = self.number(0.5)
        hi2, ghi2 = (
            self.pick(above, hi, self.get(self.hi2)),
            self.pick(above, ghi, self.get(self.ghi2)),
        )
        glo = self.pick(new, start, self.pick(below, shifted, glo))
        ghi = self.pick(bad, shifted, ghi)
        again = self.both(below, self.test("olt", side, self.number(-0.5)))
        lo = self.pick(new, tb, self.pick(below, te, lo))
        hi = self.pick(bad, te, hi)
        hi2, ghi2 = self.pick(new, hi, hi2), self.pick(new, ghi, ghi2)
        side = self.pick(
            new,
            self.number(0.0),
            self.pick(above, self.number(1.0), self.pick(below, self.number(-1.0), side)),
        )
        count = self.pick(
            new,
            self.number(1.0),
            self.op("fadd", count, self.pick(locating, self.number(1.0), self.number(0.0))),
        )
        width = self.op("fsub", hi, lo)
        close = self.either(
            self.test("ole", width, self.number(CLOSE)),
            self.test("oge", count, self.number(MOST_TRIALS)),
        )
        there = self.both(above, self.either(close, self.test("ole", g, self.number(ENOUGH))))
        ended = self.both(self.no(bad), self.no(locating))
        # from both sides, or from two places behind it: before it another guard may be the largest
        away = self.pick(above, self.op("fsub", hi, hi2), width)
        falls = self.op("fsub", ghi, self.pick(above, ghi2, glo))
        guess = self.op("fsub", hi, self.op("fdiv", self.op("fmul", ghi, away), falls))
        inside = self.both(self.test("olt", lo, guess), self.test("olt", guess, hi))
        inside = self.both(inside, self.no(again))
        guess = self.pick(inside, guess, w.add_product(self.narrow, lo, width, half))
        for slot, value in (
            (self.lo, lo),
            (self.hi, hi),
            (self.glo, glo),
            (self.ghi, ghi),
            (self.side, side),
            (self.hi2, hi2),
            (self.ghi2, ghi2),
            (self.count, count),
            (self.next, self.pick(close, hi, guess)),
            (self.going, self.both(self.either(new, locating), self.no(there))),
            (self.ended, ended),
            (self.settling, self.either(there, over)),
        ):
            self.put(slot, value)
        lost = self.both(there, self.test("uno", g, g))
        self.put(self.alive, self.both(self.get(self.alive), self.no(lost)))
        self.put(
            self.met, self.op("fadd", met, self.pick(there, self.number(1.0), self.number(0.0)))
        )
        committed = self.either(there, ended)
        self.put(self.committed, committed)
        w.put(f"br i1 {self.some(committed)}, label %commit, label %advance")

    def advance(self) -> None:
        """Write where the next part of the sub-step ends, and whether modes are decided first."""
        w = self.w
        w.label("advance")
        last = self.splat(self.get(self.end))
        m = w.let("sitofp i64 %m to double")
        mini = self.splat(w.let(f"fdiv double {ONE.number(MINI)}, {m}"))
        short = self.op("fadd", self.get(self.tb), mini)
        short = self.pick(self.test("olt", short, last), short, last)
        end = self.pick(self.get(self.fine), short, last)
        self.put(self.te, self.pick(self.get(self.going), self.get(self.next), end))
        done = self.get(self.committed)
        self.put(self.count, self.pick(done, self.number(0.0), self.get(self.count)))
        settles = self.some(self.get(self.settling))
        w.put(f"br i1 {settles}, label %settle, label %whole")
        w.label("whole")
        last = self.splat(self.get(self.end))
        done = self.every(self.test("oge", self.get(self.tb), last))
        w.put(f"br i1 {done}, label %next, label %attempt")
