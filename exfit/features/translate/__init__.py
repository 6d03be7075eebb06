"""A fitted exciter as another model: where it starts, the steps it is compared in, the search."""

COMMANDS = {
    "translate": (
        "hand over",
        "Find the parameters of another model for the same response.",
        "command:translate",
    )
}

PUBLIC = {"translate": "translate:translate"}
