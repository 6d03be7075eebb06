"""The exciters."""

FAMILIES = {  # files that hold several models; any other is named after its own
    "ac1": "AC1A AC1C EXAC1 EXAC1A",
    "ac2": "AC2A AC2C EXAC2",
    "ac3": "AC3A AC3C EXAC3",
    "ac4": "AC4A AC4C EXAC4",
    "ac5": "AC5A AC5C",
    "ac6": "AC6A AC6C",
    "ac7": "AC7B AC7C",
    "ac8": "AC8B AC8C ESAC8B",
    "dc1": "DC1A DC1C DC2A DC2C IEEET1 IEEEX1 EXDC2 EXDC2A",
    "dc4": "DC4B DC4C",
    "st1": "ST1A ST1C EXST1",
    "st2": "ST2A ST2C EXST2 IEEET3",
    "st3": "ST3A ST3C EXST3",
    "st4": "ST4B ST4C",
    "st5": "ST5B ST5C URST5T",
    "st6": "ST6B ST6C",
    "st7": "ST7B ST7C",
}
