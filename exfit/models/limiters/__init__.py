"""Limiters of overexcitation, of underexcitation and of the stator current."""

FAMILIES = {  # files that hold several models; any other is named after its own
    "oel": "OEL2C OEL3C OEL5C",
    "scl": "SCL1C SCL2C",
    "uel": "UEL1 UEL2C",
}
