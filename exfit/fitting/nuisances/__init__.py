"""What a fit finds about records beside the parameters of the unit."""
