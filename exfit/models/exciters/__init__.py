"""The exciters, a file each."""
