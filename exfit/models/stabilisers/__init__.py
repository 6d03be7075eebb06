"""The power system stabilisers, a file each."""
