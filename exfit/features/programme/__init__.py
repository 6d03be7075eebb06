"""Programmes: all tests of a unit, run in the order in which one feeds the next, and resumed."""

COMMANDS = {"run": ("fit", "Run all tests of a unit, each feeding the later ones.", "command:run")}

PUBLIC = {"run": "run:run", "saturation_curve": "saturation:saturation_curve"}

CHECKS = {"tests": "command:check"}

SECTIONS = {"tests": "programme_schema:ProgrammeSection"}
