"""The models of a standard, each fitted to the same records: exfit rank."""

COMMANDS = {
    "rank": (
        "examine",
        "Fit the records of a case under several models, and compare these.",
        "command:rank",
    )
}

PUBLIC = {"rank": "ranked_cases:rank"}
