"""Many runs at a time: the fits of several cases with several strategies."""
