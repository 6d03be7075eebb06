"""Other forms of the residuals of a fit, on which searches descend."""
