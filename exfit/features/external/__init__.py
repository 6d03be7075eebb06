"""Other programs that simulate in place of exfit: long-lived processes, lines of JSON."""
