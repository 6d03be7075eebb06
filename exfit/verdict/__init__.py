"""What a fit comes to: tests of its residuals, and the rule that judges by them."""
