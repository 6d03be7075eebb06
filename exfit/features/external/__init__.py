"""Other programs that simulate in place of exfit: long-lived processes, lines of JSON."""

PROGRAMS = {"external": "case_program:opened", "fmu": "case_program:opened"}
FAULTS = {"external": "checks:external_faults", "fmu": "checks:external_faults"}
