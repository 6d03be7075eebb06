"""The case file: its schema, its checks, its text."""
