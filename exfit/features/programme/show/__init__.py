"""A programme shown: in the terminal, as figures, and as the page of its report."""
