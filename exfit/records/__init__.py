"""Records of measurements: reading, inspecting, recognising."""
