"""Two responses beside each other, whichever program each is from: exfit compare."""

COMMANDS = {"compare": ("examine", "Compare responses, from any program.", "command:compare")}

PUBLIC = {"compare": "agreement:compare"}
