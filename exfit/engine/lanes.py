"""Instructions for loops in which every set side by side decides for itself."""

from typing import NamedTuple

from exfit.engine.writer import Shape, Writer


class Slot(NamedTuple):
    """A variable of a loop: its type and its place."""

    type: str
    place: str


class Lanes:
    """Writes what holds one number, or one truth, for each set; ``broad`` is that of tangents."""

    def __init__(self, narrow: Shape, broad: Shape) -> None:
        self.narrow, self.broad = narrow, broad
        self.w = Writer(narrow, broad)
        self.one, self.truth = narrow.type, narrow.of("i1")
        alone = narrow.lanes == 1
        self.true = "true" if alone else "splat (i1 true)"
        self.false = "false" if alone else "zeroinitializer"

    def slot(self, type_: str, start: str) -> Slot:
        """Make a variable with its first value."""
        place = self.w.let(f"alloca {type_}, align 64")
        self.w.put(f"store {type_} {start}, ptr {place}, align 64")
        return Slot(type_, place)

    def get(self, slot: Slot) -> str:
        """Read a variable."""
        return self.w.let(f"load {slot.type}, ptr {slot.place}, align 64")

    def put(self, slot: Slot, value: str) -> None:
        """Write a variable."""
        self.w.put(f"store {slot.type} {value}, ptr {slot.place}, align 64")

    def number(self, value: float) -> str:
        """A constant, the same for every set."""
        return self.narrow.number(value)

    def op(self, op: str, a: str, b: str) -> str:
        """Write a floating-point operation."""
        return self.w.arithmetic(op, self.narrow, a, b)

    def test(self, comparison: str, a: str, b: str) -> str:
        """Write a comparison."""
        return self.w.let(f"fcmp {comparison} {self.one} {a}, {b}")

    def both(self, a: str, b: str) -> str:
        """Write a and b."""
        return self.w.let(f"and {self.truth} {a}, {b}")

    def either(self, a: str, b: str) -> str:
        """Write a or b."""
        return self.w.let(f"or {self.truth} {a}, {b}")

    def no(self, a: str) -> str:
        """Write not a."""
        return self.w.let(f"xor {self.truth} {a}, {self.true}")

    def pick(self, condition: str, a: str, b: str) -> str:
        """Write a where a condition holds, else b."""
        return self.w.let(f"select {self.truth} {condition}, {self.one} {a}, {self.one} {b}")

    def some(self, condition: str) -> str:
        """Bit that is set where a condition holds in any lane."""
        if self.narrow.lanes == 1:
            return condition
        bits = f"i{self.narrow.lanes}"
        packed = self.w.let(f"bitcast {self.truth} {condition} to {bits}")
        return self.w.let(f"icmp ne {bits} {packed}, 0")

    def every(self, condition: str) -> str:
        """Bit that is set where a condition holds for all sets."""
        return self.w.let(f"xor i1 {self.some(self.no(condition))}, true")

    def size(self, value: str) -> str:
        """Write an absolute value."""
        name = f"@llvm.fabs.{self.narrow.suffix}"
        return self.w.let(f"call {self.one} {name}({self.one} {value})")

    def spread(self, value: str, shape: Shape) -> str:
        """A value of one set in every direction."""
        return value if shape == self.narrow else self.w.spread(value, shape)

    def splat(self, scalar: str) -> str:
        """A number for every set."""
        return self.w.spread(scalar, self.narrow)

    def line(self, start: float, slope: float, way: str) -> str:
        """Write a linear function."""
        return self.w.add_product(self.narrow, self.number(start), self.number(slope), way)
