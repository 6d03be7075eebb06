"""The file of a programme: its sections, what contradicts itself in them, and its cases."""
