"""The intervals of a fit: by linear theory, of profiles, their hulls, and with given errors."""
