"""A fitted exciter as another model: where it starts, the steps it is compared in, the search."""
