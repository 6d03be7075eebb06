"""Limiters of over- and underexcitation and of the stator current, a file for each."""

FAMILIES = {  # files that hold several models
    "uel": "UEL1 UEL2C"
}
