"""What a programme shows: in the terminal, as figures, and as the page of its report."""
