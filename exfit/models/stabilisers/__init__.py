"""The power system stabilisers, a file each."""

FAMILIES = {  # files that hold several models
    "pss2": "PSS2B PSS2C",
    "pss3": "PSS3B PSS3C",
    "pss4": "PSS4B PSS4C",
}
