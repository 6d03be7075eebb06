"""Many runs at a time: the fits of several cases with several strategies."""

COMMANDS = {"batch": ("fit", "Fit many cases, and make a table of all.", "command:batch")}

PUBLIC = {"batch": "batch:batch", "read_fleet": "folder:read_fleet"}
