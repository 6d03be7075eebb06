"""The models of a standard, each fitted to the same records: exfit rank."""
