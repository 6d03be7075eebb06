"""Many fits of cases, strategies and models, side by side: one runner, one store."""
