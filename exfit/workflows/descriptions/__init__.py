"""A case and its records in words, as a report shows them."""
