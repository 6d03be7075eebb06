"""Loops around the machine code of a system: many parameter sets in one call, sampled as they run.

A call releases the interpreter's lock once, however many sets it runs. What it works on stands in
tables of addresses and counts, whose rows `sampling` describes.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from exfit.engine.sampling import (
    ALONG,
    AT_REST,
    JOB,
    LOCATED_JOB,
    LOCATED_SPAN,
    LOCATED_WORK,
    SAMPLES,
    SPAN,
    WORK,
)
from exfit.engine.writer import Shape, Writer

ARGUMENTS = (
    *("i64 %count", "ptr %jobs", "ptr %lanes", "i64 %segments"),
    *("i64 %samples", "i64 %points", "i64 %columns", "ptr %work"),
)

ONE = Shape(1)


def sampled(sets: int, outputs: int, directions: int, moving: int) -> str:
    """Return the IR of ``sampled``: ``rest``, ``run`` of all segments and samples of many jobs.

    A job has so many sets side by side; without ``directions`` there are no derivatives. ``moving``
    is how many inputs move: their tangents are sums of ``columns`` shapes over the grid, each at
    the rate that it has in a direction.
    """
    w = Writer(ONE, ONE)
    work = of_row(w, "%work", "0", WORK)
    with loop(w, "job", "%count") as k:
        job = of_row(w, "%jobs", k, JOB)
        states = [work["r"], work["x"]]
        tangents = [job["dp"], work["dr"], work["dx"]] if directions else []
        last = ["null"] if directions else []
        w.put(f"call void @rest({pointers(job['p'], *states, 'null', *tangents, *last)})")
        with loop(w, "segment", "%segments") as number:
            span = of_row(w, job["spans"], number, SPAN)
            row = w.let(f"mul i64 {whole(w, span['row'])}, {outputs * sets}")
            arrays = [job["p"], *states, w.address(work["out"], row), *tangents]
            if directions:
                wide = w.let(f"mul i64 {row}, {directions}")
                arrays += [w.address(work["dout"], wide)]
            arrays += [span["u"]]
            n = whole(w, span["n"])
            if moving:
                arrays += [work["du"]]
                given = pointers(span["shapes"], job["rates"], work["du"])
                w.put(f"call void @moved({given}, i64 {n}, i64 %columns)")
            h = w.let(f"bitcast i64 {whole(w, span['h'])} to double")
            steps = f"double {h}, i64 {n}, i64 {whole(w, span['parts'])}"
            w.put(f"call void @run({pointers(*arrays)}, {steps})")
        with loop(w, "lane", str(sets)) as lane:
            place = w.let(f"add i64 {w.let(f'mul i64 {k}, {sets}')}, {lane}")
            reading = of_row(w, "%lanes", place, SAMPLES)
            still = w.let(f"icmp eq ptr {reading['slopes']}, null")
            changing = w.let(f"select i1 {still}, i64 0, i64 %samples")
            with loop(w, "output", str(outputs)) as y:
                column = w.let(f"add i64 {w.let(f'mul i64 {y}, {sets}')}, {lane}")

                def read(shape: Shape, run: str, weights: str, out: str, samples: str) -> None:
                    first = w.address(work[run], w.let(f"mul i64 {column}, {shape.lanes}"))
                    into = w.address(reading[out], w.let(f"mul i64 {y}, {shape.lanes}"))
                    arrays = pointers(first, reading["rows"], reading[weights], into)
                    counts = f"i64 {samples}, i64 %points, i64 {outputs * sets}, i64 {outputs}"
                    w.put(f"call void @read_{shape.suffix}({arrays}, {counts})")

                read(ONE, "out", "weights", "out", "%samples")
                if directions:
                    read(ONE, "out", "slopes", "change", changing)
                    read(Shape(directions), "dout", "weights", "dout", "%samples")
    w.put("ret void")
    heads = [reader(ONE), *([reader(Shape(directions))] if directions else [])]
    if moving:
        heads.append(moved_inputs(Shape(directions), moving))
    return "".join([*heads, defined("void @sampled", ARGUMENTS, w)])


def located_runs(states: int, outputs: int, sets: int, directions: int, moving: int) -> str:
    """Return the IR of ``located_runs``: rest and all segments of many jobs."""
    w = Writer(ONE, ONE)
    with loop(w, "job", "%count") as k:
        job, work = of_row(w, "%jobs", k, LOCATED_JOB), of_row(w, "%work", "0", LOCATED_WORK)
        for array, size in (("f", states * sets), ("df", states * directions)):
            if size:
                with loop(w, f"zero.{array}", str(size)) as row:
                    place = w.address(work[array], row)
                    w.put(f"store double {ONE.number(0.0)}, ptr {place}, align 8")
        rest = [job["p"], work["r"], work["x"], "null"]
        if directions:
            rest += [job["dp"], work["dr"], work["dx"], "null"]
        w.put(f"call void @rest({pointers(*rest)})")
        with loop(w, "segment", "%segments") as number:
            span = of_row(w, job["spans"], number, LOCATED_SPAN)
            row = w.let(f"mul i64 {whole(w, span['first'])}, {outputs * sets}")
            n = whole(w, span["n"])
            arrays = [job["p"], work["r"], work["x"], work["f"], w.address(job["out"], row)]
            if directions:
                if moving:
                    given = pointers(span["shapes"], job["rates"], work["du"])
                    w.put(f"call void @moved({given}, i64 {n}, i64 %columns)")
                wide = w.let(f"mul i64 {row}, {directions}")
                instant = w.let(f"mul i64 {number}, {directions}")
                arrays += [job["dp"], work["dr"], work["dx"], work["df"]]
                arrays += [w.address(job["dtau"], instant), w.address(job["dout"], wide)]
                arrays += [w.address(job["change"], row), work["du"]]
            arrays += [span["u"], span["h"], span["pos"]]
            counts = ", ".join(
                f"i64 {whole(w, span[name])}" for name in ("parts", "samples", "still")
            )
            w.put(f"call void @located({pointers(*arrays)}, i64 {n}, {counts})")
    w.put("ret void")
    arguments = ("i64 %count", "ptr %jobs", "i64 %segments", "i64 %columns", "ptr %work")
    heads = moved_inputs(Shape(directions), moving) if moving else ""
    return heads + defined("void @located_runs", arguments, w)


def at_rest(parameters: int, states: int, directions: int) -> str:
    """Return the IR of ``at_rest``: the states, slopes and Jacobian at rest of many sets."""
    w = Writer(ONE, ONE)
    with loop(w, "set", "%count") as k:
        p, x, slopes = (
            _of_number(w, k, array, size)
            for array, size in (("%p", parameters), ("%x", states), ("%slopes", states))
        )
        starting = pointers(p, "%r", x, "null", "%dp", "%dr", "%dx", "null")
        w.put(f"call void @rest({starting})")
        _linearise(w, k, (p, x, slopes, "%u"), states, directions)
    w.put("ret void")
    arguments = ("i64 %count", *(f"ptr %{name}" for name in AT_REST))
    return defined("void @at_rest", arguments, w)


def along(states: int, inputs: int, directions: int) -> str:
    """Return the IR of ``along``: the slopes of one set and their Jacobian at many states."""
    w = Writer(ONE, ONE)
    with loop(w, "point", "%count") as k:
        x, slopes, u = (
            _of_number(w, k, array, size)
            for array, size in (("%x", states), ("%slopes", states), ("%u", inputs))
        )
        _linearise(w, k, ("%p", x, slopes, u), states, directions)
    w.put("ret void")
    arguments = ("i64 %count", *(f"ptr %{name}" for name in ALONG))
    return defined("void @along", arguments, w)


def _linearise(
    w: Writer, k: str, arrays: tuple[str, str, str, str], states: int, directions: int
) -> None:
    """Write the calls that give the slopes for p, x and u, and the blocks of their Jacobian."""
    p, x, slopes, u = arrays
    blocks, size = -(-states // directions), states * directions
    with loop(w, "block", str(blocks)) as block:
        units = _of_number(w, block, "%units", size)
        place = w.let(f"add i64 {w.let(f'mul i64 {k}, {blocks}')}, {block}")
        columns = _of_number(w, place, "%jacobian", size)
        given = pointers(p, "%r", x, slopes, "%dp", "%dr", units, columns, u)
        w.put(f"call void @motion({given})")


def reader(shape: Shape) -> str:
    """Return the function that samples a column of a run: sums of weighted rows."""
    w = Writer(shape, shape)
    total = w.let(f"alloca {shape.type}, align 64")
    with loop(w, "sample", "%samples") as m:
        w.put(f"store {shape.type} {shape.number(0.0)}, ptr {total}, align 64")
        begin = w.let(f"mul i64 {m}, %points")
        with loop(w, "point", "%points") as k:
            place = w.let(f"add i64 {begin}, {k}")
            row = w.let(f"load i64, ptr {w.address('%rows', place)}, align 8")
            first = w.let(f"mul i64 {w.let(f'mul i64 {row}, %pitch')}, {shape.lanes}")
            value = w.load(w.address("%run", first), 0, shape)
            weight = w.spread(w.load("%weights", place, ONE), shape)
            so_far = w.let(f"load {shape.type}, ptr {total}, align 64")
            summed = w.add_product(shape, so_far, value, weight)
            w.put(f"store {shape.type} {summed}, ptr {total}, align 64")
        result = w.let(f"load {shape.type}, ptr {total}, align 64")
        into = w.let(f"mul i64 {w.let(f'mul i64 {m}, %apart')}, {shape.lanes}")
        w.store(result, w.address("%into", into), 0, shape)
    w.put("ret void")
    arrays = ("run", "rows", "weights", "into")
    counts = ("samples", "points", "pitch", "apart")
    arguments = (*(f"ptr noalias %{a}" for a in arrays), *(f"i64 %{c}" for c in counts))
    return defined(f"internal void @read_{shape.suffix}", arguments, w)


def moved_inputs(shape: Shape, moving: int) -> str:
    """Return the function that writes the tangents of moving inputs at the points of a segment."""
    w = Writer(shape, shape)
    total = w.let(f"alloca {shape.type}, align 64")
    rows = w.let(f"mul i64 {w.let('add i64 %n, 1')}, {moving}")
    with loop(w, "row", rows) as row:
        w.put(f"store {shape.type} {shape.number(0.0)}, ptr {total}, align 64")
        begin = w.let(f"mul i64 {row}, %columns")
        own = w.let(f"mul i64 {w.let(f'urem i64 {row}, {moving}')}, %columns")
        with loop(w, "column", "%columns") as column:
            height = w.load("%shapes", w.let(f"add i64 {begin}, {column}"), ONE)
            place = w.let(f"mul i64 {w.let(f'add i64 {own}, {column}')}, {shape.lanes}")
            rate = w.load(w.address("%rates", place), 0, shape)
            so_far = w.let(f"load {shape.type}, ptr {total}, align 64")
            summed = w.add_product(shape, so_far, w.spread(height, shape), rate)
            w.put(f"store {shape.type} {summed}, ptr {total}, align 64")
        result = w.let(f"load {shape.type}, ptr {total}, align 64")
        w.store(result, w.address("%du", w.let(f"mul i64 {row}, {shape.lanes}")), 0, shape)
    w.put("ret void")
    arrays = (f"ptr noalias %{name}" for name in ("shapes", "rates", "du"))
    return defined("internal void @moved", (*arrays, "i64 %n", "i64 %columns"), w)


def defined(name: str, arguments: Sequence[str], body: Writer) -> str:
    """Return a function with its body."""
    head = f'define {name}({", ".join(arguments)}) "prefer-vector-width"="512" {{'
    return "\n".join([head, "entry:", *body.lines, "}", ""])


@contextmanager
def loop(w: Writer, name: str, count: str) -> Iterator[str]:
    """Write a loop over what is written within, and give its counter."""
    before = w.block
    w.put(f"br label %{name}")
    w.label(name)
    w.put(f"%{name}.k = phi i64 [0, %{before}], [%{name}.next, %{name}.end]")
    inside = w.let(f"icmp slt i64 %{name}.k, {count}")
    w.put(f"br i1 {inside}, label %{name}.body, label %{name}.done")
    w.label(f"{name}.body")
    yield f"%{name}.k"
    w.put(f"br label %{name}.end")
    w.label(f"{name}.end")
    w.put(f"%{name}.next = add i64 %{name}.k, 1")
    w.put(f"br label %{name}")
    w.label(f"{name}.done")


def of_row(w: Writer, table: str, number: str, fields: Sequence[str]) -> dict[str, str]:
    """Read a row of a table, by the names of its fields."""
    first = w.address(table, w.let(f"mul i64 {number}, {len(fields)}"))
    return {
        field: w.let(f"load ptr, ptr {w.address(first, column)}, align 8")
        for column, field in enumerate(fields)
    }


def _of_number(w: Writer, number: str, array: str, size: int) -> str:
    """Write the address of the part, so many numbers, of a set, a point or a block."""
    return w.address(array, w.let(f"mul i64 {number}, {size}"))


def whole(w: Writer, address: str) -> str:
    """Write a field of a table as a whole number."""
    return w.let(f"ptrtoint ptr {address} to i64")


def pointers(*names: str) -> str:
    """Write addresses as arguments of a call."""
    return ", ".join(f"ptr {name}" for name in names)
