"""From records, tables and planners' files to a first case: exfit new."""
