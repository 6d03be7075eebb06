"""From records, tables and planners' files to a first case: exfit new."""

COMMANDS = {
    "new": ("start", "Make a case from a record and a model or a planner's file.", "command:new")
}
