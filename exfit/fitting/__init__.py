"""From a case to residuals, and what they say about the parameters."""
