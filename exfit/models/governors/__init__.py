"""The turbine governors, a file each."""
