"""What a person sees: figures, terminal, report, the folder of a run."""
