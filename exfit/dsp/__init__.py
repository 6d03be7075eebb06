"""Signal processing on arrays; nothing here knows a case or a file."""
