"""What a least-squares fit determines of its parameters, and what it does not.

Arrays in, results out: a `Linearisation` of the fit at its minimum gives `confidence` (standard
errors, intervals), `identifiability` (what can move together unseen, and what to fix) and `effects`
(which parameter matters first).
"""
