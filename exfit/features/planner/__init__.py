"""Planners' files."""

COMMANDS = {
    "import": ("start", "Make cases from a planner's dynamics file.", "commands:import_"),
    "export": (
        "hand over",
        "Write the result of a fit as records of a planner's file.",
        "commands:export",
    ),
}

PUBLIC = {
    "cases_of_table": "import_all:cases_of_table",
    "export": "export:export",
    "import_units": "import_all:import_units",
}
