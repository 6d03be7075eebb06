"""What a fit leaves behind: as data, in files, in tables."""
