"""What can be worked out beside and after a fit."""
