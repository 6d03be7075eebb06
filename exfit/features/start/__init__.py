"""From records, tables and planners' files to a first case, and to a report: new, verify."""

COMMANDS = {
    "new": ("start", "Make a case from a record: asks what it needs.", "command:new"),
    "verify": ("start", "Make a report from a record: new, fit, report in one.", "verify:verify"),
}
PUBLIC = {"new": "starting:new"}
