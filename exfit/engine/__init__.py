"""From equations in plain Python to machine code; nothing else in exfit knows how."""
