"""The report of a fit: one page that can be handed in."""

COMMANDS = {
    "report": (
        "hand over",
        "Make a verification report of a fit or a validation.",
        "command:report",
    )
}
PUBLIC = {"report": "writing:write_report"}
