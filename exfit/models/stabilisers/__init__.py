"""The power system stabilisers."""

FAMILIES = {  # files that hold several models; any other is named after its own
    "pss2": "PSS2B PSS2C PSSSB",
    "pss3": "PSS3B PSS3C",
    "pss4": "PSS4B PSS4C",
    "canonical": "PSS6C PSS7C",
    "of_programs": "IEEEST ST2CUT STAB1 STAB2A WSCCST",
}
