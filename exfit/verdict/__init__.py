"""What a fit comes to: tests of its residuals, and the rule that judges by them."""

from exfit.verdict.rule import verdict_alone, verdict_of

__all__ = ["verdict_alone", "verdict_of"]
