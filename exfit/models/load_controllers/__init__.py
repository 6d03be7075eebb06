"""The load controllers, which move the reference of a governor."""
