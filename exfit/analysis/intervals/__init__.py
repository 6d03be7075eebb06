"""The intervals of a fit: by linear theory, of profiles and of their hulls over the minima."""
