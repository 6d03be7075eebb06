"""Power flow files of PSS/E (.raw), versions 32 to 36, as manual and files list their fields."""

KV, HIGH_KV, MVA, X = 18.0, 230.0, 120.0, 0.1  # of each unit; X on its base
SBASE, F0 = 100.0, 60
ENDS = ("BUS", "LOAD", "FIXED SHUNT", "VOLTAGE DROOP CONTROL", "GENERATOR",
        "SWITCHING DEVICE RATING SET", "BRANCH", "SYSTEM SWITCHING DEVICE", "TRANSFORMER",
        "AREA")  # fmt: skip
SINCE = {"SYSTEM SWITCHING DEVICE": 34, "VOLTAGE DROOP CONTROL": 36}
SINCE |= {"SWITCHING DEVICE RATING SET": 36}
OF_THREE_WINDINGS = (
    "900,901,902,'1 ',1,1,1,0,0,2,'THREE       ',1,1,1.0\n0,0.1,100,0,0.1,100\n1.0\n1.0\n1.0"
)


def power_flow(
    version=33,
    buses=(1, 9),
    cz=1,
    kv=KV,
    mva=MVA,
    named=True,
    own_x=0.0,
    ra=0.0,
    units=None,
    cw=1,
    taps=("1.0,0.0", "1.0,0.0"),
):
    """Return the text of a file: a machine 1 at each bus behind a transformer to bus 900.

    With ``own_x`` the machines have their transformer in their own rows, and there is no other.
    ``taps`` are WINDV and NOMV of the transformers, high side first. ``units`` are kV, MVA, R and X
    on its base by bus, in place of the same of all ``buses``.
    """
    base = SBASE if cz == 1 else 50.0
    units = units or dict.fromkeys(buses, (kv, mva, 0.002 * mva / base, X))
    ends = [end for end in ENDS if version >= SINCE.get(end, 0)]
    nreg = " 0," if version >= 35 else ""
    rows = {
        "BUS": [
            f"{bus},'UNIT {bus}     ',{kv:9.4f},2,   1,   1,   1,1.01,-3.5"
            for bus, (kv, *_) in units.items()
        ] + [f"900,'GRID / EAST ',{HIGH_KV},3,1,1,1,1.0,0.0"],
        "LOAD": ["900,'1 ',1,1,1,100.0,20.0,0,0,0,0,1,1,0"],
        "GENERATOR": [
            f"{bus},'1 ',80.0,10.0,50.0,-50.0,1.01,0,{nreg}{mva:10.3f}, {ra},0.2,0.0,{own_x},1.0,1"
            for bus, (_, mva, *_) in units.items()
        ],
        "BRANCH": ["900,901,'1 ',0.01,0.1,0.0"],
        "TRANSFORMER": [OF_THREE_WINDINGS] if own_x else [
            OF_THREE_WINDINGS,
            *(f"900, {bus},   0,'1 ',{cw},{cz},1,0.0,0.0,2,'T{bus}          ',1,   1,1.0\n"
              f" {r * base / mva:.6f}, {x * base / mva:.6f}, {50.0}\n{taps[0]},0.0\n{taps[1]}"
              for bus, (_, mva, r, x) in units.items()),
        ],
    }  # fmt: skip
    text = f"0,  {SBASE}, {version}, 0, 0, {F0}.00 / a grid, 2026\nTITLE\n\n"
    if version >= 34:
        text += "GENERAL, THRSHZ=0.0001\n@!a comment\n0 / END OF SYSTEM-WIDE DATA"
        text += ", BEGIN BUS DATA\n" if named else "\n"
    for end, following in zip(ends, (*ends[1:], "OTHER"), strict=True):
        text += "".join(f"{row}\n" for row in rows.get(end, ()))
        text += f"0 / END OF {end} DATA, BEGIN {following} DATA\n" if named else "0\n"
    return text + "Q\n"
