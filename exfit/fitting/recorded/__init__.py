"""What records show of a test: its steps, its references, the rest before an event, its inputs."""
