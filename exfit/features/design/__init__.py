"""Tests that are yet to be made: what they would show, and which would show most."""

COMMANDS = {
    "identify": (
        "examine",
        "Predict how well a planned test determines the parameters.",
        "command:identify",
    )
}

PUBLIC = {"design_test": "designed_test:design_test", "identify": "experiment_design:identify"}
